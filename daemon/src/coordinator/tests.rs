use super::*;
use model::{Fault, ProcessState, Task, TaskId};
use protocol::operator_to_daemon::{Assign, NewRobot, NewTasks, Reply, Request, TaskRecord};

pub(super) const ALL_READY: &dyn Fn(RobotInstance) -> bool = &|_| true;
pub(super) const NEVER_WAITED: &dyn Fn(u32) -> Duration = &|_| Duration::ZERO;
pub(super) const SILENT: &dyn Fn(RobotInstance) -> Option<String> = &|_| None;
pub(super) const FREE_PLACE: &dyn Fn([f64; 2], f64) -> Option<RobotIndex> = &|_, _| None;

pub(super) fn instance(slot: u32, incarnation: u32) -> RobotInstance {
    RobotInstance { index: RobotIndex(slot), incarnation }
}

/// Two robots that are there from the start, started and in the world.
pub(super) fn running(set: &[&str]) -> Coordinator {
    let entry = scenarios::find_catalog("head-on").expect("it is in the catalog");
    let set = set.iter().map(|text| (*text).to_owned()).collect();
    let overrides = scenarios::Overrides { set, ..scenarios::Overrides::default() };
    let scenario = scenarios::parse(entry.name, entry.text, &overrides).expect("it is valid");
    let mut coordinator = Coordinator::new(scenario);
    coordinator.begin();
    let spawns = coordinator.take_actions();
    assert_eq!(spawns, [Action::Spawn(instance(0, 0)), Action::Spawn(instance(1, 0))]);
    for slot in [0, 1] {
        coordinator.spawned(instance(slot, 0), 100 + slot, Duration::ZERO);
        coordinator.notice(Notice::Expect { instance: instance(slot, 0), tick: 0 });
        coordinator.notice(Notice::Entered { instance: instance(slot, 0), tick: 0 });
    }
    assert_eq!(coordinator.take_actions(), [], "the world asks for what was begun already");
    coordinator
}

/// Lets the coordinator look at the clock at each of these seconds.
pub(super) fn pass(
    coordinator: &mut Coordinator,
    seconds: std::ops::RangeInclusive<u64>,
    ready: &dyn Fn(RobotInstance) -> bool,
) {
    seconds.for_each(|second| coordinator.time(Duration::from_secs(second), ready, NEVER_WAITED, SILENT));
}

pub(super) fn killed() -> Ending {
    Ending { signal: Some(9), code: None }
}

pub(super) fn died(who: RobotInstance) -> Action {
    Action::Order(Order::Absent {
        instance: who,
        cause: Absence::Died { signal: Some(9), code: None, words: String::new() },
    })
}

/// What the world has been told since the last look.
fn orders(coordinator: &mut Coordinator) -> Vec<Order> {
    let order = |action| if let Action::Order(order) = action { Some(order) } else { None };
    coordinator.take_actions().into_iter().filter_map(order).collect()
}

#[test]
fn a_death_is_a_fact_for_the_world() {
    let mut coordinator = running(&[]);
    coordinator.exited(instance(1, 0), killed(), None, None);
    assert_eq!(coordinator.take_actions(), [died(instance(1, 0))]);
    assert_eq!(coordinator.members()[1].state, ProcessState::Dead);
}

#[test]
fn the_world_learns_why_a_robot_is_not_there() {
    let check =
        |state: ProcessState, code: i32, words: Option<&str>, deaf_to: Option<RobotIndex>, expected: Absence| {
            let mut coordinator = running(&[]);
            coordinator.with_current(instance(0, 0), |member| member.state = state);
            let ending = Ending { signal: None, code: Some(code) };
            coordinator.exited(instance(0, 0), ending, words.map(str::to_owned), deaf_to);
            assert_eq!(
                coordinator.take_actions(),
                [Action::Order(Order::Absent { instance: instance(0, 0), cause: expected })],
                "{state:?}"
            );
        };
    let why = |text: &str| text.to_owned();
    let not_started = |text: &str| Absence::NotStarted { why: why(text) };
    check(ProcessState::Starting, 3, Some("no room"), None, not_started("its process ended with code 3: no room"));
    check(
        ProcessState::Starting,
        0,
        None,
        None,
        not_started("its process ended with code 0 before it was ready (a wrapper has to stay until the agent ends)"),
    );
    check(ProcessState::Running, 3, Some("oh"), None, Absence::Died { signal: None, code: Some(3), words: why("oh") });
    // Whether the daemon has heard that it entered does not matter.
    for state in [ProcessState::Starting, ProcessState::Running] {
        let expected = Absence::Deaf { why: format!("cannot hear {}: no files", running(&[]).name(RobotIndex(1))) };
        check(state, 3, Some("no files"), Some(RobotIndex(1)), expected);
    }

    let mut coordinator = running(&[]);
    coordinator.not_spawned(instance(1, 0), why("no such file"));
    let order = Order::Absent { instance: instance(1, 0), cause: not_started("no such file") };
    assert_eq!(coordinator.take_actions(), [Action::Order(order)], "the world's log says it, once");
}

