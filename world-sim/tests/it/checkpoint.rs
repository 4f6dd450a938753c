//! A world that goes on from a checkpoint is the world that was.

use crate::driver::{Driver, instance, robot, scenario};
use model::*;
use protocol::codec;
use protocol::daemon_to_world::{Absence, Order, Ticket};
use protocol::world_to_daemon::{Notice, Standing, Standings};
use shoal_world_sim::{Checkpoint, World};

/// Everything that a world remembers: late joiners, restarts, faults, tasks, obstacles and goals that move by chance.
fn eventful() -> Scenario {
    let mut robots: Vec<Robot> = (0..6)
        .map(|slot| robot(slot, [-4.0 + slot as f64, -3.0], [4.0 - slot as f64, 3.0]))
        .map(|robot| Robot {
            rounds: None,
            restart: Restart { policy: RestartPolicy::OnFailure, limit: 3, delay_ticks: 4, ..Restart::NEVER },
            ..robot
        })
        .collect();
    let within = Bounds { x_m: [-5.0, 5.0], y_m: [-5.0, 5.0] };
    robots[2].goal_motion = Some(Motion::RandomWalk { speed_mps: 0.4, turn_every_s: 0.7, within });
    robots[2].rounds = Some(1);
    // There and back.
    let start = robots[4].start;
    robots[4].goals.push(start);
    (robots[3].kind, robots[3].start_yaw_rad) = (BodyKind::Unicycle, 1.0);
    for robot in &mut robots {
        (robot.radio_range_m, robot.radio_hysteresis_m) = (2.0, 0.7);
    }
    let mut scenario = scenario(robots);
    scenario.obstacles = vec![Obstacle {
        shape: Shape::Capsule(geometry::Capsule::disc([0.5, 0.5].into(), 0.4)),
        motion: Some(Motion::RandomWalk { speed_mps: 0.5, turn_every_s: 0.9, within }),
    }];
    let task = |x: f64| Task { goal: [x, 1.0].into(), yaw_rad: None, now: false, priority: 1, deadline_s: Some(9.0) };
    let at = |tick, what| TimelineEvent { tick, what };
    scenario.events = vec![
        at(7, TimelineAction::Fault { robot: 1, fault: Fault::Kill, ticks: None }),
        at(11, TimelineAction::Task { robot: 0, task: task(2.0) }),
        at(12, TimelineAction::Join { robot: 5 }),
        at(15, TimelineAction::Fault { robot: 4, fault: Fault::Mute, ticks: Some(20) }),
        at(21, TimelineAction::Fault { robot: 0, fault: Fault::Pause, ticks: Some(9) }),
        at(33, TimelineAction::Radio { robot: None, radio: Radio { drop: 0.5, ..Radio::PERFECT } }),
        at(52, TimelineAction::Leave { robot: 3 }),
    ];
    scenario
}

fn saved(world: &World) -> (Vec<u8>, Vec<Event>) {
    (codec::encode(&world.checkpoint()).unwrap(), world.events().to_vec())
}

#[test]
fn a_world_that_goes_on_from_any_tick_is_the_world_that_was() {
    let scenario = eventful();
    const END: u64 = 120;
    let mut whole = Driver::new(&scenario);
    whole.until(END);
    let whole = whole.world;
    let outcome = whole.outcome();
    assert!(outcome.goals_done > 0 && outcome.robots.iter().any(|robot| robot.reversals > 0), "{outcome:#?}");
    assert!(whole.contacts() > 0 && whole.events().len() > 20, "something happens: {:#?}", whole.events());
    let ticks = (0..END).step_by(7).chain([1, 8, 12, 13, 15, 22, 30, 33, 35, 52, 53]);
    for (from, opened) in ticks.flat_map(|tick| [(tick, false), (tick, true)]) {
        let mut driver = Driver::new(&scenario);
        driver.until(from);
        if opened {
            // What the opening did is done, and the same tick is opened again.
            driver.open();
        }
        let (bytes, mut events) = saved(&driver.world);
        // The log may have gone on.
        events.push(Event { tick: from, robot: None, kind: EventKind::Gap { lost_ms: 1 } });
        let checkpoint: Checkpoint<'_> = codec::decode(&bytes).unwrap();
        assert_eq!(checkpoint.tick(), from);
        driver.world = World::resume(&scenario, checkpoint, events).unwrap();
        assert_eq!(codec::encode(&driver.world.checkpoint()).unwrap(), bytes, "from tick {from}: nothing is lost");
        driver.until(END);
        assert_eq!(driver.world.outcome(), whole.outcome(), "from tick {from}, opened: {opened}");
    }
}

