use super::super::tests::{
    ALL_READY, FREE_PLACE, add, answer, died, instance, killed, pass, refusal, replies, running, task,
};
use super::super::{Answer, Place};
use super::*;
use model::{Event, EventKind, ProcessState, Task, TaskEnd, TaskId, TaskState, TaskStep};
use protocol::operator_to_daemon::{Assign, NewTasks, Request, TaskFilter};
use protocol::world_to_daemon::Notice;
use std::time::Duration;

fn remove(robot: &str) -> Request {
    Request::Remove { robot: robot.to_owned() }
}

/// The robot in a slot leaves, as an operator wants it, and its process ends.
fn gone(coordinator: &mut Coordinator, slot: u32, incarnation: u32) {
    let (who, name) = (instance(slot, incarnation), coordinator.name(RobotIndex(slot)).to_owned());
    assert!(matches!(coordinator.request(&remove(&name), FREE_PLACE), Answer::Later(_)));
    coordinator.notice(Notice::Left { instance: who });
    answer(coordinator, Ticket::Remove(who.index), None);
    coordinator.exited(who, super::super::Ending { signal: None, code: Some(0) }, None, None);
    coordinator.take_actions();
}

fn admitted(coordinator: &mut Coordinator) -> Vec<RobotInstance> {
    let actions = coordinator.take_actions().into_iter();
    actions
        .filter_map(
            |action| if let Action::Order(Order::Admit { instance, .. }) = action { Some(instance) } else { None },
        )
        .collect()
}

fn restart(robot: &str) -> Request {
    Request::Restart { robot: robot.to_owned() }
}

/// A process is on its way, the world has admitted its robot, and it has entered.
fn entered(coordinator: &mut Coordinator, who: RobotInstance, ticket: Ticket) {
    coordinator.spawned(who, 300 + who.incarnation, Duration::ZERO);
    answer(coordinator, ticket, None);
    coordinator.notice(Notice::Expect { instance: who, tick: 7 });
    coordinator.notice(Notice::Entered { instance: who, tick: 7 });
}

#[test]
fn an_operator_is_answered_when_a_newcomer_and_its_neighbours_hear_each_other() {
    let mut coordinator = running(&["fleet.max_robots=5"]);
    let (who, ticket) = (instance(2, 0), Ticket::Admit(instance(2, 0)));
    coordinator.request(&add("north", [0.0, -2.0]), FREE_PLACE);
    pass(&mut coordinator, 10..=10, ALL_READY);
    assert!(!coordinator.awaits_newcomers());
    entered(&mut coordinator, who, ticket);
    assert_eq!((coordinator.newcomers(), coordinator.awaits_newcomers()), (vec![(who, 7)], true));
    assert_eq!(replies(&mut coordinator), []);
    coordinator.joined(instance(2, 1), 2, Duration::from_millis(10_020));
    assert_eq!(replies(&mut coordinator), [], "that is another life");
    coordinator.joined(who, 2, Duration::from_millis(10_040));
    coordinator.joined(who, 2, Duration::from_millis(10_041));
    assert_eq!(replies(&mut coordinator), [(ticket, "north joined as 2.0 after 40 ms with 2".to_owned())]);
    assert!(!coordinator.awaits_newcomers());

    // Not for ever; and what is known is said.
    for (id, slot, event) in [("south", 3, false), ("west-2", 4, true)] {
        let (who, ticket) = (instance(slot, 0), Ticket::Admit(instance(slot, 0)));
        coordinator.request(&add(id, [0.0, -f64::from(slot)]), FREE_PLACE);
        pass(&mut coordinator, 11..=11, ALL_READY);
        if event {
            let kind = EventKind::NotStarted { why: "no room".to_owned() };
            answer(&mut coordinator, ticket, None);
            coordinator.notice(Notice::Log(Event { tick: 8, robot: Some(who.index), kind }));
        } else {
            entered(&mut coordinator, who, ticket);
        }
        pass(&mut coordinator, 12..=14, ALL_READY);
        assert_eq!(replies(&mut coordinator), []);
        pass(&mut coordinator, 15..=15, ALL_READY);
        let said = replies(&mut coordinator);
        let words = if event { "not in the world after 3 s: no room" } else { "not all its neighbours heard it" };
        assert!(said.len() == 1 && said[0].0 == ticket && said[0].1.contains(words), "{said:?}");
        assert!(!coordinator.awaits_newcomers());
    }
}