#[test]
fn the_next_life_starts_when_the_old_process_is_reaped() {
    let mut coordinator = running(&[]);
    coordinator.notice(Notice::Kill { instance: instance(0, 0) });
    coordinator.notice(Notice::Expect { instance: instance(0, 1), tick: 50 });
    let actions = coordinator.take_actions();
    assert!(actions.iter().all(|action| *action == Action::Signal(instance(0, 0), Signal::Kill)), "{actions:?}");
    coordinator.exited(instance(0, 0), killed(), None, None);
    assert_eq!(coordinator.take_actions(), [died(instance(0, 0)), Action::Spawn(instance(0, 1))]);
    coordinator.spawned(instance(0, 1), 200, Duration::ZERO);
    coordinator.exited(instance(0, 0), killed(), None, None);
    assert_eq!(coordinator.take_actions(), [], "nobody minds an older life");
}

#[test]
fn what_is_said_late_of_a_process_that_has_ended_changes_nothing() {
    let mut coordinator = running(&[]);
    coordinator.exited(instance(0, 0), killed(), None, None);
    let of_before = [
        Notice::Entered { instance: instance(0, 0), tick: 1 },
        Notice::Pause { instance: instance(0, 0) },
        Notice::Resume { instance: instance(0, 0) },
        Notice::Kill { instance: instance(0, 0) },
    ];
    of_before.into_iter().for_each(|notice| coordinator.notice(notice));
    assert_eq!(coordinator.take_actions(), [died(instance(0, 0))]);
    assert_eq!(coordinator.members()[0].state, ProcessState::Dead);
}

#[test]
fn a_robot_at_its_restart_limit_is_shown_as_such_whatever_comes_late() {
    let limit = Notice::RestartLimit { instance: instance(0, 0) };
    // The world gives up a robot that has died, or one whose process it has just had killed.
    for reaped in [true, false] {
        let mut coordinator = running(&[]);
        if reaped {
            coordinator.exited(instance(0, 0), killed(), None, None);
        } else {
            coordinator.notice(Notice::Kill { instance: instance(0, 0) });
        }
        coordinator.notice(limit.clone());
        if !reaped {
            coordinator.notice(Notice::Resume { instance: instance(0, 0) });
            coordinator.exited(instance(0, 0), killed(), None, None);
        }
        assert_eq!(coordinator.members()[0].state, ProcessState::RestartLimit, "reaped before: {reaped}");
        assert_eq!(coordinator.members()[1].state, ProcessState::Running);
    }
    // It can still leave; then that is what it has done.
    let mut coordinator = running(&[]);
    coordinator.notice(limit.clone());
    coordinator.notice(Notice::Left { instance: instance(0, 0) });
    coordinator.notice(limit);
    assert_eq!(coordinator.members()[0].state, ProcessState::Left);
    // A later life is not meant.
    let mut coordinator = running(&[]);
    coordinator.exited(instance(0, 0), killed(), None, None);
    coordinator.notice(Notice::Expect { instance: instance(0, 1), tick: 50 });
    coordinator.notice(Notice::RestartLimit { instance: instance(0, 0) });
    assert_eq!(coordinator.members()[0].state, ProcessState::Starting);
}

