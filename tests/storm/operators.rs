//! Operators: what they ask for, what they are answered, and whether that was true.

use daemon::coordinator::Coordinator;
use model::{Event, EventKind, GoalSource, RobotIndex, RobotInstance, TaskId, TaskState};
use protocol::daemon_to_world::Ticket;
use protocol::operator_to_daemon::{Reply, Request, TaskRecord};
use std::collections::VecDeque;
use world_sim::World;

struct Asked {
    request: Request,
    answers: Vec<(Option<Ticket>, Reply)>,
}

#[derive(Default)]
pub(crate) struct Operators {
    asked: Vec<Asked>,
    /// Requests that the daemon has not taken, by number.
    queue: VecDeque<usize>,
}

/// What operators were answered.
#[derive(Default)]
pub(crate) struct Answers {
    pub(crate) tasks: u64,
    pub(crate) cancelled: u64,
    pub(crate) robots: u64,
    pub(crate) removed: u64,
    pub(crate) restarted: u64,
    pub(crate) faults: u64,
    pub(crate) paces: u64,
    pub(crate) refused: u64,
    pub(crate) unconfirmed: u64,
}

impl Operators {
    pub(crate) fn ask(&mut self, request: Request) {
        self.queue.push_back(self.asked.len());
        self.asked.push(Asked { request, answers: Vec::new() });
    }

    pub(crate) fn take(&mut self) -> Option<(usize, Request)> {
        let number = self.queue.pop_front()?;
        Some((number, self.asked[number].request.clone()))
    }

    pub(crate) fn answer(&mut self, number: usize, ticket: Option<Ticket>, reply: Reply) {
        let asked = &mut self.asked[number];
        asked.answers.push((ticket, reply));
        assert!(asked.answers.len() == 1, "{:?} was answered more than once: {:?}", asked.request, asked.answers);
    }

    /// When all is over: every request has one answer, and what was acknowledged is in the world.
    pub(crate) fn check(&self, world: &World, coordinator: &Coordinator) -> Answers {
        let mut answers = Answers::default();
        // A log that is full does not say of everything whether it happened.
        let went_back = world.events().iter().any(|event| matches!(event.kind, EventKind::WorldRestarted { .. }));
        let is_whole = world.outcome().events_lost == 0 && !went_back;
        for asked in &self.asked {
            let [(ticket, reply)] = &asked.answers[..] else {
                panic!("{:?} was answered {} times", asked.request, asked.answers.len());
            };
            match (reply, ticket) {
                (Reply::Tasked(records), _) => {
                    for TaskRecord { id: TaskId(task), .. } in records {
                        let taken = taken(world.events(), *task);
                        assert!(taken == 1 || taken == 0 && !is_whole, "task {task} was acknowledged");
                        answers.tasks += 1;
                    }
                }
                (Reply::Joined { robot, index, incarnation, .. }, _) => {
                    let there = world.robot(index.at()).map(|robot| robot.id.as_str());
                    assert!(there == Some(robot.as_str()) || went_back, "robot {robot} was added");
                    assert_eq!(coordinator.name(*index), robot, "the coordinator knows it as well");
                    let entered = |event: &Event| match event.kind {
                        EventKind::Joined { incarnation: of } | EventKind::Restarted { incarnation: of } => {
                            of == *incarnation && event.robot == Some(*index)
                        }
                        _ => false,
                    };
                    let entered = world.events().iter().filter(|event| entered(event)).count();
                    assert!(entered == 1 || !is_whole, "robot {robot} entered as {incarnation} {entered} times");
                    match ticket {
                        Some(Ticket::Restart(_)) => answers.restarted += 1,
                        _ => answers.robots += 1,
                    }
                }
                (Reply::Removed { robot }, Some(Ticket::Remove(RobotIndex(slot)))) => {
                    let left =
                        |event: &Event| event.robot == Some(RobotIndex(*slot)) && matches!(event.kind, EventKind::Left);
                    assert!(world.events().iter().any(left) || !is_whole, "robot {robot} was removed");
                    assert_eq!(coordinator.name(RobotIndex(*slot)), robot);
                    answers.removed += 1;
                }
                (Reply::Injected { .. }, Some(Ticket::Fault(_))) => answers.faults += 1,
                (Reply::Pace(_), Some(Ticket::Pace(_))) => answers.paces += 1,
                (Reply::Unconfirmed { .. }, Some(_)) => answers.unconfirmed += 1,
                (Reply::Refused { problem, .. }, ticket) => {
                    answers.refused += 1;
                    match ticket {
                        Some(Ticket::Task(TaskId(task))) => {
                            assert_eq!(taken(world.events(), *task), 0, "task {task} was refused: {problem}");
                        }
                        Some(Ticket::Admit(RobotInstance { index, incarnation })) => {
                            let known = world.state(index.at()).map(|(instance, _)| instance.incarnation);
                            let is_there = known == Some(*incarnation) && world.robot(index.at()).is_some();
                            let joined = |event: &Event| {
                                let kind = EventKind::Joined { incarnation: *incarnation };
                                event.robot == Some(*index) && event.kind == kind
                            };
                            let is_there = is_there || world.events().iter().any(joined);
                            assert!(!is_there, "{index} {incarnation} was refused: {problem}");
                        }
                        // The task may have been done, or dropped, before.
                        Some(Ticket::Cancel(_) | Ticket::Fault(_) | Ticket::Remove(_) | Ticket::Restart(_)) => {}
                        Some(Ticket::Pace(_)) | None => {}
                    }
                }
                (Reply::Tasks(records), Some(Ticket::Cancel(id))) => {
                    let [TaskRecord { id: cancelled, state: TaskState::Cancelled, .. }] = &records[..] else {
                        panic!("{:?}: {records:?}", asked.request);
                    };
                    assert_eq!(cancelled, id);
                    answers.cancelled += 1;
                }
                (reply, ticket) => panic!("{:?}: {ticket:?}, {reply:?}", asked.request),
            }
        }
        answers
    }
}

/// How often a robot was given this task.
fn taken(events: &[Event], task: u32) -> usize {
    let given = |event: &&Event| matches!(event.kind, EventKind::Task { source: GoalSource::Operator(TaskId(id)), .. } if id == task);
    events.iter().filter(given).count()
}
