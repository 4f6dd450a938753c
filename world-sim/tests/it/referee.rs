//! Goals, tasks, times and paths.

use crate::driver::{Driver, HZ, at, instance, robot, scenario};
use geometry::Capsule;
use model::{
    BodyKind, EventName, Fault, MAX_GOALS, Motion, Obstacle, PlanState, RobotIndex, RobotOutcome, Scenario, Shape,
    Stall, Task, TaskEnd, TaskId, TaskStep, TimelineAction,
};
use nalgebra::Point2;
use protocol::daemon_to_world::{FaultId, Order, Ticket};
use protocol::world_to_daemon::Notice;
use shoal_world_sim::World;

fn one() -> Scenario {
    scenario(vec![robot(0, [0.0, 0.0], [2.0, 0.0])])
}

fn run(scenario: &Scenario) -> RobotOutcome {
    Driver::new(scenario).run().robots.remove(0)
}

fn task(goal: [f64; 2], now: bool) -> TimelineAction {
    TimelineAction::Task { robot: 0, task: Task { now, ..Task::to(goal) } }
}

/// Ticks until arrival, path length and goals done, against numbers that a reader can add up: 1 m/s, ten ticks a second.
fn check(scenario: &Scenario, ticks: u64, path_m: f64, goals_done: u32, tasks_done: u32) {
    let outcome = run(scenario);
    assert!(outcome.arrived);
    assert_eq!(outcome.arrived_tick.map(|tick| tick - outcome.joined_tick), Some(ticks));
    assert_eq!(outcome.time_s, Some(ticks as f64 / HZ));
    assert!((outcome.path_length_m - path_m).abs() < 1e-9, "{}", outcome.path_length_m);
    assert_eq!((outcome.goals_done, outcome.tasks_done), (goals_done, tasks_done));
}

#[test]
fn a_robot_arrives_when_it_is_within_the_tolerance() {
    check(&one(), 20, 2.0, 1, 0);
    let mut scenario = one();
    scenario.robots[0].goal_tolerance_m = 0.55;
    check(&scenario, 15, 1.5, 1, 0);
    scenario.robots[0].goals = vec![Point2::new(0.5, 0.0)];
    check(&scenario, 0, 0.0, 1, 0);
    scenario.robots[0].goals.push(Point2::new(-0.5, 0.0));
    check(&scenario, 0, 0.0, 2, 0);
}

#[test]
fn times_count_from_the_join() {
    let mut late = one();
    late.events = vec![at(7, TimelineAction::Join { robot: 0 })];
    check(&late, 20, 2.0, 1, 0);
}

#[test]
fn a_task_queues_behind_the_goals_or_replaces_them() {
    let mut queued = one();
    queued.events = vec![at(5, task([2.0, 3.0], false)), at(6, task([0.0, 3.0], false))];
    check(&queued, 70, 7.0, 3, 2);
    let mut now = one();
    now.robots[0].goals.push(Point2::new(8.0, 8.0));
    now.events = vec![at(5, task([0.5, 3.0], true))];
    check(&now, 35, 3.5, 1, 1);
    // After the arrival a task takes it back, and the time counts to the new last goal.
    let mut after = one();
    after.events = vec![at(30, task([2.0, 1.0], false))];
    check(&after, 40, 3.0, 2, 1);
    assert_eq!(run(&after).path_ratio, None, "no plan of the scenario to compare with");
}