#[test]
fn a_life_that_is_over_before_it_is_started_is_not_started() {
    // The daemon was away, and hears all of this in one batch.
    let heard = |notices: Vec<Notice>, reaped: bool| {
        let mut coordinator = running(&[]);
        if reaped {
            coordinator.exited(instance(0, 0), killed(), None, None);
        }
        notices.into_iter().for_each(|notice| coordinator.notice(notice));
        if !reaped {
            coordinator.exited(instance(0, 0), killed(), None, None);
        }
        let actions = coordinator.take_actions().into_iter();
        let spawned: Vec<RobotInstance> = actions
            .filter_map(|action| if let Action::Spawn(instance) = action { Some(instance) } else { None })
            .collect();
        (spawned, coordinator.members()[0].state)
    };
    let expect = |incarnation: u32| Notice::Expect { instance: instance(0, incarnation), tick: 50 };
    let (kill, left) = (Notice::Kill { instance: instance(0, 1) }, Notice::Left { instance: instance(0, 1) });
    for reaped in [true, false] {
        assert_eq!(heard(vec![expect(1)], reaped), (vec![instance(0, 1)], ProcessState::Starting));
        assert_eq!(heard(vec![expect(1), kill.clone()], reaped), (vec![], ProcessState::Dead));
        assert_eq!(
            heard(vec![expect(1), kill.clone(), expect(2)], reaped),
            (vec![instance(0, 2)], ProcessState::Starting)
        );
        assert_eq!(heard(vec![expect(1), left.clone()], reaped), (vec![], ProcessState::Left));
        assert_eq!(
            heard(vec![left.clone()], reaped),
            (vec![], ProcessState::Left),
            "it left before its next life began"
        );
    }
}

#[test]
fn a_process_that_is_stopped_while_it_starts_is_given_up_at_the_limit_or_held_when_it_enters() {
    let mut coordinator = running(&["fleet.start_limit_s=2"]);
    coordinator.exited(instance(0, 0), killed(), None, None);
    coordinator.notice(Notice::Expect { instance: instance(0, 1), tick: 50 });
    coordinator.spawned(instance(0, 1), 200, Duration::from_secs(10));
    coordinator.take_actions();
    coordinator.stopped(instance(0, 1));
    assert_eq!(coordinator.take_actions(), [], "it is not in the world");
    pass(&mut coordinator, 10..=13, &|_| false);
    assert_eq!(coordinator.take_actions().len(), 2, "given up, and killed");

    let mut coordinator = running(&["fleet.straggler=\"hold\""]);
    coordinator.exited(instance(0, 0), killed(), None, None);
    coordinator.notice(Notice::Expect { instance: instance(0, 1), tick: 50 });
    coordinator.spawned(instance(0, 1), 200, Duration::from_secs(10));
    coordinator.stopped(instance(0, 1));
    coordinator.take_actions();
    coordinator.notice(Notice::Entered { instance: instance(0, 1), tick: 50 });
    let order = Order::Absent { instance: instance(0, 1), cause: Absence::Stopped };
    assert_eq!(orders(&mut coordinator), [order]);
    assert_eq!(coordinator.members()[0].state, ProcessState::Stopped);
}

#[test]
fn a_process_that_does_not_end_when_its_robot_has_left_is_killed() {
    let mut coordinator = running(&["fleet.start_limit_s=2"]);
    coordinator.notice(Notice::Left { instance: instance(0, 0) });
    pass(&mut coordinator, 10..=11, ALL_READY);
    assert_eq!(coordinator.take_actions(), [], "it has time to end");
    coordinator.time(Duration::from_secs(60), ALL_READY, NEVER_WAITED, SILENT);
    assert_eq!(coordinator.take_actions(), [], "the daemon has been away");
    pass(&mut coordinator, 61..=61, ALL_READY);
    assert_eq!(coordinator.take_actions(), [Action::Signal(instance(0, 0), Signal::Kill)]);
    coordinator.exited(instance(0, 0), killed(), None, None);
    pass(&mut coordinator, 62..=70, ALL_READY);
    assert_eq!(coordinator.take_actions(), []);
    assert_eq!(coordinator.members()[0].state, ProcessState::Left);
}

#[test]
fn a_life_that_waits_for_a_process_that_does_not_exit_is_given_up() {
    let mut coordinator = running(&["fleet.start_limit_s=2"]);
    coordinator.notice(Notice::Kill { instance: instance(0, 0) });
    coordinator.notice(Notice::Expect { instance: instance(0, 1), tick: 50 });
    coordinator.take_actions();
    pass(&mut coordinator, 10..=12, ALL_READY);
    assert_eq!(coordinator.take_actions(), []);
    pass(&mut coordinator, 13..=13, ALL_READY);
    let why = "the process of its life before was killed but does not exit".to_owned();
    let given_up = Order::Absent { instance: instance(0, 1), cause: Absence::NotStarted { why } };
    assert_eq!(coordinator.take_actions(), [Action::Order(given_up)]);
    coordinator.exited(instance(0, 0), killed(), None, None);
    assert_eq!(coordinator.take_actions(), [died(instance(0, 0))], "its time is over");
}

