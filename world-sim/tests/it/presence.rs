//! Who takes part when, to the tick.

use crate::driver::{Driver, at, instance, robot, scenario};
use model::{
    EventKind, EventName, Gone, Restart, RestartPolicy, Robot, RobotIndex, Scenario, StragglerPolicy, Task, TaskEnd,
    TaskId, TaskStep, TimelineAction,
};
use protocol::daemon_to_world::{Absence, Order, Ticket};
use protocol::world_to_daemon::{Notice, Standing};
use protocol::world_to_robot::Odometry;

/// Two robots far from their goals.
fn pair() -> Scenario {
    let mut scenario = scenario(vec![robot(0, [0.0, 0.0], [9.0, 0.0]), robot(1, [0.0, 2.0], [9.0, 2.0])]);
    scenario.clock.ticks_max = 20;
    scenario
}

fn restarting(limit: u32, delay_ticks: u64) -> Scenario {
    let mut scenario = pair();
    scenario.robots[0].restart = Restart::on_failure(limit, delay_ticks);
    scenario
}

/// Runs 20 ticks, giving each order before its tick opens, and compares the stints and the notices of robot 0.
fn check(
    mut scenario: Scenario,
    events: Vec<model::TimelineEvent>,
    orders: Vec<(u64, Order)>,
    stints: &[(u64, u64, u32)],
    story: &str,
) -> Driver {
    scenario.events = events;
    let mut driver = Driver::new(&scenario);
    for tick in 0..20 {
        orders.iter().filter(|(at, _)| *at == tick).for_each(|(_, order)| driver.world.order(order.clone()));
        driver.tick();
    }
    assert_eq!(driver.stints(0), stints);
    assert_eq!(driver.story(0), story);
    let others = driver.took_part.iter().filter(|instances| instances.contains(&instance(1, 0))).count();
    assert_eq!(others, 20, "the fleet goes on whatever happens");
    driver
}

fn absent(incarnation: u32, cause: Absence) -> Order {
    Order::Absent { instance: instance(0, incarnation), cause }
}

const DIED: Absence = Absence::Died { signal: Some(9), code: None, words: String::new() };

fn cannot_start() -> Absence {
    Absence::NotStarted { why: "no room".to_owned() }
}

#[test]
fn nothing_happens() {
    check(pair(), vec![], vec![], &[(0, 19, 0)], "0:Expect@0.0 0:Entered.0");
}

#[test]
fn the_timeline_joins() {
    let join = || vec![at(8, TimelineAction::Join { robot: 0 })];
    let driver = check(pair(), join(), vec![], &[(8, 19, 0)], "3:Expect@8.0 8:Entered.0");
    assert_eq!(driver.world.outcome().robots[0].joined_tick, 8);
    let none = Order::Absent { instance: instance(0, 0), cause: cannot_start() };
    let driver = check(pair(), join(), vec![(8, none)], &[], "3:Expect@8.0 8:Kill.0");
    let robot = &driver.world.outcome().robots[0];
    assert_eq!((robot.robot, robot.gone), (RobotIndex(0), Some(Gone::Dead)), "it must not be forgotten");
}

#[test]
fn the_timeline_kills() {
    let kill = || vec![at(5, TimelineAction::kill(0))];
    let driver = check(pair(), kill(), vec![], &[(0, 4, 0)], "0:Expect@0.0 0:Entered.0 5:Kill.0");
    assert_eq!(driver.world.outcome().robots[0].gone, Some(Gone::Dead));
    // The report of the death that the world has ordered is no news.
    check(pair(), kill(), vec![(6, absent(0, DIED))], &[(0, 4, 0)], "0:Expect@0.0 0:Entered.0 5:Kill.0");
    for (delay, back) in [(0, 6), (1, 6), (7, 12)] {
        let told = if delay == 7 { 7 } else { 5 };
        let story = format!("0:Expect@0.0 0:Entered.0 5:Kill.0 {told}:Expect@{back}.1 {back}:Entered.1");
        let orders = vec![(6, absent(0, DIED))];
        let driver = check(restarting(1, delay), kill(), orders, &[(0, 4, 0), (back, 19, 1)], &story);
        assert_eq!(driver.logged(EventName::Killed, 0), [5]);
        assert_eq!(driver.logged(EventName::Restarted, 0), [back]);
    }
}

