use super::super::tests::{ALL_READY, FREE_PLACE, answer, instance, pass, refusal, replies, running, task};
use super::super::{Answer, Ending};
use super::*;
use model::Task;
use protocol::operator_to_daemon::Request;
use protocol::world_to_daemon::Notice;

/// `head-on` has the robots `west` and `east`... by their names in the scenario.
fn names(coordinator: &Coordinator) -> Vec<String> {
    coordinator.scenario().robots.iter().map(|robot| robot.id.clone()).collect()
}

fn batch(assign: Assign, goals_m: &[[f64; 2]]) -> Request {
    Request::Task(NewTasks { assign, tasks: goals_m.iter().map(|goal_m| Task::to(*goal_m)).collect(), key: None })
}

fn keyed(robot: &str, goal_m: [f64; 2], key: &str) -> Request {
    Request::Task(NewTasks {
        assign: Assign::Robot(robot.to_owned()),
        tasks: vec![Task::to(goal_m)],
        key: Some(key.to_owned()),
    })
}

fn list(coordinator: &mut Coordinator, filter: TaskFilter) -> Vec<TaskRecord> {
    match coordinator.request(&Request::Tasks(filter), FREE_PLACE) {
        Answer::Now(Reply::Tasks(records)) => records,
        other => panic!("no list: {other:?}"),
    }
}

fn all() -> TaskFilter {
    TaskFilter { newest: u32::MAX, ..TaskFilter::default() }
}

fn states(coordinator: &mut Coordinator) -> Vec<TaskState> {
    list(coordinator, all()).iter().map(|record| record.state).collect()
}

fn step(coordinator: &mut Coordinator, id: u32, step: TaskStep) {
    coordinator.notice(Notice::Task { id: TaskId(id), step });
}

fn orders(actions: &[Action]) -> Vec<(u32, usize)> {
    let order = |action: &Action| match action {
        Action::Order(Order::Task { id, index, .. }) => Some((id.0, index.at())),
        _ => None,
    };
    actions.iter().filter_map(order).collect()
}

fn place(at_m: [f64; 2], goal_m: Option<[f64; 2]>) -> Option<Place> {
    Some(Place { at_m, goal_m, says_left_m: None })
}

/// The same, of a robot that has published this distance.
fn bid(at_m: [f64; 2], goal_m: Option<[f64; 2]>, left_m: f64) -> Option<Place> {
    place(at_m, goal_m).map(|place| Place { says_left_m: Some(left_m), ..place })
}

#[test]
fn a_task_has_a_life() {
    let mut coordinator = running(&[]);
    let east = names(&coordinator)[0].clone();
    coordinator.tell_wall_clock(1000);
    coordinator.request(&task(&east, [0.0, 1.0]), FREE_PLACE);
    assert_eq!(states(&mut coordinator), [TaskState::Queued]);
    coordinator.tell_wall_clock(2000);
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    assert_eq!(states(&mut coordinator), [TaskState::Assigned]);
    for (state, told) in [(TaskState::Active, TaskStep::Active), (TaskState::Done, TaskStep::Done)] {
        step(&mut coordinator, 0, told);
        assert_eq!(states(&mut coordinator), [state]);
    }
    // What is at its end stays there.
    step(&mut coordinator, 0, TaskStep::Dropped(TaskEnd::Cancelled));
    let record = &list(&mut coordinator, all())[0];
    let times: Vec<u64> = record.steps.iter().map(|step| step.at_ms).collect();
    assert_eq!((record.state, times), (TaskState::Done, vec![1000, 2000, 2000, 2000]));
}

#[test]
fn every_end_has_its_reason() {
    let check = |end: TaskEnd, state: TaskState, why: &str| {
        let mut coordinator = running(&[]);
        let east = names(&coordinator)[0].clone();
        coordinator.request(&task(&east, [0.0, 1.0]), FREE_PLACE);
        step(&mut coordinator, 0, TaskStep::Dropped(end));
        let record = &list(&mut coordinator, all())[0];
        assert_eq!(record.state, state);
        assert!(record.steps.last().unwrap().reason.contains(why), "{record:?}");
        // Its sender is answered, though the world's own answer comes later or never.
        assert_eq!(replies(&mut coordinator).len(), 1);
        answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
        assert_eq!((replies(&mut coordinator).len(), states(&mut coordinator)), (0, vec![state]));
    };
    check(TaskEnd::Cancelled, TaskState::Cancelled, "operator");
    check(TaskEnd::Replaced, TaskState::Cancelled, "replaced");
    check(TaskEnd::Overdue, TaskState::Failed, "deadline");
    check(TaskEnd::RobotGone, TaskState::Failed, "is gone");
}