#[test]
fn notices_that_did_not_come_are_said_and_answers_among_them_are_not_taken_for_refusals() {
    let mut coordinator = running(&[]);
    let said = |coordinator: &mut Coordinator, entries: u64, others: u64| {
        coordinator.missed(Missed { entries, others });
        let actions = coordinator.take_actions().into_iter();
        let lines =
            actions.map(|action| if let Action::Say(line) = action { line } else { panic!("not said: {action:?}") });
        lines.map(|line| line.split(' ').next().unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(said(&mut coordinator, 0, 0), [""; 0]);
    assert_eq!(said(&mut coordinator, 12, 0), ["12"]);
    assert_eq!(said(&mut coordinator, 12, 0), [""; 0], "once");
    coordinator.request(&task("east", [0.0, 1.0]), FREE_PLACE);
    coordinator.take_actions();
    assert_eq!(said(&mut coordinator, 15, 2), ["3", "2"]);
    coordinator.stopping();
    coordinator.refuse_waiting();
    let told = replies(&mut coordinator);
    assert!(told.len() == 1 && told[0].1.starts_with("task 0 for robot `east`: not confirmed"), "{told:?}");
}

#[test]
fn a_stop_is_a_matter_of_policy_unless_the_timeline_asked_for_it() {
    for (policy, expected) in [("wait", 0), ("hold", 1), ("drop", 1)] {
        let mut coordinator = running(&[&format!("fleet.straggler={policy:?}")]);
        coordinator.stopped(instance(0, 0));
        assert_eq!(orders(&mut coordinator).len(), expected, "{policy}");
        assert_eq!(coordinator.members()[0].state, ProcessState::Stopped);
        coordinator.continued(instance(0, 0));
        assert_eq!(coordinator.members()[0].state, ProcessState::Running);
    }
    let mut coordinator = running(&[]);
    coordinator.notice(Notice::Pause { instance: instance(0, 0) });
    coordinator.stopped(instance(0, 0));
    assert_eq!(coordinator.take_actions(), [Action::Signal(instance(0, 0), Signal::Stop)]);
}

#[test]
fn whoever_is_not_ready_in_time_is_given_up() {
    let mut coordinator = running(&["fleet.start_limit_s=2"]);
    coordinator.exited(instance(0, 0), killed(), None, None);
    coordinator.notice(Notice::Expect { instance: instance(0, 1), tick: 50 });
    coordinator.take_actions();
    pass(&mut coordinator, 10..=10, &|_| false);
    assert_eq!(coordinator.take_actions(), [], "it is not even started");
    coordinator.spawned(instance(0, 1), 200, Duration::from_secs(10));
    coordinator.take_actions();
    pass(&mut coordinator, 11..=13, ALL_READY);
    assert_eq!(coordinator.take_actions(), [], "it waits for its tick, and is ready");
    coordinator.spawned(instance(0, 1), 200, Duration::from_secs(13));
    pass(&mut coordinator, 14..=14, &|_| false);
    assert_eq!(coordinator.take_actions(), [], "there is time left");
    coordinator.time(Duration::from_secs(3600), &|_| false, NEVER_WAITED, SILENT);
    assert_eq!(coordinator.take_actions(), [], "the daemon has been away: nobody ran meanwhile");
    pass(&mut coordinator, 3601..=3601, &|_| false);
    let why = "not ready within 2 s".to_owned();
    let given_up = Action::Order(Order::Absent { instance: instance(0, 1), cause: Absence::NotStarted { why } });
    assert_eq!(coordinator.take_actions(), [given_up, Action::Signal(instance(0, 1), Signal::Kill)]);
}

#[test]
fn waiting_for_a_processor_is_not_the_time_of_the_one_that_waits() {
    let mut coordinator = running(&["fleet.start_limit_s=2"]);
    coordinator.exited(instance(0, 0), killed(), None, None);
    coordinator.notice(Notice::Expect { instance: instance(0, 1), tick: 50 });
    coordinator.spawned(instance(0, 1), 200, Duration::ZERO);
    coordinator.take_actions();
    let given_up_after = |coordinator: &mut Coordinator, waited: &dyn Fn(u64) -> u64| {
        (1..100).find(|&second| {
            let waited = |pid: u32| Duration::from_secs(if pid == 200 { waited(second) } else { 0 });
            coordinator.time(Duration::from_secs(second), &|_| false, &waited, SILENT);
            !coordinator.take_actions().is_empty()
        })
    };
    // Half of the time it was ready and had no processor; and then a process that never gets one.
    assert_eq!(given_up_after(&mut coordinator, &|second| second / 2), Some(5));
    coordinator.exited(instance(0, 1), killed(), None, None);
    coordinator.notice(Notice::Expect { instance: instance(0, 2), tick: 60 });
    coordinator.spawned(instance(0, 2), 200, Duration::ZERO);
    coordinator.take_actions();
    assert_eq!(given_up_after(&mut coordinator, &|second| second), Some(41));
}

#[test]
fn the_second_interrupt_ends_everything_at_once() {
    let mut coordinator = running(&[]);
    let at = |ms: u64| Duration::from_millis(5000 + ms);
    coordinator.interrupt(at(0));
    assert!(coordinator.take_actions().contains(&Action::Order(Order::Stop)));
    for ms in [0, 1, 199] {
        coordinator.interrupt(at(ms));
        assert_eq!(coordinator.take_actions(), [], "{ms} ms later: it was the same request");
    }
    coordinator.interrupt(at(200));
    assert_eq!(coordinator.take_actions(), [Action::KillFleet]);
}

pub(super) fn add(id: &str, start_m: [f64; 2]) -> Request {
    Request::Add(NewRobot { id: Some(id.to_owned()), start_m, goal_m: [0.0, 2.5], ..Default::default() })
}

pub(super) fn task(robot: &str, goal_m: [f64; 2]) -> Request {
    Request::Task(NewTasks { assign: Assign::Robot(robot.to_owned()), tasks: vec![Task::to(goal_m)], key: None })
}

pub(super) fn refusal(answer: Answer) -> String {
    match answer {
        Answer::Now(Reply::Refused { problem, .. }) => problem,
        other => panic!("not refused: {other:?}"),
    }
}

/// Tasks in words: number, robot and state.
fn words_of(records: &[TaskRecord]) -> String {
    let words = |record: &TaskRecord| format!("task {} of {}: {}", record.id, record.robot, record.state.word());
    records.iter().map(words).collect::<Vec<_>>().join(", ")
}

/// What operators have been answered since the last look, in words.
pub(super) fn replies(coordinator: &mut Coordinator) -> Vec<(Ticket, String)> {
    let actions = coordinator.take_actions().into_iter();
    let replies = actions
        .filter_map(|action| if let Action::Reply(ticket, reply) = action { Some((ticket, reply)) } else { None });
    replies
        .map(|(ticket, reply)| match reply {
            Reply::Joined { robot, index, incarnation, joined_ms, neighbors } => {
                (ticket, format!("{robot} joined as {index}.{incarnation} after {joined_ms} ms with {neighbors}"))
            }
            Reply::Tasked(records) | Reply::Tasks(records) => (ticket, words_of(&records)),
            Reply::Removed { robot } => (ticket, format!("{robot} has left")),
            Reply::Injected { ticks } => (ticket, format!("fault for {ticks:?} ticks")),
            Reply::Refused { problem, .. } => (ticket, problem),
            Reply::Failed { problem, .. } => (ticket, format!("failed: {problem}")),
            Reply::Unconfirmed { problem, .. } => (ticket, problem),
            Reply::Pace(state) => (ticket, format!("tick {}, until {:?}", state.tick, state.until_tick)),
            Reply::Status(_) | Reply::Events(_) | Reply::Stopping => panic!("that is said at once"),
        })
        .collect()
}

pub(super) fn answer(coordinator: &mut Coordinator, ticket: Ticket, refused: Option<&str>) {
    coordinator.notice(Notice::Answer { ticket, refused: refused.map(str::to_owned) });
}

#[test]
fn operators_are_served_or_told_why_not() {
    let mut coordinator = running(&["fleet.max_robots=3"]);
    assert!(refusal(coordinator.request(&add("east", [0.0, -2.0]), FREE_PLACE)).contains("taken"));
    let near: &dyn Fn([f64; 2], f64) -> Option<RobotIndex> = &|_, _| Some(RobotIndex(1));
    assert!(refusal(coordinator.request(&add("north", [0.0, -2.0]), near)).contains("is in the way"));
    assert_eq!(coordinator.take_actions(), []);
    let added = coordinator.request(&add("north", [0.0, -2.0]), FREE_PLACE);
    assert_eq!(added, Answer::Later(Ticket::Admit(instance(2, 0))));
    let [Action::Order(Order::Admit { instance: new, .. }), Action::Spawn(begun)] = coordinator.take_actions()[..]
    else {
        panic!("an order, and its process");
    };
    assert_eq!([new, begun], [instance(2, 0); 2]);
    assert!(refusal(coordinator.request(&add("south", [0.0, -2.0]), FREE_PLACE)).contains("full"));

    assert_eq!(coordinator.request(&task("north", [0.0, 1.0]), FREE_PLACE), Answer::Later(Ticket::Task(TaskId(0))));
    assert!(refusal(coordinator.request(&task("nobody", [0.0, 1.0]), FREE_PLACE)).contains("unknown robot"));
    assert!(refusal(coordinator.request(&task("north", [1e9, 1.0]), FREE_PLACE)).contains("outside"));
}

#[test]
fn an_operator_is_answered_when_the_world_has_decided() {
    let mut coordinator = running(&["fleet.max_robots=4"]);
    let (north, first, second) = (Ticket::Admit(instance(2, 0)), Ticket::Task(TaskId(0)), Ticket::Task(TaskId(1)));
    coordinator.request(&add("north", [0.0, -2.0]), FREE_PLACE);
    coordinator.request(&task("north", [0.0, 1.0]), FREE_PLACE);
    coordinator.request(&task("east", [0.0, 1.0]), FREE_PLACE);
    pass(&mut coordinator, 10..=12, ALL_READY);
    assert_eq!(replies(&mut coordinator), [], "nothing is known yet");
    answer(&mut coordinator, north, None);
    answer(&mut coordinator, first, Some("too many goals are waiting"));
    let expected = [(first, "robot `north`: too many goals are waiting".to_owned())];
    assert_eq!(replies(&mut coordinator), expected, "the newcomer does not take part yet");
    answer(&mut coordinator, first, None);
    answer(&mut coordinator, Ticket::Task(TaskId(77)), None);
    assert_eq!(replies(&mut coordinator), [], "nobody asked, or nobody waits any more");
    coordinator.stopping();
    coordinator.refuse_waiting();
    let expected = [
        (second, "robot `east`: the run is over".to_owned()),
        (north, "robot `north`: not confirmed: the run is over".to_owned()),
    ];
    assert_eq!(replies(&mut coordinator), expected);
    assert_eq!(refusal(coordinator.request(&task("east", [0.0, 1.0]), FREE_PLACE)), "the run is over");
}

#[test]
fn faults_go_to_the_world_and_what_is_none_does_not() {
    let mut coordinator = running(&["clock.tick_hz=50"]);
    let inject = |robot: &str, fault, for_s| Request::Inject { robot: robot.to_owned(), fault, for_s };
    let wrong = [
        ("nobody", Fault::Kill, None, "unknown robot `nobody`"),
        ("\x1b[2J", Fault::Kill, None, "unknown robot `\\u{1b}[2J`"),
        ("east", Fault::Kill, Some(1.0), "kill: it does not last"),
        ("east", Fault::Resume, Some(1.0), "resume: it does not last"),
        ("east", Fault::Pause, Some(f64::NAN), "pause: NaN s is not a length of time"),
        ("east", Fault::Pause, Some(f64::INFINITY), "pause: inf s is not a length of time"),
        ("east", Fault::Mute, Some(0.0), "mute: 0 s is not a length of time"),
        ("east", Fault::Mute, Some(-1.0), "mute: -1 s is not a length of time"),
        ("east", Fault::Drop { share: 1.5 }, None, "drop: 1.5 is not between 0 and 1"),
        ("east", Fault::Noise { sigma_m: f64::NAN }, None, "noise: NaN m is not between"),
        ("east", Fault::Delay { ticks: u32::MAX }, None, "delay: 4294967295 ticks is not between 0 and 255"),
    ];
    for (robot, fault, for_s, problem) in wrong {
        let said = refusal(coordinator.request(&inject(robot, fault, for_s), FREE_PLACE));
        assert!(said.starts_with(problem), "{said}");
    }
    assert_eq!(coordinator.take_actions(), []);
    let right = [(Fault::Kill, None, None), (Fault::Mute, Some(0.3), Some(15)), (Fault::Pause, Some(1e-9), Some(1))];
    for ((fault, for_s, ticks), id) in right.into_iter().zip(0..) {
        let ticket = Ticket::Fault(FaultId(id));
        assert_eq!(coordinator.request(&inject("west", fault, for_s), FREE_PLACE), Answer::Later(ticket));
        let order = Order::Fault { id: FaultId(id), index: RobotIndex(1), fault, ticks };
        assert_eq!(coordinator.take_actions(), [Action::Order(order)]);
        answer(&mut coordinator, ticket, None);
        assert_eq!(replies(&mut coordinator), [(ticket, format!("fault for {ticks:?} ticks"))]);
    }
    coordinator.request(&inject("west", Fault::Pause, None), FREE_PLACE);
    answer(&mut coordinator, Ticket::Fault(FaultId(3)), Some("the robot is dead"));
    let told = replies(&mut coordinator);
    assert_eq!(told, [(Ticket::Fault(FaultId(3)), "robot `west`: the robot is dead".to_owned())]);
}

#[test]
fn noise_is_reported_now_and_then() {
    let mut coordinator = running(&[]);
    let said = |coordinator: &mut Coordinator, count: u64, second: u64| {
        coordinator.noise(count, "it is too long", Duration::from_secs(second));
        let actions = coordinator.take_actions().into_iter();
        let lines = actions.map(|action| if let Action::Say(line) = action { line } else { panic!("{action:?}") });
        lines.collect::<Vec<_>>()
    };
    assert_eq!(said(&mut coordinator, 0, 1), [""; 0]);
    assert_eq!(said(&mut coordinator, 1, 2), ["operators: refused what is not a request: it is too long"]);
    for second in 2..12 {
        assert_eq!(said(&mut coordinator, 1000 * second, second), [""; 0], "it was said just now");
    }
    let sum = "operators: refused 11999 times what is not a request, the last time: it is too long";
    assert_eq!(said(&mut coordinator, 12_000, 12), [sum]);
    assert_eq!(said(&mut coordinator, 12_000, 3600), [""; 0]);
}

#[test]
fn a_world_that_does_not_answer_is_not_waited_for_without_end() {
    let mut coordinator = running(&[]);
    coordinator.request(&task("east", [0.0, 1.0]), FREE_PLACE);
    pass(&mut coordinator, 10..=13, ALL_READY);
    assert_eq!(replies(&mut coordinator), []);
    pass(&mut coordinator, 14..=20, ALL_READY);
    let told = replies(&mut coordinator);
    assert!(told.len() == 1 && told[0].1.starts_with("task 0 for robot `east`: not confirmed"), "{told:?}");
    // One answer to a request, and the order still counts as waiting.
    for task_number in 1..WAITING_MAX {
        let answer = coordinator.request(&task("east", [0.0, 1.0]), FREE_PLACE);
        assert_eq!(answer, Answer::Later(Ticket::Task(TaskId(task_number as u32))));
    }
    assert!(refusal(coordinator.request(&task("east", [0.0, 1.0]), FREE_PLACE)).contains("wait for the world"));
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    assert_eq!(replies(&mut coordinator), []);
    assert!(matches!(coordinator.request(&task("east", [0.0, 1.0]), FREE_PLACE), Answer::Later(_)));
    coordinator.stopping();
    coordinator.refuse_waiting();
    assert_eq!(replies(&mut coordinator).len(), WAITING_MAX);
}

#[test]
fn a_robot_that_the_world_refuses_was_never_there() {
    let mut coordinator = running(&["fleet.max_robots=5"]);
    for (id, y_m) in [("n", -2.0), ("s", -3.0), ("w", -4.0)] {
        coordinator.request(&add(id, [0.0, y_m]), FREE_PLACE);
    }
    answer(&mut coordinator, Ticket::Admit(instance(2, 0)), None);
    answer(&mut coordinator, Ticket::Admit(instance(3, 0)), Some("no"));
    assert_eq!(coordinator.members().len(), 5, "places in lists are kept");
    answer(&mut coordinator, Ticket::Admit(instance(4, 0)), Some("no"));
    assert_eq!((coordinator.members().len(), coordinator.scenario().robots.len()), (3, 3));
    assert_eq!(coordinator.request(&add("s", [0.0, -3.0]), FREE_PLACE), Answer::Later(Ticket::Admit(instance(3, 0))));
}