#[test]
fn the_timeline_pauses() {
    let pause = || vec![at(5, TimelineAction::pause(0, 4))];
    let story = "0:Expect@0.0 0:Entered.0 5:Pause.0 9:Resume.0 9:Entered.0";
    check(pair(), pause(), vec![], &[(0, 4, 0), (9, 19, 0)], story);
    // The daemon may report the stop that it made.
    check(pair(), pause(), vec![(6, absent(0, Absence::Stopped))], &[(0, 4, 0), (9, 19, 0)], story);
    let late = vec![(9, absent(0, Absence::Stopped))];
    check(pair(), pause(), late, &[(0, 4, 0), (9, 19, 0)], story);
    let longer = vec![at(5, TimelineAction::pause(0, 2)), at(6, TimelineAction::pause(0, 5))];
    let story = "0:Expect@0.0 0:Entered.0 5:Pause.0 6:Pause.0 11:Resume.0 11:Entered.0";
    check(pair(), longer, vec![], &[(0, 4, 0), (11, 19, 0)], story);
    let killed = vec![at(5, TimelineAction::pause(0, 4)), at(6, TimelineAction::kill(0))];
    let story = "0:Expect@0.0 0:Entered.0 5:Pause.0 6:Kill.0 6:Expect@8.1 8:Entered.1";
    check(restarting(1, 2), killed, vec![], &[(0, 4, 0), (8, 19, 1)], story);
}

#[test]
fn it_leaves() {
    let story = "0:Expect@0.0 0:Entered.0 5:Left.0";
    let driver = check(pair(), vec![at(5, TimelineAction::Leave { robot: 0 })], vec![], &[(0, 4, 0)], story);
    assert_eq!(driver.world.outcome().robots[0].gone, Some(Gone::Left));
    check(pair(), vec![], vec![(5, Order::Remove { index: RobotIndex(0) })], &[(0, 4, 0)], story);
    let paused = vec![at(4, TimelineAction::pause(0, 9)), at(5, TimelineAction::Leave { robot: 0 })];
    let story = "0:Expect@0.0 0:Entered.0 4:Pause.0 5:Resume.0 5:Left.0";
    check(pair(), paused, vec![], &[(0, 3, 0)], story);
}

#[test]
fn a_process_dies() {
    let died = |tick, incarnation| (tick, absent(incarnation, DIED));
    check(pair(), vec![], vec![died(5, 0)], &[(0, 4, 0)], "0:Expect@0.0 0:Entered.0");
    let story = "0:Expect@0.0 0:Entered.0 5:Expect@7.1 7:Entered.1";
    check(restarting(1, 2), vec![], vec![died(5, 0), died(6, 0)], &[(0, 4, 0), (7, 19, 1)], story);
    // The second life dies before it enters, the third takes over.
    let story = "0:Expect@0.0 0:Entered.0 5:Expect@7.1 6:Expect@8.2 8:Entered.2";
    check(restarting(2, 2), vec![], vec![died(5, 0), died(6, 1)], &[(0, 4, 0), (8, 19, 2)], story);
    // The limit is used up.
    let story = "0:Expect@0.0 0:Entered.0 5:Expect@7.1 7:Entered.1 9:RestartLimit.1";
    check(restarting(1, 2), vec![], vec![died(5, 0), died(9, 1)], &[(0, 4, 0), (7, 8, 1)], story);
    // A first life that cannot start.
    let story = "0:Expect@0.0 0:Kill.0 0:Expect@2.1 2:Entered.1";
    let orders = vec![(0, absent(0, cannot_start()))];
    check(restarting(1, 2), vec![], orders, &[(2, 19, 1)], story);
}