#[test]
fn operators_task_as_the_timeline_does_but_not_without_bounds() {
    let order = |task, goal_m: [f64; 2], now| Order::Task {
        id: TaskId(task),
        index: RobotIndex(0),
        task: Task { now, ..Task::to(goal_m) },
    };
    let mut driver = Driver::new(&one());
    driver.until(5);
    driver.world.order(order(1, [2.0, 1.0], false));
    driver.open();
    assert_eq!((driver.world.odometry(0).goals_left, driver.world.odometry(0).goal_y_m), (2, 0.0));
    driver.close();
    driver.world.order(order(2, [f64::NAN, 1.0], true));
    driver.world.order(Order::Task {
        id: TaskId(3),
        index: RobotIndex(7),
        task: Task { now: true, ..Task::to([0.0, 0.0]) },
    });
    (0..MAX_GOALS as u32).for_each(|i| driver.world.order(order(4 + i, [2.0, 1.0], false)));
    driver.tick();
    assert_eq!(driver.world.odometry(0).goals_left as usize, 1 + MAX_GOALS);
    assert_eq!(driver.logged(EventName::Ignored, 0), [6, 6]);
    // Every order is answered, and what was taken is what there is.
    let answers = driver.notices.iter().filter_map(|(_, notice)| match notice {
        Notice::Answer { ticket: Ticket::Task(TaskId(task)), refused } => Some((*task, refused.as_deref())),
        _ => None,
    });
    let refused: Vec<(u32, &str)> = answers.clone().filter_map(|(task, refused)| Some((task, refused?))).collect();
    let last = 3 + MAX_GOALS as u32;
    let expected = [(2, "the goal is nowhere"), (3, "unknown robot"), (last, "too many goals are waiting")];
    assert_eq!((refused, answers.count()), (expected.to_vec(), 3 + MAX_GOALS));
    assert_eq!(driver.logged(EventName::Ignored, 7), [6]);
    let outcome = driver.run();
    assert_eq!((outcome.robots[0].tasks_done, outcome.robots[0].goals_done), (64, 65));
    assert!(
        outcome
            .events
            .iter()
            .any(|event| event.kind.name() == EventName::TaskDone && event.kind.detail(&|_| String::new()) == "task 1")
    );
}

#[test]
fn the_last_goal_can_move() {
    let mut scenario = one();
    scenario.robots[0].goal_motion =
        Some(Motion::Orbit { center: [2.0, 0.0].into(), radius_m: 1.0, omega_radps: 0.3, phase_rad: 0.0 });
    let mut driver = Driver::new(&scenario);
    driver.open();
    assert_eq!(driver.world.odometry(0).goal_x_m, 3.0, "it is on the orbit from the start");
    driver.close();
    driver.open();
    let odometry = driver.world.odometry(0);
    let expected = Point2::new(2.0 + 0.03f64.cos(), 0.03f64.sin());
    assert!((Point2::new(odometry.goal_x_m, odometry.goal_y_m) - expected).norm() < 1e-12);
    driver.close();
    let outcome = driver.run().robots.remove(0);
    assert!(outcome.arrived && outcome.path_ratio.is_none());
}

#[test]
fn a_fleet_that_has_arrived_waits_for_what_is_to_come() {
    let ends = |events| {
        let mut scenario = one();
        scenario.robots.push(robot(1, [0.0, 3.0], [0.5, 3.0]));
        scenario.events = events;
        Driver::new(&scenario).run().ticks
    };
    assert_eq!(ends(vec![]), 20);
    assert_eq!(ends(vec![at(50, TimelineAction::kill(0)), at(60, TimelineAction::pause(0, 5))]), 20);
    assert_eq!(ends(vec![at(50, task([2.0, 0.0], false))]), 51);
    assert_eq!(ends(vec![at(50, TimelineAction::Join { robot: 1 })]), 55);
    assert_eq!(ends(vec![at(50, TimelineAction::Leave { robot: 1 })]), 51);
    assert_eq!(ends(vec![at(15, TimelineAction::pause(1, 30))]), 46);
    assert_eq!(ends(vec![at(3, TimelineAction::kill(0))]), 5, "the dead are not waited for");
    assert_eq!(ends(vec![at(3, TimelineAction::kill(0)), at(90, task([2.0, 0.0], false))]), 5);
}

#[test]
fn who_stands_short_of_the_goal_is_deadlocked() {
    let mut scenario = one();
    scenario.robots.push(robot(1, [0.0, 3.0], [9.0, 3.0]));
    scenario.robots.push(robot(2, [0.0, 6.0], [9.0, 6.0]));
    scenario.clock.ticks_max = 200;
    let mut driver = Driver::new(&scenario);
    while !driver.world.finished() {
        driver.world.open(&mut |_| true);
        let tick = driver.world.tick();
        driver.world.close(&mut |instance| {
            // Robot 1 drives for half the time and stands for half, robot 2 creeps on.
            let x = [1.0, if tick < 100 { 0.1 } else { 0.0 }, 0.06][instance.index.at()];
            let arrived = instance.index.0 == 0 && tick >= 20;
            Some(model::Drive::Velocity(nalgebra::Vector2::new(if arrived { 0.0 } else { x }, 0.0)))
        });
    }
    let robots = driver.world.outcome().robots;
    assert_eq!([0, 1, 2].map(|slot: usize| robots[slot].stall), [None, Some(Stall::Deadlocked), None]);
    assert_eq!([0, 1, 2].map(|slot: usize| robots[slot].arrived), [true, false, false]);
}