#[test]
fn nothing_is_ordered_before_it_is_kept() {
    let mut coordinator = running(&[]);
    coordinator.keep_records(Vec::new(), TaskId(40), Robots::New);
    let east = names(&coordinator)[0].clone();
    let first = Ticket::Task(TaskId(40));
    assert_eq!(coordinator.request(&task(&east, [0.0, 1.0]), FREE_PLACE), Answer::Later(first));
    let actions = coordinator.take_actions();
    assert!(matches!(&actions[..], [Action::Keep { first: TaskId(40), records }] if records.len() == 1), "{actions:?}");
    coordinator.kept(TaskId(40), Ok(()));
    assert_eq!(orders(&coordinator.take_actions()), [(40, 0)]);
    // Each change is kept before it is answered.
    answer(&mut coordinator, first, None);
    let actions = coordinator.take_actions();
    assert!(
        matches!(&actions[..], [Action::Record(record), Action::Reply(..)] if record.state == TaskState::Assigned),
        "{actions:?}"
    );

    // A disk that is full: refused, and it was never there.
    coordinator.request(&keyed(&east, [0.0, 1.0], "a"), FREE_PLACE);
    coordinator.take_actions();
    coordinator.kept(TaskId(41), Err("database `x`: the disk is full".to_owned()));
    let told = replies(&mut coordinator);
    assert!(told.len() == 1 && told[0].1 == "failed: database `x`: the disk is full", "{told:?}");
    assert_eq!(states(&mut coordinator).len(), 1);
    assert_eq!(
        coordinator.request(&keyed(&east, [0.0, 1.0], "a"), FREE_PLACE),
        Answer::Later(Ticket::Task(TaskId(42)))
    );
}

#[test]
fn what_was_open_is_given_to_its_robot_again() {
    let mut coordinator = running(&[]);
    let east = names(&coordinator)[0].clone();
    let record = |id: u32, robot: &str, goal_m: [f64; 2], state: TaskState| TaskRecord {
        id: TaskId(id),
        key: Some(format!("key-{id}")),
        assign: Assign::Robot(robot.to_owned()),
        robot: robot.to_owned(),
        task: Task::to(goal_m),
        state,
        steps: vec![TaskChange { at_ms: 1, state, robot: robot.to_owned(), reason: String::new() }],
    };
    let known = vec![
        record(3, &east, [0.0, 1.0], TaskState::Active),
        record(4, &east, [0.0, 1.0], TaskState::Done),
        record(5, "gone", [0.0, 1.0], TaskState::Assigned),
        record(6, &east, [1e6, 1.0], TaskState::Queued),
    ];
    coordinator.keep_records(known, TaskId(7), Robots::New);
    let actions = coordinator.take_actions();
    assert_eq!(orders(&actions), [(3, 0)]);
    use TaskState::{Done, Failed, Queued};
    assert_eq!(states(&mut coordinator), [Queued, Done, Failed, Failed]);
    assert_eq!(actions.iter().filter(|action| matches!(action, Action::Record(_))).count(), 3);
    // Their names are still theirs.
    let again = coordinator.request(&keyed(&east, [0.0, 1.0], "key-4"), FREE_PLACE);
    assert!(matches!(again, Answer::Now(Reply::Tasked(records)) if records[0].id == TaskId(4)));
    assert!(
        refusal(coordinator.request(&keyed(&east, [0.5, 1.0], "key-4"), FREE_PLACE)).contains("is taken by task 4")
    );
}