#[test]
fn a_policy_says_which_ends_are_followed_by_a_restart_and_how_soon() {
    let ended = |tick, incarnation, code| {
        (tick, absent(incarnation, Absence::Died { signal: None, code: Some(code), words: String::new() }))
    };
    // An agent that ends by itself with code 0 has not failed.
    let ends = vec![ended(5, 0, 0)];
    check(restarting(3, 2), vec![], ends.clone(), &[(0, 4, 0)], "0:Expect@0.0 0:Entered.0");
    let with = |change: &dyn Fn(&mut Restart)| {
        let mut scenario = restarting(3, 2);
        change(&mut scenario.robots[0].restart);
        scenario
    };
    let always = with(&|restart| restart.policy = RestartPolicy::Always);
    check(always, vec![], ends, &[(0, 4, 0), (7, 19, 1)], "0:Expect@0.0 0:Entered.0 5:Expect@7.1 7:Entered.1");
    // Each delay is twice the one before.
    let doubled = with(&|restart| restart.backoff = 2.0);
    let ends = vec![ended(2, 0, 1), ended(5, 1, 1), ended(10, 2, 1)];
    let story =
        "0:Expect@0.0 0:Entered.0 2:Expect@4.1 4:Entered.1 5:Expect@9.2 9:Entered.2 13:Expect@18.3 18:Entered.3";
    check(doubled, vec![], ends, &[(0, 1, 0), (4, 4, 1), (9, 9, 2), (18, 19, 3)], story);
}

#[test]
fn a_robot_whose_restart_limit_is_reached_stays_dead_and_the_daemon_is_told() {
    let ends = vec![(2, absent(0, DIED)), (4, absent(1, DIED)), (6, absent(2, DIED))];
    let window = |ticks| {
        let mut scenario = restarting(1, 1);
        scenario.robots[0].restart.window_ticks = ticks;
        scenario
    };
    let first = "0:Expect@0.0 0:Entered.0 2:Expect@3.1 3:Entered.1";
    for ticks in [None, Some(3)] {
        let story = format!("{first} 4:RestartLimit.1");
        let mut driver = check(window(ticks), vec![], ends.clone(), &[(0, 1, 0), (3, 3, 1)], &story);
        assert_eq!(driver.logged(EventName::RestartLimit, 0), [4]);
        assert_eq!(driver.world.outcome().robots[0].gone, Some(Gone::Dead));
        assert_eq!(standing(&mut driver), Standing::RestartLimit);
        let limit = EventKind::RestartLimit { restarts: 1, window_ticks: ticks };
        assert!(driver.world.events().iter().any(|event| event.kind == limit));
    }
    // Two ticks after a restart it counts no more.
    let story = format!("{first} 4:Expect@5.2 5:Entered.2 6:Expect@7.3 7:Entered.3");
    let driver = check(window(Some(2)), vec![], ends, &[(0, 1, 0), (3, 3, 1), (5, 5, 2), (7, 19, 3)], &story);
    assert_eq!(driver.logged(EventName::RestartLimit, 0), [0_u64; 0]);
    // Without a policy there is no limit to reach.
    let mut driver = check(pair(), vec![], vec![(2, absent(0, DIED))], &[(0, 1, 0)], "0:Expect@0.0 0:Entered.0");
    assert_eq!(driver.logged(EventName::RestartLimit, 0), [0_u64; 0]);
    assert_eq!(standing(&mut driver), Standing::Dead);
}

/// What a daemon that has just come is told of robot 0.
fn standing(driver: &mut Driver) -> Standing {
    driver.world.order(Order::Resync(1));
    driver.open();
    let standings = driver.notices.iter().find_map(|(_, notice)| match notice {
        Notice::Standings(standings) => Some(standings),
        _ => None,
    });
    standings.expect("the world answers").robots[0].1
}

#[test]
fn a_straggler_is_held_or_dropped() {
    for cause in [Absence::Stopped, Absence::Overdue] {
        for (policy, gone, story) in [
            (StragglerPolicy::Wait, None, "0:Expect@0.0 0:Entered.0"),
            (StragglerPolicy::Hold, None, "0:Expect@0.0 0:Entered.0"),
            (StragglerPolicy::Drop, Some(Gone::Dropped), "0:Expect@0.0 0:Entered.0 5:Kill.0"),
        ] {
            let mut scenario = restarting(3, 1);
            scenario.fleet.straggler = policy;
            // A dropped robot's process dies of it, and is not started again.
            let died = gone.map(|_| (6, absent(0, DIED)));
            let orders = [(5, absent(0, cause.clone()))].into_iter().chain(died).collect();
            let driver = check(scenario, vec![], orders, &[(0, 4, 0)], story);
            assert_eq!(driver.world.outcome().robots[0].gone, gone);
        }
    }
}

