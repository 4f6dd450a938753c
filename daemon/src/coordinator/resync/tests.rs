use super::super::tests::{ALL_READY, FREE_PLACE, answer, instance, killed, pass, replies, running, task};
use super::super::{Answer, CONFIRM_WITHIN, Ending, Robots};
use super::*;
use model::{Task, TaskStep};
use protocol::operator_to_daemon::{Assign, NewRobot, Request, TaskChange, TaskRecord};
use protocol::world_to_daemon::Notice;

/// In place of the number of a process that was started, and has ended.
const ENDED: u32 = 0;

/// A daemon that has just taken over a fleet of two, of which these processes run.
fn adopted(processes: &[(RobotInstance, u32)]) -> Coordinator {
    let scenario = running(&[]).scenario().clone();
    let begun: Vec<_> = processes.iter().map(|(who, pid)| (*who, Some(*pid).filter(|pid| *pid != ENDED))).collect();
    let mut coordinator = Coordinator::adopted(scenario, &begun, 0);
    coordinator.resync();
    assert_eq!(coordinator.take_actions(), [Action::Order(Order::Resync(0))]);
    coordinator
}

fn both() -> Coordinator {
    adopted(&[(instance(0, 0), 100), (instance(1, 0), 101)])
}

/// The world says how the robots stand.
fn says(coordinator: &mut Coordinator, robots: &[(RobotInstance, Standing)]) -> Vec<Action> {
    let number = coordinator.resync.as_ref().expect("it was asked").number;
    let standings = Standings { number, robots: robots.to_vec(), ..Standings::default() };
    coordinator.notice(Notice::Standings(standings));
    coordinator.take_actions()
}

fn states(coordinator: &Coordinator) -> Vec<ProcessState> {
    coordinator.members().iter().map(|member| member.state).collect()
}

fn absent(actions: &[Action]) -> Vec<RobotInstance> {
    let absent = |action: &Action| match action {
        Action::Order(Order::Absent { instance, cause: Absence::Died { .. } }) => Some(*instance),
        _ => None,
    };
    actions.iter().filter_map(absent).collect()
}

#[test]
fn robots_that_take_part_are_left_alone() {
    let mut coordinator = both();
    let actions = says(&mut coordinator, &[(instance(0, 0), Standing::Present), (instance(1, 0), Standing::Held)]);
    assert_eq!(actions, []);
    assert_eq!(states(&coordinator), [ProcessState::Running; 2]);
    assert!(!coordinator.is_resyncing());
    // From here on everything is as ever.
    coordinator.exited(instance(1, 0), killed(), None, None);
    assert_eq!(absent(&coordinator.take_actions()), [instance(1, 0)]);
}

#[test]
fn what_ended_unseen_is_told_and_what_is_wanted_is_started() {
    let check = |processes: &[(RobotInstance, u32)], standing: (RobotInstance, Standing), expected: &[Action]| {
        let mut coordinator = adopted(processes);
        let mut actions = says(&mut coordinator, &[standing, (instance(1, 0), Standing::Left)]);
        let ended = absent(&actions);
        actions.retain(|action| !matches!(action, Action::Order(Order::Absent { .. })));
        assert_eq!(actions, expected, "{processes:?} {standing:?}");
        ended
    };
    let (first, second) = (instance(0, 0), instance(0, 1));
    let spawn = || vec![Action::Spawn(second)];
    let signal = |who: RobotInstance, signal: Signal| vec![Action::Signal(who, signal)];
    use Standing::{Awaited, Dead, Paused, Present};
    assert_eq!(check(&[], (first, Present), &[]), [first]);
    assert_eq!(check(&[], (first, Paused { goes_on: false }), &[]), [first]);
    // The world waits for a life that the daemon before had not started, or had.
    check(&[], (second, Awaited { told: true }), &spawn());
    check(&[(second, 100)], (second, Awaited { told: true }), &[]);
    check(&[], (second, Awaited { told: false }), &[]);
    assert_eq!(check(&[(second, ENDED)], (second, Awaited { told: true }), &[]), [second], "it was started once");
    check(&[(first, ENDED)], (second, Awaited { told: true }), &spawn());
    // The process before it is still there.
    check(&[(first, 100)], (second, Awaited { told: true }), &signal(first, Signal::Kill));
    // The world has not heard of the end of a life.
    assert_eq!(check(&[(second, 100)], (first, Present), &[]), [first]);
    check(&[(first, 100)], (first, Paused { goes_on: false }), &signal(first, Signal::Stop));
    check(&[(first, 100)], (first, Paused { goes_on: true }), &signal(first, Signal::Continue));
    check(&[(first, 100)], (first, Dead), &signal(first, Signal::Kill));
    check(&[], (first, Dead), &[]);
}

