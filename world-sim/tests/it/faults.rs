//! Faults on purpose: when they begin and end, whom they concern, and what the operator who asked for one is told.

use crate::driver::{Driver, at, instance, robot, scenario};
use model::{EventName, Fault, Radio, Restart, RobotIndex, Scenario, TimelineAction, TimelineEvent};
use protocol::daemon_to_world::{FaultId, Order, Ticket};
use protocol::world_to_daemon::Notice;
use protocol::world_to_robot::Impairment;

/// Three robots side by side that hear and see one another all the time.
fn trio() -> Scenario {
    let mut scenario = scenario((0..3).map(|n| robot(n, [0.0, n as f64], [9.0, n as f64])).collect());
    scenario.clock.ticks_max = 30;
    scenario
}

fn on_timeline(tick: u64, robot: usize, fault: Fault, ticks: Option<u64>) -> TimelineEvent {
    at(tick, TimelineAction::Fault { robot, fault, ticks })
}

fn order(id: u32, robot: u32, fault: Fault, ticks: Option<u64>) -> Order {
    Order::Fault { id: FaultId(id), index: RobotIndex(robot), fault, ticks }
}

/// Ticks in which robot 0 hears robot 1.
fn heard_at(driver: &mut Driver, ticks: u64, orders: &[(u64, Order)]) -> Vec<u64> {
    let mut heard = Vec::new();
    while driver.world.tick() < ticks {
        let tick = driver.world.tick();
        orders.iter().filter(|(at, _)| *at == tick).for_each(|(_, order)| driver.world.order(order.clone()));
        driver.open();
        if driver.world.neighbors(0).iter().any(|who| who.index == 1) {
            heard.push(tick);
        }
        driver.close();
    }
    heard
}

/// What the world answered, by the number of the fault.
fn answers(driver: &Driver) -> Vec<(u32, Option<String>)> {
    let answer = |(_, notice): &(u64, Notice)| match notice {
        Notice::Answer { ticket: Ticket::Fault(FaultId(id)), refused } => Some((*id, refused.clone())),
        _ => None,
    };
    driver.notices.iter().filter_map(answer).collect()
}

#[test]
fn a_mute_robot_is_not_heard_but_seen_and_hears() {
    let mut scenario = trio();
    scenario.events = vec![on_timeline(5, 1, Fault::Mute, Some(4))];
    let mut driver = Driver::new(&scenario);
    let expected: Vec<u64> = (1..15).filter(|tick| !(5..9).contains(tick)).collect();
    assert_eq!(heard_at(&mut driver, 15, &[]), expected);
    assert_eq!((driver.logged(EventName::Fault, 1), driver.logged(EventName::FaultOver, 1)), (vec![5], vec![9]));

    let mut driver = Driver::new(&scenario);
    driver.until(6);
    driver.open();
    assert_eq!(driver.world.neighbors(1).iter().map(|who| who.index).collect::<Vec<_>>(), [0, 2], "it hears");
    assert_eq!(driver.world.sensed(0), [1], "it is seen instead");
    assert!(driver.world.participants().iter().any(|who| who.index.0 == 1), "it takes part");
}

#[test]
fn an_operator_does_what_the_timeline_does() {
    let by_timeline = |events: Vec<TimelineEvent>| {
        let mut driver = Driver::new(&Scenario { events, ..trio() });
        let heard = heard_at(&mut driver, 20, &[]);
        (heard, driver.world.trajectory_hash(), driver.story(1))
    };
    let by_operator = |orders: Vec<(u64, Order)>| {
        let mut driver = Driver::new(&trio());
        let heard = heard_at(&mut driver, 20, &orders);
        assert_eq!(answers(&driver), [(7, None)]);
        (heard, driver.world.trajectory_hash(), driver.story(1))
    };
    let cases = [
        (Fault::Kill, None),
        (Fault::Pause, Some(3)),
        (Fault::Pause, None),
        (Fault::Mute, Some(3)),
        (Fault::Mute, None),
        (Fault::Drop { share: 1.0 }, Some(2)),
        (Fault::SlowCpu { ms: 5.0 }, Some(2)),
    ];
    for (fault, ticks) in cases {
        let planned = by_timeline(vec![on_timeline(4, 1, fault, ticks)]);
        assert_eq!(by_operator(vec![(4, order(7, 1, fault, ticks))]), planned, "{fault}");
    }
}