#[test]
fn a_checkpoint_of_something_else_is_refused() {
    let scenario = eventful();
    let mut driver = Driver::new(&scenario);
    driver.until(60);
    let (bytes, events) = saved(&driver.world);
    let refused = |scenario: &Scenario, events: &[Event]| {
        let checkpoint = codec::decode(&bytes).unwrap();
        World::resume(scenario, checkpoint, events.to_vec()).err().map(|error| error.to_string())
    };
    assert_eq!(refused(&scenario, &events), None);
    let mut small = scenario.clone();
    small.fleet.max_robots = 5;
    assert!(refused(&small, &events).unwrap().contains("another number of robots"));
    assert!(refused(&scenario, &events[1..]).unwrap().contains("the log is shorter"));
}

#[test]
fn a_new_daemon_is_told_how_everything_stands() {
    let scenario = eventful();
    let mut driver = Driver::new(&scenario);
    driver.until(3);
    let task = Task { goal: [9.0, 9.0].into(), yaw_rad: None, now: false, priority: 0, deadline_s: None };
    let here = driver.world.odometry(2);
    let near = Task { goal: [here.x_m, here.y_m].into(), now: true, ..task };
    for (id, index, task) in [(5, 0, task), (6, 0, task), (7, 2, near)] {
        driver.world.order(Order::Task { id: TaskId(id), index: RobotIndex(index), task });
    }
    driver.world.order(Order::Absent {
        instance: instance(4, 0),
        cause: Absence::Died { signal: Some(9), code: None, words: String::new() },
    });
    driver.until(5);
    driver.notices.clear();
    driver.world.order(Order::Resync(3));
    driver.until(6);
    let answer = driver.notices.into_iter().find_map(|(_, notice)| match notice {
        Notice::Standings(standings) => Some(standings),
        _ => None,
    });
    let stands = |slot: u32, incarnation: u32, standing: Standing| (instance(slot, incarnation), standing);
    let expected = Standings {
        number: 3,
        robots: vec![
            stands(0, 0, Standing::Present),
            stands(1, 0, Standing::Present),
            stands(2, 0, Standing::Present),
            stands(3, 0, Standing::Present),
            stands(4, 1, Standing::Awaited { told: true }),
            stands(5, 0, Standing::Awaited { told: false }),
        ],
        tasks: vec![(TaskId(5), RobotIndex(0), false), (TaskId(6), RobotIndex(0), false)],
        ended: vec![(TaskId(7), TaskStep::Done)],
    };
    assert_eq!(answer, Some(expected));
    // A task that a robot has, or has done, is taken a second time without being done a second time.
    for id in [5, 7] {
        driver.world.order(Order::Task { id: TaskId(id), index: RobotIndex(2), task: near });
    }
    driver.notices = Vec::new();
    driver.until(9);
    let said: Vec<&Notice> = driver.notices.iter().map(|(_, notice)| notice).collect();
    for id in [5, 7] {
        assert!(said.contains(&&Notice::Answer { ticket: Ticket::Task(TaskId(id)), refused: None }), "{said:?}");
    }
    assert!(!said.iter().any(|notice| matches!(notice, Notice::Task { .. })), "{said:?}");
    // One whose robot is gone is done by another robot.
    driver.world.order(Order::Remove { index: RobotIndex(0) });
    driver.until(10);
    driver.world.order(Order::Task { id: TaskId(5), index: RobotIndex(2), task: near });
    driver.until(12);
    let done = Notice::Task { id: TaskId(5), step: TaskStep::Done };
    assert!(driver.notices.iter().any(|(_, notice)| *notice == done), "{:?}", driver.notices);
}