#[test]
fn a_task_sent_twice_under_its_name_is_one_task() {
    let mut coordinator = running(&[]);
    let east = names(&coordinator)[0].clone();
    assert!(matches!(coordinator.request(&keyed(&east, [0.0, 1.0], "a-1"), FREE_PLACE), Answer::Later(_)));
    let again = coordinator.request(&keyed(&east, [0.0, 1.0], "a-1"), FREE_PLACE);
    assert!(matches!(again, Answer::Now(Reply::Tasked(records)) if records[0].id == TaskId(0)));
    assert_eq!(states(&mut coordinator).len(), 1);
    // `+0` is neither its number nor its name.
    let which = vec!["+0".to_owned()];
    let filter = Request::Tasks(TaskFilter { which, ..all() });
    assert!(refusal(coordinator.request(&filter, FREE_PLACE)).contains("unknown task `+0`"));
    for key in ["", "17", "a b", "a/b", "\u{e4}", "a\n", &"x".repeat(KEY_MAX + 1)] {
        assert!(
            refusal(coordinator.request(&keyed(&east, [0.0, 1.0], key), FREE_PLACE)).contains("not valid"),
            "{key:?}"
        );
    }
    let two = NewTasks { assign: Assign::Robot(east), tasks: vec![Task::to([0.0, 1.0]); 2], key: Some("b".to_owned()) };
    assert!(refusal(coordinator.request(&Request::Task(two), FREE_PLACE)).contains("one task"));
}

#[test]
fn several_goals_are_answered_together() {
    let mut coordinator = running(&[]);
    let east = names(&coordinator)[0].clone();
    let request = batch(Assign::Robot(east.clone()), &[[0.0, 1.0], [0.0, 1.2], [0.0, 1.4]]);
    assert_eq!(coordinator.request(&request, FREE_PLACE), Answer::Later(Ticket::Task(TaskId(0))));
    assert_eq!(orders(&coordinator.take_actions()), [(0, 0), (1, 0), (2, 0)]);
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    answer(&mut coordinator, Ticket::Task(TaskId(2)), Some("too many goals are waiting"));
    assert_eq!(replies(&mut coordinator), []);
    answer(&mut coordinator, Ticket::Task(TaskId(1)), None);
    let words = format!("task 0 of {east}: assigned, task 1 of {east}: assigned, task 2 of {east}: refused");
    assert_eq!(replies(&mut coordinator), [(Ticket::Task(TaskId(0)), words)]);
    for wrong in [batch(Assign::Nearest, &[]), batch(Assign::Nearest, &[[0.0, 1.0]; BATCH_MAX + 1])] {
        assert!(refusal(coordinator.request(&wrong, FREE_PLACE)).contains("can be sent at once"));
    }
}

#[test]
fn the_robots_are_chosen_by_their_ways() {
    let mut coordinator = running(&[]);
    assert!(
        refusal(coordinator.request(&batch(Assign::Nearest, &[[0.0, 1.0]]), FREE_PLACE)).contains("no robot can take")
    );
    assert!(!coordinator.wants_places());
    coordinator.tell_places(vec![place([0.0, 1.0], Some([0.0, -2.0])), place([0.0, 2.0], None)]);
    // The first is nearer, but is going elsewhere.
    coordinator.request(&batch(Assign::Nearest, &[[0.0, 1.2]]), FREE_PLACE);
    assert_eq!(orders(&coordinator.take_actions()), [(0, 1)]);
    assert!(coordinator.wants_places());
    // What it was just given counts.
    coordinator.request(&batch(Assign::Optimal, &[[0.0, -2.2], [0.0, 1.1]]), FREE_PLACE);
    assert_eq!(orders(&coordinator.take_actions()), [(1, 0), (2, 1)]);
    // One that is dead takes no task.
    coordinator.exited(instance(1, 0), Ending { signal: Some(9), code: None }, None, None);
    coordinator.take_actions();
    coordinator.request(&batch(Assign::Nearest, &[[0.0, 2.0]]), FREE_PLACE);
    assert_eq!(orders(&coordinator.take_actions()), [(3, 0)]);
    assert!(refusal(coordinator.request(&batch(Assign::Nearest, &[[1e9, 0.0]]), FREE_PLACE)).contains("outside"));
}