#[test]
fn path_ratios_compare_with_the_shortest_free_way() {
    let ratio = |scenario: &Scenario| run(scenario).path_ratio.unwrap();
    assert!((ratio(&one()) - 1.0).abs() < 1e-9);
    // The way ends at the tolerance, for both.
    let mut short = one();
    short.robots[0].goal_tolerance_m = 0.5;
    assert!((ratio(&short) - 1.0).abs() < 1e-9);
    // Going through a wall is shorter than the way around it, and no free path.
    let mut through = one();
    let wall = Capsule::segment(Point2::new(1.0, -1.0), Point2::new(1.0, 1.0));
    through.obstacles = vec![Obstacle { shape: Shape::Capsule(wall), motion: None }];
    assert_eq!(run(&through).path_ratio, None);
    // An obstacle that moves may be anywhere else.
    let points = vec![Point2::new(1.0, -1.0), Point2::new(9.0, -1.0)];
    through.obstacles[0].motion = Some(Motion::Waypoints { points, speed_mps: 0.1, then: model::AtEnd::Stop });
    assert!((ratio(&through) - 1.0).abs() < 1e-9);
    // A unicycle that has to turn first drives a detour.
    let mut turning = one();
    turning.robots[0].kind = BodyKind::Unicycle;
    turning.robots[0].start_yaw_rad = 1.5;
    assert!((1.0..1.3).contains(&ratio(&turning)), "{}", ratio(&turning));
    assert!(run(&turning).ldj.is_some());
}

/// Runs with these x velocities (m/s), and then with none, until the tick.
fn drive(scenario: &Scenario, ticks: usize, velocities: &[f64]) -> RobotOutcome {
    let mut world = World::new(scenario);
    for tick in 0..ticks {
        let x = velocities.get(tick).copied().unwrap_or(0.0);
        world.open(&mut |_| true);
        world.close(&mut |_| Some(model::Drive::Velocity(nalgebra::Vector2::new(x, 0.0))));
    }
    world.outcome().robots.remove(0)
}

#[test]
fn the_time_that_is_lost_is_what_the_shortest_way_would_not_have_taken() {
    let lost = |outcome: &RobotOutcome| outcome.time_lost_s.map(|lost_s| (1e9 * lost_s).round() / 1e9);
    // 2 m at 1 m/s, of which the tolerance is 5 cm: 1.95 s, and it is there after twenty ticks.
    assert_eq!(lost(&run(&one())), Some(0.05));
    let mut near = one();
    near.robots[0].goal_tolerance_m = 0.5;
    assert_eq!(lost(&run(&near)), Some(0.0));
    near.robots[0].limits.speed_mps_max = 4.0;
    assert_eq!(lost(&run(&near)), Some(0.025), "1.5 m take 0.375 s, and the fourth tick is whole");
    near.robots[0].goals = vec![Point2::new(0.3, 0.0)];
    assert_eq!((lost(&run(&near)), run(&near).path_ratio), (Some(0.0), None), "it is there from the start");
    // A rest of 3 s on the way, and a way of 1 m back.
    let waits = [&[1.0; 10][..], &[0.0; 30], &[1.0; 10]].concat();
    assert_eq!(lost(&drive(&one(), 60, &waits)), Some(3.05));
    let back = [&[1.0; 10][..], &[-1.0; 10], &[1.0; 20]].concat();
    assert_eq!(lost(&drive(&one(), 60, &back)), Some(2.05));
    // Goals on the way are part of it: 2 m, and 1 m up.
    let mut corner = one();
    corner.robots[0].goals.push(Point2::new(2.0, 1.0));
    assert_eq!(lost(&run(&corner)), Some(0.15), "1.95 m, and from tolerance to tolerance 0.9 m");
    // The way that counts goes round a wall: over its end, both discs grown by the radius.
    let mut around = one();
    let wall = Capsule::segment(Point2::new(1.0, -3.0), Point2::new(1.0, 0.0));
    around.obstacles = vec![Obstacle { shape: Shape::Capsule(wall), motion: None }];
    around.robots[0].goals = vec![Point2::new(0.0, 2.0), Point2::new(2.0, 2.0), Point2::new(2.0, 0.0)];
    assert_eq!(run(&around).time_s, Some(6.0));
    assert_eq!(lost(&run(&around)), Some(0.25), "three legs of 2 m");
    around.robots[0].goals = vec![Point2::new(2.0, 0.0)];
    assert_eq!(lost(&run(&around)), None, "it went through");
    // Acceleration and turning are lost time too.
    let mut slow = one();
    slow.robots[0].limits.accel_mps2_max = 1.0;
    assert_eq!(lost(&run(&slow)), Some(0.45), "1 m/s after ten ticks of 1 to 10 cm");
    let mut turning = one();
    (turning.robots[0].kind, turning.robots[0].start_yaw_rad) = (BodyKind::Unicycle, 1.5);
    assert!(run(&turning).time_lost_s.unwrap() > 0.2, "{:?}", run(&turning));
    // It counts from the join, and only what the scenario planned compares.
    let mut late = one();
    late.events = vec![at(7, TimelineAction::Join { robot: 0 })];
    assert_eq!(lost(&run(&late)), Some(0.05));
    late.events = vec![at(3, task([3.0, 0.0], false))];
    assert_eq!(lost(&run(&late)), None);
    assert_eq!(lost(&drive(&one(), 60, &[1.0; 10])), None, "it has not arrived");
}