/// The radio of a robot is what the scenario and its timeline say, and on top of that the faults that are on it; it is
/// told when that changes, and not otherwise.
#[test]
fn a_robot_is_told_of_its_impairment_when_it_changes() {
    let mut scenario = trio();
    let rough = Radio { noise_m: 0.5, ..Radio::PERFECT };
    scenario.events = vec![
        on_timeline(2, 1, Fault::Delay { ticks: 3 }, Some(6)),
        on_timeline(3, 1, Fault::Drop { share: 0.2 }, None),
        at(4, TimelineAction::Radio { robot: None, radio: rough }),
        // A second one of a kind takes the place of the first, and of its end.
        on_timeline(5, 1, Fault::Delay { ticks: 9 }, Some(2)),
        on_timeline(6, 1, Fault::SlowCpu { ms: 2.5 }, Some(2)),
        on_timeline(10, 1, Fault::Resume, None),
    ];
    let mut driver = Driver::new(&scenario);
    let (mut told, mut others) = (Vec::new(), Vec::new());
    for tick in 0..14 {
        driver.open();
        for slot in driver.world.opening().impairments {
            let Impairment { drop, noise_m, delay_ticks, slow_us } = driver.world.impairment(*slot);
            let list = if *slot == 1 { &mut told } else { &mut others };
            list.push((tick, delay_ticks, drop, noise_m, slow_us));
        }
        driver.close();
    }
    let expected = [
        (2, 3, 0.0, 0.0, 0),
        (3, 3, 0.2, 0.0, 0),
        (4, 3, 0.2, 0.5, 0),
        (5, 9, 0.2, 0.5, 0),
        (6, 9, 0.2, 0.5, 2500),
        (7, 0, 0.2, 0.5, 2500),
        (8, 0, 0.2, 0.5, 0),
        (10, 0, 0.0, 0.5, 0),
    ];
    assert_eq!(told, expected);
    assert_eq!(others, [(4, 0, 0.0, 0.5, 0); 2]);
    assert_eq!(driver.logged(EventName::FaultOver, 1), [7, 8, 10]);
}

#[test]
fn the_radio_of_the_scenario_is_told_before_the_first_tick_and_to_those_who_come_later() {
    let radio = Radio { delay_ticks: 2, drop: 0.1, noise_m: 0.01 };
    let mut driver = Driver::new(&Scenario { radio, ..trio() });
    driver.open();
    assert_eq!(driver.world.opening().impairments, [0, 1, 2]);
    assert_eq!(driver.world.impairment(2).radio(), radio);
    driver.close();
    let new = Box::new(robot(3, [5.0, 5.0], [9.0, 9.0]));
    driver.world.order(Order::Admit { instance: instance(3, 0), robot: new });
    driver.open();
    assert_eq!(driver.world.opening().impairments, [3]);
    assert_eq!(driver.world.impairment(3).radio(), radio);
}

#[test]
fn a_pause_without_a_length_ends_when_the_robot_is_resumed() {
    let mut driver = Driver::new(&trio());
    let orders = [(4, order(0, 1, Fault::Pause, None)), (9, order(1, 1, Fault::Resume, None))];
    heard_at(&mut driver, 20, &orders);
    assert_eq!(driver.stints(1), [(0, 3, 0), (10, 19, 0)]);
    assert_eq!(driver.story(1), "0:Expect@0.0 0:Entered.0 4:Pause.0 10:Resume.0 10:Entered.0");
    assert_eq!(answers(&driver), [(0, None), (1, None)]);
    // It does not keep a run from its end for which nothing else is waited for.
    let mut scenario = trio();
    scenario.robots.truncate(1);
    scenario.robots[0].goals = vec![scenario.robots[0].start];
    scenario.events = vec![on_timeline(0, 0, Fault::Pause, None)];
    let mut driver = Driver::new(&scenario);
    driver.until(2);
    assert!(driver.world.finished());
}

