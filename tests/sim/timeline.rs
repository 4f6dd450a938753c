//! What the timeline does to robots, seen from outside: who is where, at exactly which tick.

use model::{EventKind, EventName, Gone, Partner, RobotIndex};
use nalgebra::Point2;
use shoal_tests::recording::{at, has_arrived, is_silent};
use shoal_tests::{Recording, build, scenario, seeds};

const HEAD: &str = r#"
    [clock]
    duration_s = 40
    [defaults]
    planner = "decentralized-apf"
    sensor_range_m = 3
    radio_range_m = 5
"#;

fn run(body: &str) -> Recording {
    Recording::of(&scenario(&format!("{HEAD}\n{body}")))
}

fn robot(id: &str, start: [f64; 2], goal: [f64; 2]) -> String {
    format!("[[robot]]\nid = \"{id}\"\nstart_m = {start:?}\ngoal_m = {goal:?}\n")
}

fn event(at_s: f64, kind: &str, robot: &str, more: &str) -> String {
    format!("[[event]]\nat_s = {at_s}\nkind = \"{kind}\"\nrobot = \"{robot}\"\n{more}\n")
}

/// Six robots swap through the middle; what happens to `r00`, and when.
fn ring(seed: u64, events: &str, defaults: &str) -> Recording {
    let text = format!(
        r#"
        {HEAD}
        {defaults}
        [layout]
        kind = "circle-swap"
        robots = 6
        radius_m = 6
        jitter_m = 0.4
        {events}
        "#
    );
    Recording::of(&build::with(&text, &build::seed(seed)))
}

#[test]
fn a_killed_robot_stays_and_is_avoided() {
    seeds(1..=5, |seed| {
        // At 5 s it is about a metre from the middle, in everybody's way.
        let run = ring(seed, &event(5.0, "kill", "r00", ""), "");
        let place = run.position(250, 0);
        assert!(!is_silent(run.robot(250, 0).unwrap()), "its command of tick 249 counts");
        for tick in 251..=run.outcome.ticks {
            let body = run.robot(tick, 0).expect("the body stays");
            assert!(is_silent(body), "tick {tick}");
            assert_eq!(at(body), place, "tick {tick}");
            assert_eq!((body.vx_mps, body.vy_mps), (0.0, 0.0), "tick {tick}");
        }
        let report = run.report();
        assert_eq!(report.outcome.arrived, 5, "{:#?}", report.unmet);
        assert_eq!(report.outcome.robot_contacts, 0, "{:#?}", report.unmet);
        assert!(!report.outcome.arrived_all && report.outcome.makespan_s.is_none());
        assert_eq!(report.per_robot[0].gone, Some(Gone::Dead));
        assert_eq!(run.events(0, EventName::Killed).map(|event| event.tick).collect::<Vec<_>>(), [250]);
    });
}

/// The dead body is what the others avoid: without it they drive elsewhere.
#[test]
fn a_dead_robot_is_an_obstacle_and_one_that_left_is_none() {
    // `still` is at its goal, in the way of `past`.
    let robots = robot("still", [0.0, 0.1], [0.0, 0.1]) + &robot("past", [-6.0, 0.0], [6.0, 0.0]);
    let nearest = |run: &Recording| {
        let place = Point2::new(0.0, 0.1);
        (run.frames.iter().filter_map(|frame| frame.robot(1)))
            .map(|body| (at(body) - place).norm())
            .fold(f64::INFINITY, f64::min)
    };
    let alive = run(&robots);
    let dead = run(&(robots.clone() + &event(1.0, "kill", "still", "")));
    let left = run(&(robots + &event(1.0, "leave", "still", "")));
    let alone = run(&robot("past", [-6.0, 0.0], [6.0, 0.0]));
    assert!(nearest(&alive) > 0.4, "{}", nearest(&alive));
    assert!(nearest(&dead) > 0.4, "{}", nearest(&dead));
    assert!(nearest(&left) < 0.2, "{}: straight through where it stood", nearest(&left));
    assert_eq!(left.outcome.robot_contacts + dead.outcome.robot_contacts, 0);
    // Whoever left leaves no trace: it was never near enough to be felt.
    for (tick, frame) in alone.frames.iter().enumerate() {
        let place = |body: &protocol::world_to_observer::FrameBody| (body.x_m, body.y_m, body.vx_mps, body.vy_mps);
        assert_eq!(frame.robot(0).map(place), left.robot(tick as u64, 1).map(place), "tick {tick}");
    }
}

#[test]
fn a_robot_that_leaves_is_gone_from_its_tick_on() {
    seeds(1..=3, |seed| {
        let run = ring(seed, &event(4.0, "leave", "r02", ""), "");
        assert!(run.robot(200, 2).is_some());
        assert!((201..=run.outcome.ticks).all(|tick| run.robot(tick, 2).is_none()));
        let report = run.report();
        assert!(report.outcome.arrived_all, "a robot that left owes nothing: {:#?}", report.unmet);
        assert_eq!(report.outcome.arrived, 5);
        assert_eq!(report.per_robot[2].gone, Some(Gone::Left));
        assert_eq!(report.exit_code, 0, "{:#?}", report.unmet);
    });
}