#[test]
fn reversals_and_the_last_speed_are_those_of_the_robot() {
    // Two reversals until it arrives, and it goes on within the tolerance.
    let mut scenario = one();
    scenario.robots[0].goal_tolerance_m = 0.5;
    let velocities = [&[1.0; 10][..], &[-1.0; 5], &[1.0; 12], &[-1.0, 1.0, -1.0, 1.0]].concat();
    let outcome = drive(&scenario, 60, &velocities);
    assert_eq!((outcome.arrived_tick, outcome.reversals, outcome.end_speed_mps), (Some(25), 2, None));
    // Out of the tolerance it has not arrived, and all of them count.
    let gone = drive(&scenario, 60, &[&velocities[..], &[-1.0; 10]].concat());
    assert_eq!((gone.arrived, gone.reversals), (false, 7));
    let speed = |outcome: RobotOutcome| (1e9 * outcome.end_speed_mps.unwrap()).round() / 1e9;
    assert_eq!(speed(drive(&one(), 150, &[0.1; 10])), 0.0);
    // The first tick is the first mark, and what was driven in it is not in the window.
    assert_eq!(speed(drive(&one(), 41, &[0.1; 21])), 0.05);
}

#[test]
fn goals_of_the_fleet_are_counted_however_robots_come_and_go() {
    let mut scenario = one();
    scenario.robots[0].goals = vec![Point2::new(1.0, 0.0), Point2::new(0.0, 0.0)];
    scenario.robots[0].rounds = None;
    scenario.robots.push(robot(1, [0.0, 3.0], [1.0, 3.0]));
    scenario.events = vec![at(65, TimelineAction::Leave { robot: 0 })];
    let mut driver = Driver::new(&scenario);
    // A goal every ten ticks, and one of the robot that goes once.
    let mut counts = Vec::new();
    for tick in [9, 10, 20, 64, 70] {
        driver.until(tick);
        counts.push(driver.world.outcome().goals_done);
    }
    assert_eq!(counts, [0, 2, 3, 7, 7]);
    // Another robot in its place: its goals come on top.
    driver.world.order(Order::Admit { instance: instance(0, 1), robot: Box::new(robot(0, [0.0, -3.0], [0.5, -3.0])) });
    driver.until(71);
    let bytes = protocol::codec::encode(&driver.world.checkpoint()).unwrap();
    driver.until(100);
    let outcome = driver.world.outcome();
    assert_eq!((outcome.goals_done, outcome.robots[0].goals_done), (8, 1));
    // A world that goes on from a checkpoint has not forgotten the robot that left.
    let checkpoint = protocol::codec::decode(&bytes).unwrap();
    driver.world = World::resume(&scenario, checkpoint, outcome.events).unwrap();
    driver.until(100);
    assert_eq!(driver.world.outcome().goals_done, 8);
}