#[test]
fn a_held_robot_comes_back_when_it_answers() {
    let mut driver = Driver::new(&restarting(1, 1));
    driver.until(5);
    driver.world.order(absent(0, Absence::Overdue));
    driver.until(8);
    driver.world.back(instance(0, 1));
    driver.tick();
    assert_eq!(driver.took_part[8], [instance(1, 0)], "that was another life");
    driver.world.back(instance(0, 0));
    driver.until(12);
    assert_eq!(driver.stints(0), [(0, 4, 0), (9, 11, 0)]);
    driver.world.order(absent(0, Absence::Overdue));
    driver.tick();
    driver.world.order(absent(0, DIED));
    driver.until(20);
    assert_eq!(driver.stints(0), [(0, 4, 0), (9, 11, 0), (14, 19, 1)], "death while held");
}

#[test]
fn due_names_whom_to_wait_for() {
    let mut scenario = restarting(1, 3);
    scenario.events = vec![at(5, TimelineAction::kill(0)), at(12, TimelineAction::pause(1, 2))];
    let mut driver = Driver::new(&scenario);
    for tick in 0..16 {
        let expected = match tick {
            0 => vec![instance(0, 0), instance(1, 0)],
            8 => vec![instance(0, 1)],
            14 => vec![instance(1, 0)],
            _ => vec![],
        };
        assert_eq!(driver.world.due(), expected, "tick {tick}");
        if tick == 8 {
            driver.world.order(absent(1, Absence::Stopped));
            assert_eq!(driver.world.due(), expected, "a stopped process is waited for");
            driver.world.order(absent(1, DIED));
            assert!(driver.world.due().is_empty(), "nobody needs to wait for the dead");
        }
        driver.tick();
    }
}

#[test]
fn who_is_not_ready_stays_due() {
    let mut driver = Driver::new(&pair());
    driver.unready.push(instance(0, 0));
    driver.until(3);
    assert_eq!(driver.world.due(), [instance(0, 0)]);
    driver.unready.clear();
    driver.until(6);
    assert_eq!(driver.stints(0), [(3, 5, 0)]);
    assert_eq!(driver.world.outcome().robots[0].joined_tick, 3, "its time counts from here");
}

#[test]
fn robots_can_be_admitted() {
    let mut driver = Driver::new(&pair());
    driver.until(4);
    let new = Box::new(robot(3, [0.0, 5.0], [9.0, 5.0]));
    driver.unready.push(instance(3, 0));
    driver.world.order(Order::Admit { instance: instance(3, 0), robot: new.clone() });
    driver.tick();
    assert_eq!(driver.world.due(), [instance(3, 0)]);
    driver.unready.clear();
    driver.tick();
    assert_eq!(driver.story(3), "4:Expect@4.0 5:Entered.0");
    for taken in [instance(3, 0), instance(3, 1), instance(99, 0)] {
        driver.world.order(Order::Admit { instance: taken, robot: new.clone() });
    }
    driver.tick();
    assert_eq!(driver.logged(EventName::Ignored, 3), [6, 6]);
    assert_eq!(driver.logged(EventName::Ignored, 99), [6]);
    let slots: Vec<u32> = driver.world.outcome().robots.iter().map(|robot| robot.robot.0).collect();
    assert_eq!(slots, [0, 1, 3]);
}

/// The process of a robot that an operator adds is started while the world still decides.
#[test]
fn what_is_reported_of_the_process_of_a_newcomer_counts_before_the_world_has_admitted_it() {
    let mut driver = Driver::new(&pair());
    driver.until(4);
    let new = Box::new(Robot {
        restart: Restart { policy: RestartPolicy::OnFailure, limit: 1, delay_ticks: 2, ..Restart::NEVER },
        ..robot(3, [0.0, 5.0], [9.0, 5.0])
    });
    driver.world.order(Order::Admit { instance: instance(3, 0), robot: new });
    assert!(driver.world.has_process(instance(3, 0)) && !driver.world.has_process(instance(3, 1)));
    driver.world.order(Order::Absent { instance: instance(3, 0), cause: cannot_start() });
    driver.until(10);
    assert_eq!(driver.story(3), "4:Expect@4.0 4:Kill.0 4:Expect@6.1 6:Entered.1");
}

