//! Which robot does a task: the one that is named, or one that a rule chooses; and another one when that robot is gone.

use super::super::{Coordinator, Refusal, refused};
use crate::assign::{self, Candidate};
use model::{ProcessState, Task, TaskId, TaskState, TaskStep};
use protocol::operator_to_daemon::Assign;
use protocol::world_to_daemon::Notice;

/// Where a robot is, and where it is going.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Position, m.
    pub at_m: [f64; 2],
    /// The goal that it heads for, m; `None` if it has arrived.
    pub goal_m: Option<[f64; 2]>,
    /// The distance to that goal that the robot itself has published on its board, m. `None` if its board was not read.
    pub says_left_m: Option<f64>,
}

impl Coordinator {
    /// Whether there are tasks that may have to be given to other robots, so that [`Coordinator::tell_places`] is wanted.
    pub fn wants_places(&self) -> bool {
        !self.tasks.movable.is_empty()
    }

    /// Whether a task is put up for auction again because of this notice: then [`Coordinator::tell_places`] is wanted before
    /// it, with what the boards of the robots say.
    pub fn wants_bids(&self, notice: &Notice) -> bool {
        let Notice::Task { id, step: TaskStep::Dropped(why) } = notice else { return false };
        why.is_for_another() && self.tasks.records.get(id).is_some_and(|record| record.assign == Assign::Auction)
    }

    /// Where the robots are, by slot; `None` for one that is not in the world.
    pub fn tell_places(&mut self, places: Vec<Option<Place>>) {
        self.tasks.places = places;
    }

    /// Robots that may be given tasks without being named, with what they have to do. In an auction the distance to the
    /// present goal is what the robot itself says; one that says nothing, or whose process stands still, makes no bid.
    fn candidates(&self, assign: &Assign) -> (Vec<usize>, Vec<Candidate>) {
        let is_auction = *assign == Assign::Auction;
        let works = |slot: usize| match self.members.get(slot).map(|member| member.state) {
            Some(ProcessState::Running) => true,
            Some(ProcessState::Paused | ProcessState::Stopped) => !is_auction,
            _ => false,
        };
        let works = |slot: usize| works(slot) && !self.members[slot].leaving;
        let slots = (0..self.scenario.robots.len()).filter(|slot| works(*slot));
        let placed = slots.filter_map(|slot| Some((slot, self.tasks.places.get(slot).copied().flatten()?)));
        let of = |(slot, place): (usize, Place)| {
            let mut candidate = Candidate { ends_m: place.at_m, left_m: 0.0 };
            if let Some(goal_m) = place.goal_m {
                candidate.take(goal_m);
            }
            if is_auction {
                candidate.left_m = place.says_left_m.filter(|left_m| *left_m >= 0.0)?;
            }
            let name = &self.scenario.robots[slot].id;
            let open = self.tasks.open.iter().filter_map(|id| self.tasks.records.get(id));
            let waiting = open.filter(|record| record.robot == *name);
            let waiting = waiting.filter(|record| matches!(record.state, TaskState::Queued | TaskState::Assigned));
            waiting.for_each(|record| candidate.take(record.task.goal.into()));
            Some((slot, candidate))
        };
        placed.filter_map(of).unzip()
    }

    /// The slots of those who are to do these tasks, or why there are none.
    pub(super) fn assigned(&self, assign: &Assign, tasks: &[Task]) -> Result<Vec<usize>, Refusal> {
        let robots = &self.scenario.robots;
        let problem_of =
            |slot: usize, task: &Task| scenarios::goal_problem(&self.scenario, &robots[slot], task.goal, task.yaw_rad);
        let place = "choose a goal in free space inside the world; only unicycles and diff-drives have a heading there";
        let (slots, candidates) = match assign {
            Assign::Robot(name) => {
                let slot = self.slot_of(name)?;
                if let Some(problem) = tasks.iter().find_map(|task| problem_of(slot, task)) {
                    return Err(refused(&problem, Some(place)));
                }
                if self.members[slot].state == ProcessState::Left {
                    return Err(refused(
                        &format!("robot `{name}` has left"),
                        Some("`shoal ps` shows the robots; `--assign nearest` chooses one"),
                    ));
                }
                if self.members[slot].leaving {
                    return Err(refused(
                        &format!("robot `{name}` is leaving"),
                        Some("`shoal ps` shows the robots; `--assign nearest` chooses one"),
                    ));
                }
                return Ok(vec![slot; tasks.len()]);
            }
            Assign::Nearest | Assign::Optimal | Assign::Auction => self.candidates(assign),
        };
        if candidates.is_empty() {
            let problem = match assign {
                Assign::Auction => "no robot makes a bid",
                _ => "no robot can take a task",
            };
            return Err(refused(problem, Some("`shoal ps` shows the robots and their states")));
        }
        let goals_m: Vec<[f64; 2]> = tasks.iter().map(|task| task.goal.into()).collect();
        let able: Vec<Vec<bool>> =
            (slots.iter()).map(|slot| tasks.iter().map(|task| problem_of(*slot, task).is_none()).collect()).collect();
        let may: &assign::May<'_> = &|robot, goal| able[robot][goal];
        let chosen = match assign {
            Assign::Nearest => assign::nearest(candidates, &goals_m, may),
            Assign::Auction => assign::auction(candidates, &goals_m, may),
            _ => assign::optimal(candidates, &goals_m, may),
        };
        let slot_of = |(goal, robot): (usize, Option<usize>)| {
            let why = || problem_of(slots[0], &tasks[goal]).unwrap_or_else(|| "no robot can go there".to_owned());
            robot.map(|robot| slots[robot]).ok_or_else(|| refused(&why(), Some(place)))
        };
        chosen.into_iter().enumerate().map(slot_of).collect()
    }

    /// No robot is given a task again that did not get there.
    pub(super) fn reassign_unreachable(&mut self, id: TaskId) {
        let Some(record) = self.tasks.records.get(&id) else { return };
        let had = |name: &String| record.steps.iter().any(|step| step.robot == *name);
        for (robot, place) in self.scenario.robots.iter().zip(&mut self.tasks.places) {
            if had(&robot.id) {
                *place = None;
            }
        }
        let why = format!("robot `{}` does not get there", record.robot);
        self.reassign(id, TaskState::Failed, &why);
    }

    /// The robot of a task does not do it: another one gets it, unless its sender wanted this one, or there is none; then it
    /// ends in this state.
    pub(super) fn reassign(&mut self, id: TaskId, end: TaskState, why: &str) {
        let Some(record) = self.tasks.records.get(&id) else { return };
        let (assign, task, before) = (record.assign.clone(), record.task, record.robot.clone());
        if let Assign::Robot(_) = assign {
            return self.change(id, end, why);
        }
        if let Some(place) = self.scenario.robots.iter().position(|robot| robot.id == before)
            && let Some(place) = self.tasks.places.get_mut(place)
        {
            *place = None;
        }
        match self.assigned(&assign, &[task]) {
            Ok(slots) => {
                let robot = self.scenario.robots[slots[0]].id.clone();
                if let Some(record) = self.tasks.records.get_mut(&id) {
                    record.robot = robot;
                }
                self.change(id, TaskState::Queued, &format!("{why}: given to another one"));
                self.order_task(id);
            }
            Err(refusal) => self.change(id, end, &format!("{why}, and {}", refusal.problem)),
        }
    }
}