#[test]
fn a_robot_at_its_restart_limit_stays_that_for_a_new_daemon() {
    for (standing, expected) in
        [(Standing::RestartLimit, ProcessState::RestartLimit), (Standing::Dead, ProcessState::Dead)]
    {
        let mut coordinator = both();
        says(&mut coordinator, &[(instance(0, 0), standing), (instance(1, 0), Standing::Present)]);
        coordinator.exited(instance(0, 0), killed(), None, None);
        assert_eq!(coordinator.members()[0].state, expected);
    }
}

#[test]
fn a_life_that_was_to_come_comes_when_the_one_before_is_gone() {
    let mut coordinator = both();
    let stands = [(instance(0, 1), Standing::Awaited { told: true }), (instance(1, 0), Standing::Present)];
    says(&mut coordinator, &stands);
    coordinator.exited(instance(0, 0), Ending { signal: None, code: None }, None, None);
    assert!(coordinator.take_actions().contains(&Action::Spawn(instance(0, 1))));
}

#[test]
fn a_stopped_process_is_no_news_where_the_world_wants_that() {
    let check = |standing: Standing, expected: &[Action]| {
        let mut coordinator = both();
        coordinator.scenario.fleet.straggler = model::StragglerPolicy::Hold;
        coordinator.stopped(instance(0, 0));
        let mut actions = says(&mut coordinator, &[(instance(0, 0), standing), (instance(1, 0), Standing::Present)]);
        actions.retain(|action| !matches!(action, Action::News { .. }));
        assert_eq!(actions, expected, "{standing:?}");
    };
    check(Standing::Paused { goes_on: false }, &[]);
    let stopped = Order::Absent { instance: instance(0, 0), cause: Absence::Stopped };
    check(Standing::Present, &[Action::Order(stopped)]);
}

#[test]
fn an_answer_to_an_older_question_is_not_taken() {
    let mut coordinator = both();
    let stale = Standings { number: 0, robots: vec![(instance(0, 0), Standing::Dead)], ..Standings::default() };
    coordinator.resync();
    coordinator.take_actions();
    coordinator.notice(Notice::Standings(stale));
    assert_eq!(coordinator.take_actions(), []);
    assert!(coordinator.is_resyncing());
    says(&mut coordinator, &[(instance(0, 0), Standing::Present), (instance(1, 0), Standing::Present)]);
    assert!(!coordinator.is_resyncing());
}

fn record(id: u32, robot: &str, state: TaskState, deadline_s: Option<f64>) -> TaskRecord {
    TaskRecord {
        id: TaskId(id),
        key: None,
        assign: Assign::Robot(robot.to_owned()),
        robot: robot.to_owned(),
        task: Task { deadline_s, ..Task::to([0.0, 1.0]) },
        state,
        steps: vec![TaskChange { at_ms: 1000, state, robot: robot.to_owned(), reason: String::new() }],
    }
}

#[test]
fn tasks_are_neither_lost_nor_done_twice() {
    let scenario = running(&[]).scenario().clone();
    let (west, east) = (scenario.robots[0].id.clone(), scenario.robots[1].id.clone());
    let mut coordinator =
        Coordinator::adopted(scenario, &[(instance(0, 0), Some(100)), (instance(1, 0), Some(101))], 0);
    coordinator.tell_wall_clock(4000);
    let known = vec![
        record(0, &west, TaskState::Active, None),
        record(1, &west, TaskState::Assigned, None),
        record(2, &west, TaskState::Queued, Some(60.0)),
        record(3, &west, TaskState::Queued, Some(2.0)),
        record(4, &west, TaskState::Queued, None),
        record(5, &west, TaskState::Done, None),
    ];
    coordinator.keep_records(known, TaskId(6), Robots::Running);
    assert_eq!(coordinator.take_actions(), [], "the robots may have them");
    coordinator.resync();
    // What is sent later is none of the answer's business.
    assert!(matches!(coordinator.request(&task(&east, [0.0, 1.0]), FREE_PLACE), Answer::Later(_)));
    coordinator.kept(TaskId(6), Ok(()));
    coordinator.take_actions();
    coordinator.notice(Notice::Standings(Standings {
        number: 0,
        robots: vec![(instance(0, 0), Standing::Present), (instance(1, 0), Standing::Present)],
        tasks: vec![(TaskId(1), RobotIndex(0), true)],
        ended: vec![(TaskId(0), TaskStep::Done)],
    }));
    let mut orders = Vec::new();
    for action in coordinator.take_actions() {
        match action {
            Action::Order(Order::Task { id, task, .. }) => orders.push((id.0, task.deadline_s)),
            Action::Record(_) => {}
            other => panic!("{other:?}"),
        }
    }
    // Three of sixty seconds have gone by.
    assert_eq!(orders, [(2, Some(57.0)), (4, None)]);
    let is = |coordinator: &Coordinator, id: u32| coordinator.tasks.state_of(TaskId(id)).unwrap();
    use TaskState::{Active, Done, Failed, Queued};
    let found: Vec<TaskState> = (0..7).map(|id| is(&coordinator, id)).collect();
    assert_eq!(found, [Done, Active, Queued, Failed, Queued, Done, Queued]);
}