#[test]
fn a_slot_whose_robot_has_left_is_free_for_the_next_life() {
    let mut scenario = restarting(2, 2);
    scenario.robots[0].goals = vec![[9.0, 0.0].into()];
    let mut driver = Driver::new(&scenario);
    driver.world.order(Order::Absent { instance: instance(0, 0), cause: DIED });
    driver.until(5);
    let again = robot(0, [0.0, -5.0], [1.0, -5.0]);
    let admit = |incarnation| Order::Admit { instance: instance(0, incarnation), robot: Box::new(again.clone()) };
    let remove = Order::Remove { index: RobotIndex(0) };
    let task = |id: u32| Order::Task { id: TaskId(id), index: RobotIndex(0), task: Task::to([5.0, 0.0]) };
    // All in one tick: what the robot before has to do is dropped, and the next one has its own.
    driver.world.order(task(1));
    for order in [admit(2), remove.clone(), task(2), admit(1), admit(2), task(3), remove.clone(), admit(3)] {
        driver.world.order(order);
    }
    driver.tick();
    let answers = answers(&driver);
    let expected = [
        (Ticket::Task(TaskId(1)), true),
        (Ticket::Admit(instance(0, 2)), false),
        (Ticket::Remove(RobotIndex(0)), true),
        (Ticket::Task(TaskId(2)), false),
        (Ticket::Admit(instance(0, 1)), false),
        (Ticket::Admit(instance(0, 2)), true),
        (Ticket::Task(TaskId(3)), true),
        (Ticket::Remove(RobotIndex(0)), true),
        (Ticket::Admit(instance(0, 3)), true),
    ];
    assert_eq!(answers, expected);
    let lost: Vec<TaskId> = driver
        .notices
        .iter()
        .filter_map(|(_, notice)| match notice {
            Notice::Task { id, step: TaskStep::Dropped(TaskEnd::RobotGone) } => Some(*id),
            _ => None,
        })
        .collect();
    assert_eq!(lost, [TaskId(1), TaskId(3)]);
    let story = "0:Expect@0.0 0:Expect@2.1 2:Entered.1 5:Left.1 5:Expect@5.2 5:Left.2 5:Expect@5.3 5:Entered.3";
    assert_eq!(driver.story(0), story);
    assert_eq!(driver.position(0).y, -5.0, "it is where it starts, not where the robot before was");
    driver.until(20);
    let outcome = &driver.world.outcome().robots[0];
    assert_eq!((outcome.incarnation, outcome.joined_tick, outcome.arrived), (3, 5, true), "{outcome:?}");
    assert_eq!((outcome.goals_done, outcome.tasks_done), (1, 0));

    driver.world.order(remove.clone());
    driver.world.order(remove);
    driver.tick();
    assert_eq!(
        answers_since(&driver, 20),
        [(Ticket::Remove(RobotIndex(0)), true), (Ticket::Remove(RobotIndex(0)), false)]
    );
}