/// "Absent from exactly tick k": the command of tick k - 1 still moved it, the one of tick k + n moves it again.
#[test]
fn a_paused_robot_stands_still_for_exactly_its_ticks() {
    for ticks in [1_u32, 2, 7, 60] {
        let pause = format!("for_s = {}", f64::from(ticks) * 0.02);
        let run = ring(1, &event(3.0, "pause", "r01", &pause), "");
        let (from, until) = (150, 150 + u64::from(ticks));
        let place = run.position(from, 1);
        assert_ne!(run.position(from - 1, 1), place, "it was moving");
        for tick in from + 1..=until {
            let body = run.robot(tick, 1).expect("the body stays");
            assert!(is_silent(body) && at(body) == place, "{ticks} ticks: tick {tick}");
        }
        let body = run.robot(until + 1, 1).expect("the body stays");
        assert!(!is_silent(body) && at(body) != place, "{ticks} ticks: it goes on");
        let report = run.report();
        assert!(report.outcome.arrived_all && report.outcome.robot_contacts == 0, "{:#?}", report.unmet);
        assert_eq!(run.events(1, EventName::Paused).map(|event| event.tick).collect::<Vec<_>>(), [from]);
        assert_eq!(run.events(1, EventName::Resumed).map(|event| event.tick).collect::<Vec<_>>(), [until]);
        assert_eq!(report.per_robot[1].incarnation, 0, "the same life");
    }
}

#[test]
fn the_others_avoid_a_paused_robot() {
    seeds(1..=5, |seed| {
        let run = ring(seed, &event(5.0, "pause", "r00", "for_s = 8"), "");
        assert_eq!(run.outcome.robot_contacts, 0);
        assert!(run.report().outcome.arrived_all);
    });
}

#[test]
fn a_killed_robot_comes_back_as_its_next_life() {
    seeds(1..=3, |seed| {
        let defaults = "restart = \"on-failure\"\nrestart_limit = 2\nrestart_delay_s = 0.5";
        let events = event(3.0, "kill", "r04", "") + &event(5.0, "kill", "r04", "");
        let run = ring(seed, &events, defaults);
        for (died, back) in [(150, 175), (250, 275)] {
            let place = run.position(died, 4);
            assert!((died + 1..=back).all(|tick| run.position(tick, 4) == place), "it stands where it fell");
            assert!(run.position(back + 1, 4) != place, "it goes on at tick {back}");
        }
        assert_eq!(run.events(4, EventName::Restarted).map(|event| event.tick).collect::<Vec<_>>(), [175, 275]);
        let report = run.report();
        assert_eq!(report.per_robot[4].incarnation, 2);
        assert_eq!(report.exit_code, 0, "{:#?}", report.unmet);
    });
}

#[test]
fn the_last_life_is_the_last() {
    let defaults = "restart = \"on-failure\"\nrestart_limit = 1\nrestart_delay_s = 0.5";
    let run = ring(1, &(event(3.0, "kill", "r04", "") + &event(5.0, "kill", "r04", "")), defaults);
    let place = run.position(250, 4);
    assert!((251..=run.outcome.ticks).all(|tick| run.position(tick, 4) == place));
    assert_eq!(run.report().per_robot[4].gone, Some(Gone::Dead));
}

/// Restarts count for the limit and for the delay while they are in the window, in simulated time.
#[test]
fn a_window_and_growing_delays() {
    let defaults = "restart = \"on-failure\"\nrestart_limit = 2\nrestart_window_s = 6\nrestart_delay_s = 0.2\n\
                    restart_backoff = 3";
    let kills: String = [1.0, 2.0, 7.5, 8.2].map(|at_s| event(at_s, "kill", "r04", "")).concat();
    let run = ring(1, &kills, defaults);
    let ticks = |kind| run.events(4, kind).map(|event| event.tick).collect::<Vec<_>>();
    // 0.2 s after the first, three times that after the second; at 7.5 s the first does not count, and at 8.2 s the second
    // does not.
    assert_eq!(ticks(EventName::Restarted), [60, 130, 405, 440], "{:?}", ticks(EventName::Killed));
    assert!(ticks(EventName::RestartLimit).is_empty());
    let run = ring(1, &(kills + &event(9.0, "kill", "r04", "")), defaults);
    let ticks = |kind| run.events(4, kind).map(|event| event.tick).collect::<Vec<_>>();
    assert_eq!((ticks(EventName::RestartLimit), ticks(EventName::Restarted).len()), (vec![450], 4));
    let report = run.report();
    let limit = report.events.iter().find(|event| event.kind == EventName::RestartLimit).expect("it is in the report");
    assert_eq!(limit.detail, "2 restarts within 300 ticks, which is its restart_limit: it stays dead");
}