#[test]
fn in_an_auction_robots_bid_with_what_they_say_themselves() {
    let auctioned = |places: Vec<Option<Place>>, goals_m: &[[f64; 2]]| {
        let mut coordinator = running(&[]);
        coordinator.tell_places(places);
        coordinator.request(&batch(Assign::Auction, goals_m), FREE_PLACE);
        (orders(&coordinator.take_actions()), coordinator)
    };
    // The first is 1 m from its present goal by the map, and says that it has 5 m left: 5 + 1 against 0 + 3.
    let detour = || bid([0.0, 0.0], Some([0.0, 1.0]), 5.0);
    assert_eq!(auctioned(vec![detour(), bid([0.0, -1.0], None, 0.0)], &[[0.0, 2.0]]).0, [(0, 1)]);
    assert_eq!(
        auctioned(vec![bid([0.0, 0.0], Some([0.0, 1.0]), 1.0), bid([0.0, -1.0], None, 0.0)], &[[0.0, 2.0]]).0,
        [(0, 0)]
    );
    // One whose board says nothing makes no bid.
    assert_eq!(auctioned(vec![detour(), place([0.0, 2.0], None)], &[[0.0, 2.0]]).0, [(0, 0)]);
    let (none, mut coordinator) = auctioned(vec![place([0.0, 0.0], None), None], &[[0.0, 2.0]]);
    assert_eq!(none, []);
    let refused = refusal(coordinator.request(&batch(Assign::Auction, &[[0.0, 2.0]]), FREE_PLACE));
    assert_eq!(refused, "no robot makes a bid");
    // Nor does one whose process stands still.
    let both = || vec![bid([0.0, 0.0], None, 0.0), bid([0.0, 4.0], None, 0.0)];
    let mut coordinator = running(&[]);
    coordinator.tell_places(both());
    coordinator.stopped(instance(0, 0));
    coordinator.take_actions();
    coordinator.request(&batch(Assign::Auction, &[[0.0, 1.0]]), FREE_PLACE);
    assert_eq!(orders(&coordinator.take_actions()), [(0, 1)]);
    // What waits is part of a bid: 1 + 2.5 against 2.5, where 1.5 would have won.
    let (won, mut coordinator) = auctioned(both(), &[[0.0, -1.0]]);
    assert_eq!(won, [(0, 0)]);
    coordinator.request(&batch(Assign::Auction, &[[0.0, 1.5]]), FREE_PLACE);
    assert_eq!(orders(&coordinator.take_actions()), [(1, 1)]);
}

#[test]
fn a_task_of_an_auction_is_put_up_again_when_its_robot_is_gone() {
    let mut coordinator = running(&[]);
    let dropped = |id: u32| Notice::Task { id: TaskId(id), step: TaskStep::Dropped(TaskEnd::RobotGone) };
    coordinator.tell_places(vec![bid([0.0, 1.0], None, 0.0), bid([0.0, 2.0], None, 0.0)]);
    coordinator.request(&batch(Assign::Auction, &[[0.0, 1.0]]), FREE_PLACE);
    coordinator.request(&batch(Assign::Nearest, &[[0.0, 1.0]]), FREE_PLACE);
    assert_eq!(orders(&coordinator.take_actions()), [(0, 0), (1, 0)]);
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    assert!(coordinator.wants_bids(&dropped(0)) && !coordinator.wants_bids(&dropped(1)));
    assert!(!coordinator.wants_bids(&Notice::Task { id: TaskId(0), step: TaskStep::Done }));
    // Without bids nobody gets it.
    coordinator.tell_places(vec![place([0.0, 1.0], None), bid([0.0, 2.0], None, 0.0)]);
    coordinator.notice(dropped(0));
    assert_eq!(orders(&coordinator.take_actions()), [(0, 1)]);
}

/// What is looked up in sets is what the records say.
#[test]
fn open_tasks_are_found_without_looking_at_all() {
    let check = |coordinator: &Coordinator| {
        let tasks = &coordinator.tasks;
        let those = |is: &dyn Fn(&TaskRecord) -> bool| -> Vec<TaskId> {
            tasks.records.values().filter(|record| is(record)).map(|record| record.id).collect()
        };
        let sets = [&tasks.open, &tasks.queued, &tasks.movable].map(|set| set.iter().copied().collect::<Vec<_>>());
        let is_open = |record: &TaskRecord| !record.state.is_final();
        assert_eq!(sets[0], those(&is_open));
        assert_eq!(sets[1], those(&|record| record.state == TaskState::Queued));
        assert_eq!(sets[2], those(&|record| is_open(record) && !matches!(record.assign, Assign::Robot(_))));
    };
    let mut coordinator = running(&[]);
    coordinator.keep_records(Vec::new(), TaskId(0), Robots::New);
    let east = names(&coordinator)[0].clone();
    coordinator.tell_places(vec![place([0.0, 1.0], None), place([0.0, 2.0], None)]);
    coordinator.request(&batch(Assign::Nearest, &[[0.0, 1.0], [0.0, 1.2]]), FREE_PLACE);
    coordinator.kept(TaskId(0), Ok(()));
    check(&coordinator);
    coordinator.request(&task(&east, [0.0, 1.0]), FREE_PLACE);
    check(&coordinator);
    coordinator.kept(TaskId(2), Err("no".to_owned()));
    check(&coordinator);
    assert_eq!(coordinator.unanswered(), 2);
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    check(&coordinator);
    step(&mut coordinator, 0, TaskStep::Dropped(TaskEnd::RobotGone));
    check(&coordinator);
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    step(&mut coordinator, 0, TaskStep::Done);
    answer(&mut coordinator, Ticket::Task(TaskId(1)), Some("no"));
    check(&coordinator);
    assert!(coordinator.tasks.open.is_empty() && !coordinator.wants_places());
    // What a daemon before this one has left.
    let known = list(&mut coordinator, all());
    let mut open = known[0].clone();
    (open.id, open.state) = (TaskId(7), TaskState::Active);
    let mut next = running(&[]);
    next.keep_records(known.into_iter().chain([open]).collect(), TaskId(8), Robots::New);
    check(&next);
    assert!(next.wants_places());
}