#[test]
fn operators_are_answered_when_the_world_that_they_asked_is_no_more() {
    let mut coordinator = running(&[]);
    let west = coordinator.scenario().robots[0].id.clone();
    let new = NewRobot { id: Some("new".to_owned()), start_m: [0.0, 4.0], goal_m: [0.0, 0.0], ..NewRobot::default() };
    assert!(matches!(coordinator.request(&Request::Add(new), FREE_PLACE), Answer::Later(_)));
    let kill = Request::Inject { robot: west.clone(), fault: model::Fault::Kill, for_s: None };
    assert!(matches!(coordinator.request(&kill, FREE_PLACE), Answer::Later(_)));
    assert!(matches!(coordinator.request(&task(&west, [0.0, 1.0]), FREE_PLACE), Answer::Later(_)));
    coordinator.take_actions();
    coordinator.resync();
    let present = [(instance(0, 0), Standing::Present), (instance(1, 0), Standing::Present)];
    let actions = says(&mut coordinator, &present);
    // The robot and the task are sent once more, and their operators wait on; whether a fault was done nobody can tell.
    let robot = coordinator.scenario().robots[2].clone();
    let admit = Order::Admit { instance: instance(2, 0), robot: Box::new(robot) };
    assert!(actions.contains(&Action::Order(admit)), "{actions:?}");
    assert!(actions.iter().any(|action| matches!(action, Action::Order(Order::Task { id: TaskId(0), .. }))));
    let lost: Vec<&Reply> = (actions.iter())
        .filter_map(|action| if let Action::Reply(_, reply) = action { Some(reply) } else { None })
        .collect();
    assert!(matches!(lost[..], [Reply::Unconfirmed { problem, .. }] if problem.contains("was replaced")), "{lost:?}");
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    answer(&mut coordinator, Ticket::Admit(instance(2, 0)), None);
    assert_eq!(replies(&mut coordinator).len(), 1);
    coordinator.notice(Notice::Entered { instance: instance(2, 0), tick: 9 });
    coordinator.joined(instance(2, 0), 2, std::time::Duration::ZERO);
    assert_eq!(replies(&mut coordinator).len(), 1);
    pass(&mut coordinator, 0..=CONFIRM_WITHIN.as_secs() + 2, ALL_READY);
    assert_eq!((replies(&mut coordinator).len(), coordinator.unanswered()), (0, 0), "nothing is left");
}

/// What the coordinator does about orders that a world had taken when it died, and had not answered.
fn after_a_world(
    coordinator: &mut Coordinator,
    requests: &[Request],
    robots: &[(RobotInstance, Standing)],
    ended: &[(TaskId, TaskStep)],
) -> Vec<Action> {
    for request in requests {
        assert!(matches!(coordinator.request(request, FREE_PLACE), Answer::Later(_)), "{request:?}");
    }
    coordinator.take_actions();
    coordinator.resync();
    coordinator.take_actions();
    let number = coordinator.resync.as_ref().unwrap().number;
    let (robots, ended) = (robots.to_vec(), ended.to_vec());
    coordinator.notice(Notice::Standings(Standings { number, robots, tasks: Vec::new(), ended }));
    coordinator.take_actions()
}