#[test]
fn a_fast_robot_takes_its_waypoints_where_it_passes_them_and_in_their_order() {
    // Three metres a tick, past two waypoints of a centimetre in one tick, and back to one that it has passed before.
    let mut scenario = one();
    scenario.robots[0].limits.speed_mps_max = 30.0;
    scenario.robots[0].goal_tolerance_m = 0.01;
    scenario.robots[0].goals =
        [[10.0, 0.0], [10.5, 0.005], [10.5, 0.0], [10.2, 0.0], [20.0, 0.0]].map(Point2::from).to_vec();
    let mut driver = Driver::new(&scenario);
    let drive = |x: f64| Some(model::Drive::Velocity(nalgebra::Vector2::new(x, 0.0)));
    let mut done = Vec::new();
    for x in [30.0, 30.0, 30.0, 30.0, -30.0, 30.0, 30.0, 30.0, 30.0] {
        driver.world.open(&mut |_| true);
        driver.world.close(&mut |_| drive(x));
        done.push(driver.world.odometry(0).goals_done);
    }
    // The last goal is passed in the last tick, but it is not there when that ends.
    assert_eq!(done, [0, 0, 0, 3, 4, 4, 4, 4, 4]);
    driver.world.open(&mut |_| true);
    driver.world.close(&mut |_| drive(-10.0));
    assert_eq!(driver.world.odometry(0).goals_done, 5);
    assert!(driver.world.outcome().robots[0].arrived);
}

/// A robot that is pushed off its goal after it has arrived.
#[test]
fn who_leaves_its_goal_has_not_arrived_until_it_is_back() {
    use protocol::world_to_robot::Odometry;
    let mut scenario = one();
    scenario.robots.push(robot(1, [0.0, 5.0], [9.0, 5.0]));
    let mut driver = Driver::new(&scenario);
    driver.until(20);
    let step = |driver: &mut Driver, x: f64| {
        driver.world.open(&mut |_| true);
        driver.world.close(&mut |instance| {
            Some(model::Drive::Velocity(nalgebra::Vector2::new(if instance.index.0 == 0 { x } else { 0.0 }, 0.0)))
        });
        let outcome = driver.world.outcome().robots.remove(0);
        assert_eq!(driver.world.odometry(0).has(Odometry::FLAG_ARRIVED), outcome.arrived);
        assert_eq!(outcome.time_s.is_some(), outcome.arrived);
        outcome
    };
    let outcome = step(&mut driver, 0.0);
    assert_eq!((outcome.arrived, outcome.time_s, outcome.goals_done), (true, Some(2.0), 1));
    assert!(step(&mut driver, 0.4).arrived, "still within the tolerance");
    let off = step(&mut driver, 1.0);
    assert_eq!((off.arrived, off.goals_done, off.stall), (false, 1, None));
    assert!((off.final_distance_m.unwrap() - 0.14).abs() < 1e-9);
    assert_eq!(driver.world.odometry(0).goals_left, 1, "it is to go back");
    // Back again: the time and the path are those of the arrival that lasts, the goal is done once.
    let back = step(&mut driver, -1.0);
    assert_eq!((back.arrived, back.arrived_tick, back.goals_done), (true, Some(24), 1));
    assert!((back.path_length_m - 2.24).abs() < 1e-9);
    // A task that comes while it is off its goal is not kept waiting for it.
    step(&mut driver, 1.0);
    driver.world.order(Order::Task { id: TaskId(1), index: RobotIndex(0), task: Task::to([2.0, 1.0]) });
    step(&mut driver, 0.0);
    assert_eq!((driver.world.odometry(0).goal_y_m, driver.world.odometry(0).goals_left), (1.0, 1));
    let events = driver.world.outcome().events;
    let kinds = |kind: EventName| {
        events.iter().filter(|event| event.kind.name() == kind && event.robot == Some(RobotIndex(0))).count()
    };
    assert_eq!((kinds(EventName::Arrived), kinds(EventName::OffGoal)), (1, 2));
}

#[test]
fn a_goal_that_moves_is_caught_once_and_for_all() {
    let mut scenario = one();
    scenario.robots.push(robot(1, [0.0, 5.0], [9.0, 5.0]));
    let points = vec![Point2::new(2.0, 0.0), Point2::new(9.0, 0.0)];
    scenario.robots[0].goal_motion = Some(Motion::Waypoints { points, speed_mps: 0.5, then: model::AtEnd::Stop });
    let mut world = shoal_world_sim::World::new(&scenario);
    for _ in 0..80 {
        world.open(&mut |_| true);
        let speed = if world.outcome().robots[0].arrived { 0.0 } else { 1.0 };
        world.close(&mut |_| Some(model::Drive::Velocity(nalgebra::Vector2::new(speed, 0.0))));
    }
    let robot = world.outcome().robots.remove(0);
    assert!(robot.arrived && robot.final_distance_m.unwrap() > 1.0, "{robot:?}");
}