#[test]
fn a_chosen_robot_that_is_gone_is_replaced() {
    let mut coordinator = running(&[]);
    let robots = names(&coordinator);
    coordinator.tell_places(vec![place([0.0, 1.0], None), place([0.0, 2.0], None)]);
    coordinator.request(&batch(Assign::Nearest, &[[0.0, 1.0]]), FREE_PLACE);
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    coordinator.take_actions();
    step(&mut coordinator, 0, TaskStep::Dropped(TaskEnd::RobotGone));
    assert_eq!(orders(&coordinator.take_actions()), [(0, 1)]);
    let record = list(&mut coordinator, all()).remove(0);
    assert_eq!((record.state, &record.robot), (TaskState::Queued, &robots[1]));
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    assert_eq!(states(&mut coordinator), [TaskState::Assigned]);
    // The next one has gone before the order has come.
    let both = || vec![place([0.0, 1.0], None), place([0.0, 2.0], None)];
    coordinator.tell_places(both());
    step(&mut coordinator, 0, TaskStep::Dropped(TaskEnd::RobotGone));
    assert_eq!(orders(&coordinator.take_actions()), [(0, 0)]);
    coordinator.tell_places(both());
    answer(&mut coordinator, Ticket::Task(TaskId(0)), Some(world_sim::ROBOT_GONE));
    assert_eq!(orders(&coordinator.take_actions()), [(0, 1)]);
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    // No other one is left.
    coordinator.tell_places(vec![None, None]);
    step(&mut coordinator, 0, TaskStep::Dropped(TaskEnd::RobotGone));
    let record = list(&mut coordinator, all()).remove(0);
    assert_eq!(record.state, TaskState::Failed);
    assert!(record.steps.last().unwrap().reason.contains("no robot can take a task"), "{record:?}");
}

#[test]
fn a_task_that_a_robot_does_not_get_to_goes_to_each_other_one_once() {
    let mut coordinator = running(&[]);
    let robots = names(&coordinator);
    coordinator.request(&task(&robots[0], [0.0, 1.0]), FREE_PLACE);
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    step(&mut coordinator, 0, TaskStep::Dropped(TaskEnd::Unreachable));
    let found = list(&mut coordinator, all());
    assert_eq!(found[0].state, TaskState::Failed, "its sender wanted this robot");
    assert_eq!(found[0].steps.last().unwrap().reason, format!("robot `{}` does not get there", robots[0]));

    let places = || vec![place([0.0, 1.0], None), place([0.0, 2.0], None)];
    coordinator.tell_places(places());
    coordinator.request(&batch(Assign::Nearest, &[[0.0, 1.0]]), FREE_PLACE);
    answer(&mut coordinator, Ticket::Task(TaskId(1)), None);
    coordinator.take_actions();
    for next in [vec![(1, 1)], vec![]] {
        coordinator.tell_places(places());
        step(&mut coordinator, 1, TaskStep::Dropped(TaskEnd::Unreachable));
        assert_eq!(orders(&coordinator.take_actions()), next);
        answer(&mut coordinator, Ticket::Task(TaskId(1)), None);
    }
    assert_eq!(states(&mut coordinator)[1], TaskState::Failed);
}