/// Before it joins there is nothing of it: not for sensors, not for the radio, not for the clock.
#[test]
fn a_late_joiner_is_nobody_before_its_tick() {
    let robots = robot("a", [-6.0, 0.0], [6.0, 0.0]) + &robot("b", [6.0, 0.5], [-6.0, 0.5]);
    let late = robot("late", [-1.5, 0.2], [-1.5, 6.0]) + &event(3.0, "join", "late", "");
    let (with, without) = (run(&(robots.clone() + &late)), run(&robots));
    for tick in 0..=150 {
        assert!(with.robot(tick, 2).is_none(), "tick {tick}");
        assert_eq!(with.frames[tick as usize], without.frames[tick as usize], "tick {tick}");
    }
    let first = with.robot(151, 2).expect("it entered at tick 150 and has driven one tick");
    assert!((at(first) - Point2::new(-1.5, 0.2)).norm() <= 0.02 + 1e-9);
    assert!(with.frames[160..].iter().zip(&without.frames[160..]).any(|(a, b)| a.robot(0) != b.robot(0)));
    let report = with.report();
    let late = &report.per_robot[2];
    let arrived = with.events(2, EventName::Arrived).next().expect("it arrives").tick;
    assert_eq!(late.time_s, Some((arrived - 150) as f64 * 0.02), "its time counts from when it joined");
    assert_eq!(report.exit_code, 0, "{:#?}", report.unmet);
}

/// Its place may be taken by then: that is a contact, counted once, and they get apart.
#[test]
fn joining_inside_another_body_is_one_contact() {
    let robots = robot("a", [0.0, 0.0], [0.0, 0.0]) + &robot("late", [0.1, 0.05], [5.0, 0.0]);
    let run = run(&(robots + &event(1.0, "join", "late", "")));
    assert_eq!(run.outcome.robot_contacts, 1);
    assert_eq!(run.outcome.robots.iter().map(|robot| robot.contacts).collect::<Vec<_>>(), [1, 1]);
    let contact =
        run.outcome.events.iter().find(|event| event.kind.name() == EventName::Contact).expect("it is in the log");
    assert_eq!(contact.tick, 50);
    assert!(matches!(contact.kind, EventKind::Contact { with: Partner::Robot(RobotIndex(1)), .. }), "{contact:?}");
    assert!(run.report().outcome.arrived_all);
}

#[test]
fn tasks_queue_or_take_over() {
    let a = robot("a", [-6.0, 0.0], [0.0, 0.0]);
    let reached = |run: &Recording, place: Point2<f64>| {
        run.frames
            .iter()
            .find(|frame| frame.robot(0).is_some_and(|body| (at(body) - place).norm() <= 0.1))
            .map(|frame| frame.tick)
    };
    let queued = run(&(a.clone() + &event(2.0, "task", "a", "goal_m = [0, 5]")));
    let (first, second) = (reached(&queued, Point2::new(0.0, 0.0)), reached(&queued, Point2::new(0.0, 5.0)));
    assert!(first.is_some() && first < second, "{first:?} then {second:?}");
    assert!(!has_arrived(queued.robot(first.unwrap(), 0).unwrap()), "there is one more to come");
    let at_once = run(&(a.clone() + &event(2.0, "task", "a", "goal_m = [-4, 5]\nnow = true")));
    assert_eq!(reached(&at_once, Point2::new(0.0, 0.0)), None, "forgotten");
    assert!(at_once.report().outcome.arrived_all);
    let late = run(&(a + &event(20.0, "task", "a", "goal_m = [0, 3]")));
    let arrivals: Vec<u64> = late.events(0, EventName::Arrived).map(|event| event.tick).collect();
    assert_eq!(arrivals.len(), 2, "it arrives, is sent on, and arrives again");
    let report = late.report();
    assert_eq!(report.outcome.makespan_s, Some(arrivals[1] as f64 * 0.02), "up to its last goal");
    assert_eq!((report.per_robot[0].tasks_done, report.per_robot[0].path_ratio), (1, None));
}

#[test]
fn tasks_that_a_robot_cannot_keep_are_in_the_report() {
    let tasks: String =
        (0..70).map(|i| event(1.0, "task", "a", &format!("goal_m = [{}, 5]", f64::from(i) * 0.05))).collect();
    let run = run(&(robot("a", [-6.0, 0.0], [0.0, 0.0]) + &tasks));
    let (taken, ignored) = (run.events(0, EventName::Task).count(), run.events(0, EventName::Ignored).count());
    assert_eq!((taken, ignored), (64, 6), "as many wait as a robot keeps");
    let told = run.report().events.into_iter().filter(|event| event.kind == EventName::Ignored);
    assert!(told.into_iter().all(|event| event.detail == "timeline: too many goals are waiting"));
}