const PRESENT: [(RobotInstance, Standing); 2] = [
    (RobotInstance { index: RobotIndex(0), incarnation: 0 }, Standing::Present),
    (RobotInstance { index: RobotIndex(1), incarnation: 0 }, Standing::Present),
];

#[test]
fn a_removal_that_a_world_lost_is_ordered_again() {
    let mut coordinator = running(&[]);
    let remove = Request::Remove { robot: coordinator.scenario().robots[1].id.clone() };
    let order = Action::Order(Order::Remove { index: RobotIndex(1) });
    assert_eq!(after_a_world(&mut coordinator, std::slice::from_ref(&remove), &PRESENT, &[]), [order]);
    coordinator.notice(Notice::Left { instance: instance(1, 0) });
    answer(&mut coordinator, Ticket::Remove(RobotIndex(1)), None);
    assert_eq!(replies(&mut coordinator).len(), 1);
    // One that was done is answered.
    let mut coordinator = running(&[]);
    let left = [PRESENT[0], (instance(1, 0), Standing::Left)];
    let actions = after_a_world(&mut coordinator, &[remove], &left, &[]);
    assert!(actions.iter().any(|action| matches!(action, Action::Reply(_, Reply::Removed { .. }))), "{actions:?}");
    assert_eq!(coordinator.unanswered(), 0);
}

#[test]
fn a_cancellation_that_a_world_lost_is_ordered_again() {
    let with_a_task = || {
        let mut coordinator = running(&[]);
        let west = coordinator.scenario().robots[0].id.clone();
        coordinator.request(&task(&west, [0.0, 1.0]), FREE_PLACE);
        answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
        coordinator
    };
    let cancel = [Request::Cancel("0".to_owned())];
    let mut coordinator = with_a_task();
    assert!(matches!(coordinator.request(&cancel[0], FREE_PLACE), Answer::Later(_)));
    coordinator.resync();
    coordinator.take_actions();
    let number = coordinator.resync.as_ref().unwrap().number;
    let tasks = vec![(TaskId(0), RobotIndex(0), false)];
    coordinator.notice(Notice::Standings(Standings { number, robots: PRESENT.to_vec(), tasks, ended: Vec::new() }));
    let order = Action::Order(Order::Cancel { id: TaskId(0), index: RobotIndex(0) });
    assert_eq!(coordinator.take_actions(), [order]);
    // It was done before the world heard of it.
    let mut coordinator = with_a_task();
    let actions = after_a_world(&mut coordinator, &cancel, &PRESENT, &[(TaskId(0), TaskStep::Done)]);
    let said = |action: &Action| matches!(action, Action::Reply(_, Reply::Refused { problem, .. }) if problem.contains("is done already"));
    assert!(actions.iter().any(said), "{actions:?}");
    assert_eq!(coordinator.unanswered(), 0);
}

#[test]
fn a_robot_that_was_admitted_may_be_in_a_later_life_by_now() {
    let mut coordinator = running(&[]);
    let new = NewRobot { id: Some("new".to_owned()), start_m: [0.0, 4.0], goal_m: [0.0, 0.0], ..NewRobot::default() };
    let robots = [PRESENT[0], PRESENT[1], (instance(2, 1), Standing::Present)];
    after_a_world(&mut coordinator, &[Request::Add(new)], &robots, &[]);
    coordinator.joined(instance(2, 1), 2, std::time::Duration::ZERO);
    pass(&mut coordinator, 0..=CONFIRM_WITHIN.as_secs() + 2, ALL_READY);
    assert_eq!((replies(&mut coordinator).len(), coordinator.unanswered()), (1, 0));
}

#[test]
fn a_name_that_is_used_again_is_admitted_again() {
    let mut coordinator = running(&[]);
    let name = coordinator.scenario().robots[1].id.clone();
    coordinator.notice(Notice::Left { instance: instance(1, 0) });
    coordinator.exited(instance(1, 0), Ending { signal: None, code: Some(0) }, None, None);
    let new = NewRobot { id: Some(name), start_m: [0.0, 4.0], goal_m: [0.0, 0.0], ..NewRobot::default() };
    let left = [PRESENT[0], (instance(1, 0), Standing::Left)];
    let actions = after_a_world(&mut coordinator, &[Request::Add(new)], &left, &[]);
    let admitted =
        |action: &Action| matches!(action, Action::Order(Order::Admit { instance: who, .. }) if *who == instance(1, 1));
    assert!(actions.iter().any(admitted), "{actions:?}");
}