#[test]
fn cancelling_is_up_to_the_world() {
    let mut coordinator = running(&[]);
    let east = names(&coordinator)[0].clone();
    let cancel = |name: &str| Request::Cancel(name.to_owned());
    coordinator.request(&keyed(&east, [0.0, 1.0], "a"), FREE_PLACE);
    assert!(refusal(coordinator.request(&cancel("a"), FREE_PLACE)).contains("not confirmed yet"));
    answer(&mut coordinator, Ticket::Task(TaskId(0)), None);
    replies(&mut coordinator);
    assert!(refusal(coordinator.request(&cancel("7"), FREE_PLACE)).contains("unknown task `7`"));
    let ticket = Ticket::Cancel(TaskId(0));
    assert_eq!(coordinator.request(&cancel("a"), FREE_PLACE), Answer::Later(ticket));
    assert_eq!(coordinator.take_actions(), [Action::Order(Order::Cancel { id: TaskId(0), index: RobotIndex(0) })]);
    assert!(refusal(coordinator.request(&cancel("0"), FREE_PLACE)).contains("being cancelled already"));
    step(&mut coordinator, 0, TaskStep::Dropped(TaskEnd::Cancelled));
    answer(&mut coordinator, ticket, None);
    assert_eq!(replies(&mut coordinator), [(ticket, format!("task 0 of {east}: cancelled"))]);
    assert!(refusal(coordinator.request(&cancel("0"), FREE_PLACE)).contains("is cancelled already"));

    // The world may have come first.
    coordinator.request(&task(&east, [0.0, 1.0]), FREE_PLACE);
    answer(&mut coordinator, Ticket::Task(TaskId(1)), None);
    coordinator.request(&cancel("1"), FREE_PLACE);
    step(&mut coordinator, 1, TaskStep::Done);
    replies(&mut coordinator);
    answer(&mut coordinator, Ticket::Cancel(TaskId(1)), Some(world_sim::NOT_ITS_TASK));
    assert!(replies(&mut coordinator)[0].1.contains("does not have this task"));
    assert_eq!(states(&mut coordinator)[1], TaskState::Done);
}

#[test]
fn a_list_is_what_was_asked_for() {
    let mut coordinator = running(&[]);
    let robots = names(&coordinator);
    for robot in [&robots[0], &robots[1], &robots[0]] {
        coordinator.request(&task(robot, [0.0, 1.0]), FREE_PLACE);
    }
    step(&mut coordinator, 0, TaskStep::Done);
    let ids = |coordinator: &mut Coordinator, filter: TaskFilter| -> Vec<u32> {
        list(coordinator, filter).iter().map(|record| record.id.0).collect()
    };
    assert_eq!(ids(&mut coordinator, all()), [0, 1, 2]);
    assert_eq!(ids(&mut coordinator, TaskFilter { newest: 2, ..all() }), [1, 2]);
    assert_eq!(ids(&mut coordinator, TaskFilter { robot: Some(robots[0].clone()), ..all() }), [0, 2]);
    assert_eq!(ids(&mut coordinator, TaskFilter { states: vec![TaskState::Done], ..all() }), [0]);
    assert_eq!(ids(&mut coordinator, TaskFilter { which: vec!["2".to_owned(), "0".to_owned()], ..all() }), [0, 2]);
    let unknown = TaskFilter { which: vec!["2".to_owned(), "x\u{1b}".to_owned()], ..all() };
    assert_eq!(refusal(coordinator.request(&Request::Tasks(unknown), FREE_PLACE)), "unknown task `x\\u{1b}`");
}

#[test]
fn what_is_remembered_is_bounded() {
    let mut coordinator = running(&[]);
    let east = names(&coordinator)[0].clone();
    for id in 0..ENDED_MAX as u32 + 5 {
        coordinator.request(&keyed(&east, [0.0, 1.0], &format!("k{id}")), FREE_PLACE);
        step(&mut coordinator, id, TaskStep::Done);
    }
    assert_eq!((coordinator.tasks.records.len(), coordinator.tasks.keys.len()), (ENDED_MAX, ENDED_MAX));
    assert_eq!(list(&mut coordinator, all())[0].id, TaskId(5));
    // Those that are open are refused at the bound, not forgotten.
    coordinator.take_actions();
    for id in 0..OPEN_MAX as u32 {
        coordinator.request(&task(&east, [0.0, 1.0]), FREE_PLACE);
        answer(&mut coordinator, Ticket::Task(TaskId(ENDED_MAX as u32 + 5 + id)), None);
    }
    assert!(refusal(coordinator.request(&task(&east, [0.0, 1.0]), FREE_PLACE)).contains("of at most 10000"));
    pass(&mut coordinator, 1..=2, ALL_READY);
}
