use super::super::tests::{ALL_READY, instance, pass, running};
use super::super::{Action, Coordinator, News};
use super::*;
use model::RobotIndex;
use protocol::world_to_daemon::Notice;

/// What is said, with its kind and the robot that it is about.
fn said(coordinator: &mut Coordinator) -> Vec<(News, Option<RobotIndex>, String)> {
    let news = |action: Action| match action {
        Action::News { kind, robot, line } => Some((kind, robot, line)),
        _ => None,
    };
    coordinator.take_actions().into_iter().filter_map(news).collect()
}

fn line(kind: News, robot: u32, words: &str) -> (News, Option<RobotIndex>, String) {
    (kind, Some(RobotIndex(robot)), words.to_owned())
}

#[test]
fn a_stop_from_outside_and_its_end_are_said_once() {
    let mut coordinator = running(&["clock.mode=\"realtime\""]);
    let name = coordinator.name(RobotIndex(0)).to_owned();
    pass(&mut coordinator, 10..=12, ALL_READY);
    coordinator.stopped(instance(0, 0));
    coordinator.stopped(instance(0, 0));
    let stopped = format!(
        "robot `{name}`: its process was stopped by a signal from outside the fleet; no robot waits for it, and its body \
         stands still"
    );
    assert_eq!(said(&mut coordinator), [line(News::RobotStopped, 0, &stopped)]);
    pass(&mut coordinator, 13..=15, ALL_READY);
    coordinator.continued(instance(0, 0));
    coordinator.continued(instance(0, 0));
    let goes_on = format!("robot `{name}`: its process goes on after 3.0 s");
    assert_eq!(said(&mut coordinator), [line(News::RobotGoesOn, 0, &goes_on)]);
    // A pause of the timeline is in the log of the run.
    coordinator.notice(Notice::Pause { instance: instance(0, 0) });
    coordinator.stopped(instance(0, 0));
    coordinator.notice(Notice::Resume { instance: instance(0, 0) });
    coordinator.continued(instance(0, 0));
    assert_eq!(said(&mut coordinator), []);
    // At the end of a run nobody minds.
    coordinator.stopping();
    coordinator.stopped(instance(0, 0));
    assert_eq!(said(&mut coordinator), []);
}

#[test]
fn it_is_said_once_who_waits_for_whom_and_once_that_it_is_over() {
    let mut coordinator = running(&[]);
    let name = coordinator.name(RobotIndex(0)).to_owned();
    let other = coordinator.name(RobotIndex(1)).to_owned();
    let seconds = Duration::from_secs;
    let open = |tick: u64, missing: &[u32], others: usize| {
        let missing = missing.iter().map(|slot| instance(*slot, 0)).collect();
        Some(OpenTick { tick, opened: seconds(10), missing, others })
    };
    coordinator.open_tick(None, seconds(10));
    assert_eq!(said(&mut coordinator), []);
    coordinator.stopped(instance(0, 0));
    said(&mut coordinator);
    coordinator.open_tick(open(812, &[0], 1), seconds(11));
    coordinator.open_tick(open(812, &[0], 1), seconds(12));
    let waits = format!("tick 812 waits for robot `{name}` (stopped), and 1 other robot waits with it");
    assert_eq!(said(&mut coordinator), [line(News::TickWaits, 0, &waits)]);
    coordinator.continued(instance(0, 0));
    said(&mut coordinator);
    coordinator.open_tick(None, seconds(13));
    coordinator.open_tick(None, seconds(14));
    let over = format!("tick 812 went on after 3.0 s: it waited for robot `{name}`");
    assert_eq!(said(&mut coordinator), [line(News::TickGoesOn, 0, &over)]);
    // From one tick to the next without a look between.
    coordinator.open_tick(open(900, &[0, 1], 0), seconds(15));
    let waits = format!("tick 900 waits for robot `{name}` (running), robot `{other}` (running)");
    assert_eq!(said(&mut coordinator), [line(News::TickWaits, 0, &waits)]);
    coordinator.open_tick(open(901, &[1], 1), seconds(16));
    let kinds: Vec<News> = said(&mut coordinator).into_iter().map(|(kind, ..)| kind).collect();
    assert_eq!(kinds, [News::TickGoesOn, News::TickWaits]);
}