#[test]
fn who_waits_for_a_newcomer_that_leaves_is_told() {
    let mut coordinator = running(&["fleet.max_robots=3"]);
    let (who, ticket) = (instance(2, 0), Ticket::Admit(instance(2, 0)));
    coordinator.request(&add("north", [0.0, -2.0]), FREE_PLACE);
    entered(&mut coordinator, who, ticket);
    coordinator.notice(Notice::Left { instance: who });
    let expected = "robot `north`: not confirmed: it left before it was known that it had joined".to_owned();
    assert_eq!(replies(&mut coordinator), [(ticket, expected)]);
}

#[test]
fn a_robot_gets_a_new_process() {
    let mut coordinator = running(&["fleet.max_robots=3"]);
    let ticket = Ticket::Restart(RobotIndex(0));
    assert_eq!(coordinator.request(&restart("east"), FREE_PLACE), Answer::Later(ticket));
    assert_eq!(coordinator.take_actions(), [Action::Order(Order::Restart { index: RobotIndex(0) })]);
    assert_eq!(refusal(coordinator.request(&restart("east"), FREE_PLACE)), "robot `east` is being started already");
    pass(&mut coordinator, 10..=10, ALL_READY);
    // What the present life does until then is not what the operator waits for.
    coordinator.notice(Notice::Entered { instance: instance(0, 0), tick: 4 });
    coordinator.notice(Notice::Kill { instance: instance(0, 0) });
    answer(&mut coordinator, ticket, None);
    coordinator.notice(Notice::Expect { instance: instance(0, 1), tick: 6 });
    coordinator.exited(instance(0, 0), killed(), None, None);
    assert_eq!(coordinator.newcomers(), []);
    assert_eq!(refusal(coordinator.request(&restart("east"), FREE_PLACE)), "robot `east` is being started already");
    coordinator.take_actions();
    coordinator.spawned(instance(0, 1), 200, Duration::ZERO);
    coordinator.notice(Notice::Entered { instance: instance(0, 1), tick: 6 });
    coordinator.joined(instance(0, 1), 1, Duration::from_millis(10_050));
    assert_eq!(replies(&mut coordinator), [(ticket, "east joined as 0.1 after 50 ms with 1".to_owned())]);
    assert_eq!(coordinator.members()[0].restarts(), 1);

    gone(&mut coordinator, 0, 1);
    assert_eq!(refusal(coordinator.request(&restart("east"), FREE_PLACE)), "robot `east` has left");
    coordinator.request(&add("east", [0.0, -2.0]), FREE_PLACE);
    assert_eq!(coordinator.members()[0].restarts(), 0, "it is another robot");
    assert_eq!(refusal(coordinator.request(&restart("nobody"), FREE_PLACE)), "unknown robot `nobody`");
}