#[test]
fn an_operator_gives_a_robot_a_new_process() {
    let order = || Order::Restart { index: RobotIndex(0) };
    let taken = |driver: &Driver| answers(driver).iter().map(|(_, taken)| *taken).collect::<Vec<_>>();
    // The fleet goes on, and it is not one of the robot's restarts.
    let story = "0:Expect@0.0 0:Entered.0 5:Kill.0 5:Expect@6.1 6:Entered.1 10:Kill.1 10:Expect@11.2 11:Entered.2";
    let stints = [(0, 4, 0), (6, 9, 1), (11, 19, 2)];
    let orders = vec![(5, order()), (6, absent(0, DIED)), (10, order())];
    let driver = check(pair(), vec![], orders, &stints, story);
    assert_eq!(taken(&driver), [true, true]);
    assert_eq!(driver.logged(EventName::Restarted, 0), [6, 11]);
    assert_eq!(driver.logged(EventName::Replaced, 0), [5, 10]);
    // Dead for good, dropped, paused, waiting for a restart that is far away or on its way.
    let story = "0:Expect@0.0 0:Entered.0 8:Expect@9.1 9:Entered.1";
    check(pair(), vec![], vec![(5, absent(0, DIED)), (8, order())], &[(0, 4, 0), (9, 19, 1)], story);
    let mut scenario = pair();
    scenario.fleet.straggler = StragglerPolicy::Drop;
    let story = "0:Expect@0.0 0:Entered.0 5:Kill.0 8:Expect@9.1 9:Entered.1";
    check(scenario, vec![], vec![(5, absent(0, Absence::Overdue)), (8, order())], &[(0, 4, 0), (9, 19, 1)], story);
    let story = "0:Expect@0.0 0:Entered.0 5:Pause.0 8:Kill.0 8:Expect@9.1 9:Entered.1";
    let pause = vec![at(5, TimelineAction::pause(0, 9))];
    check(pair(), pause, vec![(8, order())], &[(0, 4, 0), (9, 19, 1)], story);
    let story = "0:Expect@0.0 0:Entered.0 8:Expect@9.1 9:Entered.1";
    let orders = vec![(5, absent(0, DIED)), (8, order())];
    check(restarting(1, 14), vec![], orders, &[(0, 4, 0), (9, 19, 1)], story);
    let story = "0:Expect@0.0 0:Entered.0 5:Expect@9.1 7:Kill.1 7:Expect@8.2 8:Entered.2";
    let orders = vec![(5, absent(0, DIED)), (7, order())];
    check(restarting(1, 4), vec![], orders, &[(0, 4, 0), (8, 19, 2)], story);
    // One that is not there is not restarted, nor one whose process nobody has asked for.
    let leave = vec![at(5, TimelineAction::Leave { robot: 0 })];
    let driver = check(pair(), leave, vec![(7, order())], &[(0, 4, 0)], "0:Expect@0.0 0:Entered.0 5:Left.0");
    assert_eq!((taken(&driver), driver.logged(EventName::Ignored, 0)), (vec![false], vec![7]));
    let join = vec![at(18, TimelineAction::Join { robot: 0 })];
    let driver = check(pair(), join, vec![(7, order())], &[(18, 19, 0)], "13:Expect@18.0 18:Entered.0");
    assert_eq!(taken(&driver), [false]);
}

#[test]
fn a_newcomer_is_announced_to_those_who_will_hear_it() {
    let mut driver = Driver::new(&pair());
    driver.until(4);
    let heard =
        |driver: &Driver, slot: usize| driver.world.neighbors(slot).iter().map(|who| who.index).collect::<Vec<_>>();
    let coming =
        |driver: &Driver, slot: usize| driver.world.coming(slot).iter().map(|who| who.index).collect::<Vec<_>>();
    driver.unready.push(instance(3, 0));
    let new = Box::new(robot(3, [0.0, 1.0], [9.0, 1.0]));
    driver.world.order(Order::Admit { instance: instance(3, 0), robot: new });
    driver.open();
    assert_eq!(
        (coming(&driver, 0), heard(&driver, 0)),
        (vec![], vec![1]),
        "nobody waits for a process that is not ready"
    );
    driver.close();
    driver.unready.clear();
    driver.open();
    assert_eq!((coming(&driver, 0), heard(&driver, 0)), (vec![3], vec![1]));
    assert_eq!((coming(&driver, 3), heard(&driver, 3)), (vec![], vec![0, 1]));
    assert_eq!(driver.world.opening().neighbors, [0, 1, 3]);
    driver.close();
    driver.open();
    assert_eq!((coming(&driver, 0), heard(&driver, 0)), (vec![], vec![1, 3]));
    assert_eq!(driver.world.opening().neighbors, [0, 1]);
    driver.close();
    driver.open();
    assert_eq!(driver.world.opening().neighbors, [0_usize; 0]);
}

#[test]
fn the_tasks_of_a_robot_are_dropped_before_it_is_said_that_it_has_left() {
    for leave in ["order", "timeline"] {
        let mut scenario = pair();
        if leave == "timeline" {
            scenario.events = vec![at(3, TimelineAction::Leave { robot: 0 })];
        }
        let mut driver = Driver::new(&scenario);
        driver.world.order(Order::Task { id: TaskId(7), index: RobotIndex(0), task: Task::to([5.0, 0.0]) });
        driver.until(3);
        if leave == "order" {
            driver.world.order(Order::Remove { index: RobotIndex(0) });
        }
        driver.tick();
        let place = |wanted: &dyn Fn(&Notice) -> bool| driver.notices.iter().position(|(_, notice)| wanted(notice));
        let dropped =
            place(&|notice| matches!(notice, Notice::Task { step: TaskStep::Dropped(TaskEnd::RobotGone), .. }));
        let left = place(&|notice| matches!(notice, Notice::Left { .. }));
        assert!(dropped.is_some() && dropped < left, "{leave}: {dropped:?}, {left:?}");
    }
}