// ---- the life of a task

/// A task for the robot in slot 0.
fn order(task: u32, goal: Task) -> Order {
    Order::Task { id: TaskId(task), index: RobotIndex(0), task: goal }
}

/// What the daemon was told of the tasks, with the ticks.
fn steps(driver: &Driver) -> Vec<(u64, u32, TaskStep)> {
    let step = |(tick, notice): &(u64, Notice)| match notice {
        Notice::Task { id: TaskId(task), step } => Some((*tick, *task, *step)),
        _ => None,
    };
    driver.notices.iter().filter_map(step).collect()
}

#[test]
fn a_task_is_followed_from_the_robot_to_its_end() {
    let mut driver = Driver::new(&one());
    driver.world.order(order(1, Task::to([3.5, 0.0])));
    driver.world.order(order(2, Task { priority: 1, ..Task::to([3.2, 0.0]) }));
    let outcome = driver.run();
    assert_eq!(outcome.robots[0].tasks_done, 2);
    let steps: Vec<(u32, TaskStep)> = steps(&driver).into_iter().map(|(_, task, step)| (task, step)).collect();
    // The one of higher priority waited less, though it came later; both waited for the goal of the scenario, which was begun.
    use TaskStep::{Active, Done};
    assert_eq!(steps, [(2, Active), (2, Done), (1, Active), (1, Done)]);
}

#[test]
fn a_task_that_is_replaced_or_cancelled_is_dropped() {
    let mut driver = Driver::new(&one());
    driver.world.order(order(1, Task::to([3.5, 0.0])));
    driver.world.order(order(2, Task { now: true, ..Task::to([9.0, 0.0]) }));
    driver.world.order(order(3, Task::to([9.0, 9.0])));
    driver.until(5);
    let cancel = |task: u32| Order::Cancel { id: TaskId(task), index: RobotIndex(0) };
    [3, 2, 2, 1].map(cancel).into_iter().for_each(|order| driver.world.order(order));
    driver.open();
    // Without any goal it stays where it is.
    let odometry = driver.world.odometry(0);
    assert_eq!((odometry.goal_x_m, odometry.goal_y_m), (odometry.x_m, odometry.y_m));
    driver.close();
    use TaskStep::{Active, Dropped};
    let expected = [
        (0, 1, Dropped(TaskEnd::Replaced)),
        (0, 2, Active),
        (5, 3, Dropped(TaskEnd::Cancelled)),
        (5, 2, Dropped(TaskEnd::Cancelled)),
    ];
    assert_eq!(steps(&driver), expected);
    let answers = driver.notices.iter().filter_map(|(_, notice)| match notice {
        Notice::Answer { ticket: Ticket::Cancel(TaskId(task)), refused } => Some((*task, refused.as_deref())),
        _ => None,
    });
    let unknown = Some("the robot does not have this task");
    assert_eq!(answers.collect::<Vec<_>>(), [(3, None), (2, None), (2, unknown), (1, unknown)]);
    // It has nothing to do, and the run may end; what it was given counts as neither a goal nor a task done.
    let outcome = driver.run();
    assert_eq!((outcome.robots[0].tasks_done, outcome.robots[0].goals_done), (0, 0));
    assert!(outcome.events.iter().any(|event| event.kind.detail(&|_| String::new()) == "task 2: cancelled"));
}

#[test]
fn a_task_is_dropped_at_its_deadline_and_the_next_goal_follows() {
    let mut driver = Driver::new(&one());
    let soon = |deadline_s: f64| Task { deadline_s: Some(deadline_s), ..Task::to([0.0, 9.0]) };
    driver.world.order(order(1, Task { now: true, ..soon(0.4) }));
    driver.world.order(order(2, soon(0.25)));
    driver.world.order(order(3, Task::to([1.0, 0.0])));
    for deadline_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        driver.world.order(order(4, soon(deadline_s)));
    }
    driver.run();
    use TaskStep::{Active, Done, Dropped};
    let overdue = Dropped(TaskEnd::Overdue);
    let told = steps(&driver);
    let (dt_s, last) = (driver.world.time_s() / driver.world.tick() as f64, told[told.len() - 1]);
    let tick = |time_s: f64| (time_s / dt_s).ceil() as u64;
    let expected =
        [(0, 1, Active), (tick(0.25), 2, overdue), (tick(0.4), 1, overdue), (tick(0.4), 3, Active), (last.0, 3, Done)];
    assert_eq!(told, expected);
    assert_eq!(driver.logged(EventName::Ignored, 0).len(), 4, "a deadline is a time");
}