/// What ends a pause early is not overtaken by what would have ended it later, and the other way round.
#[test]
fn pauses_of_the_timeline_and_of_operators_go_together() {
    let mut scenario = trio();
    scenario.events = vec![on_timeline(4, 1, Fault::Pause, Some(10))];
    let mut driver = Driver::new(&scenario);
    heard_at(&mut driver, 20, &[(6, order(0, 1, Fault::Resume, None))]);
    assert_eq!(driver.stints(1), [(0, 3, 0), (7, 19, 0)]);
    let mut driver = Driver::new(&scenario);
    let longer = [(6, order(0, 1, Fault::Pause, None)), (16, order(1, 1, Fault::Resume, None))];
    heard_at(&mut driver, 20, &longer);
    assert_eq!(driver.stints(1), [(0, 3, 0), (17, 19, 0)]);
    let mut driver = Driver::new(&scenario);
    heard_at(&mut driver, 20, &[(6, order(0, 1, Fault::Pause, Some(2)))]);
    assert_eq!(driver.stints(1), [(0, 3, 0), (14, 19, 0)]);
    assert_eq!(answers(&driver), [(0, Some("the robot is paused until tick 14".to_owned()))]);
}

#[test]
fn what_cannot_be_done_is_refused_and_logged() {
    let mut scenario = trio();
    scenario.robots[2].restart = Restart::on_failure(1, 20);
    scenario.events =
        vec![at(2, TimelineAction::kill(0)), at(2, TimelineAction::Leave { robot: 1 }), at(2, TimelineAction::kill(2))];
    let mut driver = Driver::new(&scenario);
    let wishes = [
        (0, Fault::Kill, Some("the robot is dead")),
        (0, Fault::Mute, Some("the robot is dead")),
        (0, Fault::Pause, Some("the robot is dead")),
        (1, Fault::Drop { share: 0.5 }, Some("the robot is gone: it left")),
        (1, Fault::Resume, Some("it is not paused and has no fault: the robot is gone: it left")),
        (2, Fault::Pause, Some("the robot is dead until tick 22")),
        // It waits for the robot to come back.
        (2, Fault::Mute, None),
        (7, Fault::Kill, Some("unknown robot")),
        (9000, Fault::Mute, Some("unknown robot")),
    ];
    let orders: Vec<(u64, Order)> =
        wishes.iter().zip(0..).map(|((robot, fault, _), id)| (5, order(id, *robot, *fault, None))).collect();
    heard_at(&mut driver, 8, &orders);
    let expected: Vec<(u32, Option<String>)> =
        wishes.iter().zip(0..).map(|((_, _, why), id)| (id, why.map(str::to_owned))).collect();
    assert_eq!(answers(&driver), expected);
    assert_eq!(driver.logged(EventName::Ignored, 0), [5, 5, 5]);
    assert_eq!(driver.logged(EventName::Fault, 2), [5]);
}

/// A robot that is about to start is not waited for any more when it is to be killed.
#[test]
fn a_robot_that_is_awaited_can_be_killed() {
    let mut driver = Driver::new(&trio());
    assert_eq!(driver.world.due().len(), 3);
    driver.world.order(order(0, 1, Fault::Kill, None));
    assert_eq!(driver.world.due().len(), 2);
    driver.tick();
    assert_eq!(driver.stints(1), []);
    assert_eq!(answers(&driver), [(0, None)]);
}