/// Which orders the world has answered, and whether it took them.
fn answers(driver: &Driver) -> Vec<(Ticket, bool)> {
    answers_since(driver, 0)
}

fn answers_since(driver: &Driver, since: u64) -> Vec<(Ticket, bool)> {
    let answer = |(tick, notice): &(u64, Notice)| match notice {
        Notice::Answer { ticket, refused } if *tick >= since => Some((*ticket, refused.is_none())),
        _ => None,
    };
    driver.notices.iter().filter_map(answer).collect()
}

#[test]
fn odometry_says_who_is_present_and_who_has_left() {
    let mut scenario = pair();
    scenario.events = vec![
        at(2, TimelineAction::pause(0, 3)),
        at(7, TimelineAction::Leave { robot: 0 }),
        at(9, TimelineAction::kill(1)),
    ];
    let mut driver = Driver::new(&scenario);
    for tick in 0..12 {
        driver.open();
        let flags = driver.world.odometry(0).flags;
        let expected = match tick {
            2..5 => 0,
            0..7 => Odometry::FLAG_PRESENT,
            _ => Odometry::FLAG_LEFT,
        };
        assert_eq!(flags, expected, "tick {tick}");
        let written: &[usize] = match tick {
            3 | 4 | 8 => &[1],
            10.. => &[],
            _ if tick == 9 => &[1],
            _ => &[0, 1],
        };
        assert_eq!(driver.world.opening().odometry, written, "tick {tick}");
        driver.close();
    }
}

#[test]
fn an_absent_robot_stands_still_and_comes_back_where_it_stands() {
    let mut scenario = restarting(1, 3);
    scenario.events = vec![at(5, TimelineAction::kill(0))];
    let mut driver = Driver::new(&scenario);
    driver.until(5);
    let body = driver.position(0);
    assert!((body.x - 0.5).abs() < 1e-12);
    for _ in 5..8 {
        driver.open();
        assert_eq!(driver.world.odometry(0).vx_mps, 0.0);
        driver.close();
        assert_eq!(driver.position(0), body);
    }
    driver.tick();
    assert!((driver.position(0).x - 0.6).abs() < 1e-12);
    // A robot that does not answer stands as well.
    driver.world.open(&mut |_| true);
    driver.world.close(&mut |_| None);
    assert!((driver.position(0).x - 0.6).abs() < 1e-12);
}

#[test]
fn a_fleet_of_the_dead_is_finished() {
    let mut driver = Driver::new(&pair());
    driver.until(3);
    driver.world.order(Order::Absent { instance: instance(0, 0), cause: DIED });
    driver.world.order(Order::Remove { index: RobotIndex(1) });
    driver.tick();
    assert!(driver.world.finished());
    let mut driver = Driver::new(&pair());
    driver.tick();
    assert!(!driver.world.finished());
    driver.world.order(Order::Stop);
    assert!(driver.world.finished(), "a stop is known at once");
}

#[test]
fn a_robot_that_cannot_hear_or_be_heard_is_gone_and_may_come_back() {
    let deaf = |incarnation| absent(incarnation, Absence::Deaf { why: "no files".to_owned() });
    let story = "0:Expect@0.0 0:Entered.0 5:Kill.0";
    let driver = check(pair(), vec![], vec![(5, deaf(0))], &[(0, 4, 0)], story);
    assert_eq!(driver.logged(EventName::Deaf, 0), [5]);
    let story = "0:Expect@0.0 0:Entered.0 5:Kill.0 5:Expect@7.1 7:Entered.1";
    check(restarting(1, 2), vec![], vec![(5, deaf(0))], &[(0, 4, 0), (7, 19, 1)], story);
    // Its end was seen before its entry was.
    let early = vec![(5, absent(0, cannot_start()))];
    let driver = check(pair(), vec![], early, &[(0, 4, 0)], "0:Expect@0.0 0:Entered.0");
    assert_eq!((driver.logged(EventName::Died, 0), driver.logged(EventName::NotStarted, 0)), (vec![5], vec![]));
}