#[test]
fn a_robot_that_is_gone_has_no_tasks() {
    let mut scenario = one();
    scenario.events = vec![at(5, TimelineAction::Leave { robot: 0 })];
    let mut driver = Driver::new(&scenario);
    driver.world.order(order(1, Task::to([3.5, 0.0])));
    driver.run();
    assert_eq!(steps(&driver), [(5, 1, TaskStep::Dropped(TaskEnd::RobotGone))]);
}

#[test]
fn a_task_that_its_planner_gives_up_is_dropped_and_the_next_one_follows() {
    let mut driver = Driver::new(&one());
    driver.world.order(order(1, Task { now: true, ..Task::to([9.0, 9.0]) }));
    driver.world.order(order(2, Task::to([0.5, 0.0])));
    driver.world.order(order(3, Task::to([1.0, 0.0])));
    driver.until(5);
    driver.open();
    let who = driver.world.participants()[0];
    driver.world.planned(who, PlanState::GaveUp, 0.0);
    driver.close();
    // The state of the planner is that of the tick before, and not of the goal that has just begun.
    driver.run();
    use TaskStep::{Active, Done, Dropped};
    let steps: Vec<(u32, TaskStep)> = steps(&driver).into_iter().map(|(_, task, step)| (task, step)).collect();
    let unreachable = Dropped(TaskEnd::Unreachable);
    assert_eq!(steps, [(1, Active), (1, unreachable), (2, Active), (2, Done), (3, Active), (3, Done)]);
}

#[test]
fn a_planner_that_gives_up_a_goal_of_the_scenario_keeps_it() {
    let mut driver = Driver::new(&one());
    driver.world.order(order(1, Task::to([0.5, 0.0])));
    driver.open();
    let who = driver.world.participants()[0];
    driver.world.planned(who, PlanState::GaveUp, 0.0);
    driver.close();
    let outcome = driver.run();
    assert_eq!((outcome.robots[0].goals_done, outcome.robots[0].tasks_done), (2, 1));
}

#[test]
fn a_robot_that_stays_where_it_is_drops_its_task_in_the_end() {
    let mut scenario = one();
    scenario.fleet.stuck_limit_s = 2.0;
    let limit = (2.0 * HZ) as u64;
    // When it drops a task if it moves like this (m/s), and is paused at this tick for as long as the limit.
    let dropped_at = |speed: &dyn Fn(u64) -> f64, paused_at: Option<u64>| -> Option<u64> {
        let mut world = World::new(&scenario);
        world.order(order(1, Task { now: true, ..Task::to([9.0, 9.0]) }));
        (0..5 * limit).find(|tick| {
            if paused_at == Some(*tick) {
                let (id, index) = (FaultId(1), RobotIndex(0));
                world.order(Order::Fault { id, index, fault: Fault::Pause, ticks: Some(limit) });
            }
            world.open(&mut |_| true);
            world.close(&mut |_| Some(model::Drive::Velocity(nalgebra::Vector2::new(speed(*tick), 0.0))));
            world
                .take_notices()
                .iter()
                .any(|notice| matches!(notice, Notice::Task { step: TaskStep::Dropped(TaskEnd::Unreachable), .. }))
        })
    };
    // It is looked at from the end of the first tick on, and what it has is dropped when the next tick opens.
    assert_eq!(dropped_at(&|_| 0.0, None), Some(limit + 1));
    let trembles = |tick: u64| if tick.is_multiple_of(2) { 0.3 } else { -0.3 };
    assert_eq!(dropped_at(&trembles, None), Some(limit + 1), "to and fro is no way");
    assert_eq!(dropped_at(&|_| 0.5, None), None, "it gets on");
    // The time in which it was paused, and the time before that, do not count.
    assert_eq!(dropped_at(&|_| 0.0, Some(limit / 2)), Some(limit / 2 + limit + limit + 1));
}