#[test]
fn a_robot_leaves_when_the_world_lets_it_go() {
    let mut coordinator = running(&[]);
    let ticket = Ticket::Remove(RobotIndex(0));
    assert_eq!(refusal(coordinator.request(&remove("nobody"), FREE_PLACE)), "unknown robot `nobody`");
    assert_eq!(coordinator.request(&remove("east"), FREE_PLACE), Answer::Later(ticket));
    assert_eq!(coordinator.take_actions(), [Action::Order(Order::Remove { index: RobotIndex(0) })]);
    assert_eq!(refusal(coordinator.request(&remove("east"), FREE_PLACE)), "robot `east` is leaving already");
    assert_eq!(refusal(coordinator.request(&task("east", [0.0, 1.0]), FREE_PLACE)), "robot `east` is leaving");
    assert_eq!(replies(&mut coordinator), [], "the world has not said so");
    coordinator.notice(Notice::Left { instance: instance(0, 0) });
    answer(&mut coordinator, ticket, None);
    assert_eq!(replies(&mut coordinator), [(ticket, "east has left".to_owned())]);
    assert_eq!(refusal(coordinator.request(&remove("east"), FREE_PLACE)), "robot `east` has left already");
    assert_eq!(refusal(coordinator.request(&task("east", [0.0, 1.0]), FREE_PLACE)), "robot `east` has left");
    // Its process ends by itself, which is no news for the world.
    coordinator.exited(instance(0, 0), super::super::Ending { signal: None, code: Some(0) }, None, None);
    assert_eq!(coordinator.take_actions(), []);
    // A world that refuses: the robot stays.
    let ticket = Ticket::Remove(RobotIndex(1));
    coordinator.request(&remove("west"), FREE_PLACE);
    coordinator.take_actions();
    answer(&mut coordinator, ticket, Some("no"));
    assert_eq!(replies(&mut coordinator), [(ticket, "robot `west`: no".to_owned())]);
    assert_eq!(coordinator.request(&remove("west"), FREE_PLACE), Answer::Later(ticket));
}

#[test]
fn a_name_that_is_free_again_comes_with_its_slot_and_goes_on_counting_lives() {
    let mut coordinator = running(&["fleet.max_robots=3"]);
    let words = refusal(coordinator.request(&add("east", [0.0, -2.0]), FREE_PLACE));
    assert!(words.contains("taken"), "{words}");
    coordinator.exited(instance(0, 0), killed(), None, None);
    coordinator.notice(Notice::Expect { instance: instance(0, 1), tick: 3 });
    coordinator.spawned(instance(0, 1), 200, Duration::ZERO);
    coordinator.take_actions();
    gone(&mut coordinator, 0, 1);
    assert_eq!(
        coordinator.request(&add("east", [0.0, -2.0]), FREE_PLACE),
        Answer::Later(Ticket::Admit(instance(0, 2)))
    );
    let actions = coordinator.take_actions();
    assert!(
        matches!(&actions[0], Action::Order(Order::Admit { instance: new, robot }) if *new == instance(0, 2) && robot.start.y == -2.0)
    );
    assert_eq!(actions[1..], [Action::Spawn(instance(0, 2))]);
    assert_eq!((coordinator.members().len(), coordinator.scenario().robots.len()), (2, 2));
    assert_eq!(coordinator.scenario().robots[0].start.y, -2.0, "its spec is that of the new robot");
    let words = refusal(coordinator.request(&add("east", [0.0, -2.0]), FREE_PLACE));
    assert!(words.contains("taken"), "{words}");

    // A new name has a new slot while there is one; a robot without a name then takes what is free.
    gone(&mut coordinator, 1, 0);
    coordinator.request(&add("north", [0.0, -3.0]), FREE_PLACE);
    assert_eq!(admitted(&mut coordinator), [instance(2, 0)]);
    match coordinator.request(&add("south", [0.0, -4.0]), FREE_PLACE) {
        Answer::Now(Reply::Refused { problem, hint: Some(hint) }) => {
            assert_eq!((problem.as_str(), hint.contains("west")), ("the fleet is full: 3 robots", true), "{hint}");
        }
        other => panic!("{other:?}"),
    }
    let Request::Add(mut new) = add("", [0.0, -4.0]) else { unreachable!() };
    new.id = None;
    coordinator.request(&Request::Add(new), FREE_PLACE);
    assert_eq!(admitted(&mut coordinator), [instance(1, 1)]);
    assert_eq!(coordinator.name(RobotIndex(1)), "west");
}

#[test]
fn the_next_robot_waits_for_the_process_of_the_one_before() {
    let mut coordinator = running(&[]);
    coordinator.request(&remove("east"), FREE_PLACE);
    coordinator.notice(Notice::Left { instance: instance(0, 0) });
    answer(&mut coordinator, Ticket::Remove(RobotIndex(0)), None);
    coordinator.take_actions();
    coordinator.request(&add("east", [0.0, -2.0]), FREE_PLACE);
    let actions = coordinator.take_actions();
    assert!(
        matches!(&actions[..], [Action::Order(Order::Admit { .. }), Action::Signal(old, Signal::Kill)] if *old == instance(0, 0))
    );
    coordinator.notice(Notice::Expect { instance: instance(0, 1), tick: 3 });
    coordinator.take_actions();
    coordinator.exited(instance(0, 0), killed(), None, None);
    let actions = coordinator.take_actions();
    assert_eq!(
        actions,
        [died(instance(0, 0)), Action::Spawn(instance(0, 1))],
        "of an older life the world takes no notice"
    );
    assert_eq!(coordinator.members()[0].state, ProcessState::Starting);
}

#[test]
fn a_robot_that_is_refused_after_its_process_was_started_leaves_its_lives_behind() {
    let mut coordinator = running(&["fleet.max_robots=3"]);
    coordinator.request(&add("north", [0.0, -2.0]), FREE_PLACE);
    coordinator.take_actions();
    coordinator.spawned(instance(2, 0), 300, Duration::ZERO);
    answer(&mut coordinator, Ticket::Admit(instance(2, 0)), Some("no"));
    let actions = coordinator.take_actions();
    assert!(actions.contains(&Action::Signal(instance(2, 0), Signal::Kill)), "{actions:?}");
    coordinator.exited(instance(2, 0), killed(), None, None);
    coordinator.take_actions();
    coordinator.request(&add("north", [0.0, -2.0]), FREE_PLACE);
    assert_eq!(admitted(&mut coordinator), [instance(2, 1)], "no life is lived twice");
}

#[test]
fn tasks_of_a_robot_that_leaves_go_to_others_or_are_reported() {
    let mut coordinator = running(&[]);
    let place = |x_m| Some(Place { at_m: [x_m, 0.0], goal_m: None, says_left_m: None });
    coordinator.tell_places(vec![place(1.0), place(-1.0)]);
    let nearest =
        |x_m: f64| Request::Task(NewTasks { assign: Assign::Nearest, tasks: vec![Task::to([x_m, 0.5])], key: None });
    coordinator.request(&nearest(1.0), FREE_PLACE);
    coordinator.request(&task("east", [1.0, 1.0]), FREE_PLACE);
    for id in [0, 1] {
        answer(&mut coordinator, Ticket::Task(TaskId(id)), None);
    }
    // One that is under way to the robot when it goes is refused by the world.
    coordinator.request(&nearest(1.2), FREE_PLACE);
    coordinator.request(&remove("east"), FREE_PLACE);
    coordinator.request(&nearest(1.1), FREE_PLACE);
    let indices = |coordinator: &mut Coordinator| {
        let actions = coordinator.take_actions().into_iter();
        let tasks = actions.filter_map(|action| match action {
            Action::Order(Order::Task { id, index, .. }) => Some((id.0, index.0)),
            _ => None,
        });
        tasks.collect::<Vec<_>>()
    };
    assert_eq!(indices(&mut coordinator), [(0, 0), (1, 0), (2, 0), (3, 1)], "nobody gives a robot a task that leaves");
    for id in [0, 1] {
        coordinator.notice(Notice::Task { id: TaskId(id), step: TaskStep::Dropped(TaskEnd::RobotGone) });
    }
    coordinator.notice(Notice::Left { instance: instance(0, 0) });
    answer(&mut coordinator, Ticket::Remove(RobotIndex(0)), None);
    answer(&mut coordinator, Ticket::Task(TaskId(2)), Some(world_sim::ROBOT_GONE));
    assert_eq!(indices(&mut coordinator), [(0, 1), (2, 1)]);
    let filter = TaskFilter { newest: 9, ..TaskFilter::default() };
    let Answer::Now(Reply::Tasks(records)) = coordinator.request(&Request::Tasks(filter), FREE_PLACE) else { panic!() };
    let states: Vec<(&str, TaskState)> = records.iter().map(|record| (record.robot.as_str(), record.state)).collect();
    let queued = TaskState::Queued;
    assert_eq!(states, [("west", queued), ("east", TaskState::Failed), ("west", queued), ("west", queued)]);
}
