//! Robots that come and go while the fleet runs.
//!
//! A slot belongs to a name. A name is free again when its robot has left, and with it comes the slot: the robot that takes
//! them goes on counting lives where the one before ended, so that no instance is there twice.

use super::operators::{Owed, Refusal, Waiting, refused, shown};
use super::{Action, Coordinator, Member, Signal};
use model::{BodyKind, ParamValues, ProcessState, RobotIndex, RobotInstance};
use protocol::daemon_to_world::{Order, Ticket};
use protocol::operator_to_daemon::{NewRobot, Reply};

impl Coordinator {
    /// One more robot. Its process is started while the world still decides.
    pub(super) fn add(
        &mut self,
        new: &NewRobot,
        near: &dyn Fn([f64; 2], f64) -> Option<RobotIndex>,
    ) -> Result<Waiting, Refusal> {
        let (index, id) = self.place_for(new.id.as_deref())?;
        let kind = match new.kind.as_deref() {
            None => None,
            // An arm is refused below, with the reason.
            Some(word) => Some(BodyKind::ALL.iter().copied().find(|kind| kind.word() == word).ok_or_else(|| {
                let known: Vec<&str> = BodyKind::MOBILE.iter().map(|kind| kind.word()).collect();
                refused(&format!("unknown kind `{}`", shown(word)), Some(&format!("known kinds: {}", known.join(", "))))
            })?),
        };
        let wish = scenarios::NewRobot {
            id,
            returns: index.at() < self.members.len(),
            kind,
            radius_m: None,
            start: new.start_m.into(),
            start_yaw_rad: new.start_yaw_rad,
            goals: vec![new.goal_m.into()],
            goal_yaw_rad: new.goal_yaw_rad,
            planner: new.planner.clone(),
            params: ParamValues::new(),
        };
        let robot = match scenarios::add_robot(&self.scenario, &wish) {
            Ok(robot) => robot,
            Err(problems) => return Err(refused(problems.to_string().trim_end(), None)),
        };
        if let Some(other) = near([robot.start.x, robot.start.y], robot.radius_m) {
            let name = self.name(other).to_owned();
            return Err(refused(
                &format!("start: robot `{name}` is in the way"),
                Some("choose another start, or try again later"),
            ));
        }
        let name = robot.id.clone();
        if index.at() == self.members.len() {
            self.members.push(Member::new(index));
            self.scenario.robots.push(robot.clone());
        } else {
            self.scenario.robots[index.at()] = robot.clone();
        }
        let instance = self.members[index.at()].come_again();
        self.actions.push(Action::Order(Order::Admit { instance, robot: Box::new(robot) }));
        self.expect(instance);
        Ok(Waiting::new(Ticket::Admit(instance), name, Owed::Joining))
    }

    /// The slot of a new robot, and its name if that is settled: a new slot, or that of a robot that has left.
    fn place_for(&self, id: Option<&str>) -> Result<(RobotIndex, Option<String>), Refusal> {
        let (robots, slots) = (&self.scenario.robots, self.scenario.fleet.max_robots);
        let is_full = robots.len() >= slots;
        let is_free = |slot: &usize| self.members[*slot].is_free() && robots[*slot].arm.is_none();
        let free: Vec<usize> = (0..robots.len()).filter(is_free).collect();
        let found = match id {
            Some(id) => free.iter().find(|slot| robots[**slot].id == id),
            None if is_full => free.first(),
            None => None,
        };
        match found {
            Some(slot) => Ok((RobotIndex::of(*slot), Some(robots[*slot].id.clone()))),
            None if !is_full => Ok((RobotIndex::of(robots.len()), id.map(str::to_owned))),
            None => {
                let names: Vec<&str> = free.iter().map(|slot| robots[*slot].id.as_str()).collect();
                let hint = match names.is_empty() || id.is_none() {
                    true => "start it with a larger `fleet.max_robots` (`--set fleet.max_robots=N`)".to_owned(),
                    false => format!("names of robots that have left can be used again: {}", names.join(", ")),
                };
                Err(refused(&format!("the fleet is full: {slots} robots"), Some(&hint)))
            }
        }
    }

    /// The world has no place for a robot that an operator added: it was never there.
    pub(super) fn not_admitted(&mut self, instance: RobotInstance) {
        let mut was_begun = !self.withdraw(instance);
        let Some(member) = self.members.get_mut(instance.index.at()) else { return };
        was_begun &= member.next.take_if(|next| *next == instance).is_none();
        member.state = ProcessState::Refused;
        member.lives = instance.incarnation + u32::from(was_begun);
        self.signal(instance, Signal::Kill, None);
        // Slots are places in lists: those before the last are given up as soon as they are the last.
        let was_never_there = |member: &Member| member.state == ProcessState::Refused && member.lives == 0;
        while self.members.last().is_some_and(was_never_there) {
            self.members.pop();
            self.scenario.robots.pop();
        }
    }

    /// A robot is to go.
    pub(super) fn remove(&mut self, name: &str) -> Result<Waiting, Refusal> {
        let slot = self.slot_of(name)?;
        let member = &mut self.members[slot];
        let hint = Some("`shoal ps` shows the robots and their states");
        let problem = match member.state {
            ProcessState::Left => "has left already",
            ProcessState::Refused => "was never in the world",
            _ if member.leaving => "is leaving already",
            _ => {
                member.leaving = true;
                let index = member.instance.index;
                self.actions.push(Action::Order(Order::Remove { index }));
                let owed = Owed::Reply(Reply::Removed { robot: name.to_owned() });
                return Ok(Waiting::new(Ticket::Remove(index), name.to_owned(), owed));
            }
        };
        Err(refused(&format!("robot `{name}` {problem}"), hint))
    }

    /// A robot is to get a new process.
    pub(super) fn restart(&mut self, name: &str) -> Result<Waiting, Refusal> {
        let slot = self.slot_of(name)?;
        let (member, index) = (&self.members[slot], RobotIndex::of(slot));
        let (problem, hint) = match member.state {
            ProcessState::Left => ("has left", "`shoal add --id NAME` adds a robot of this name"),
            ProcessState::Refused => ("was never in the world", "`shoal ps` shows the robots and their states"),
            _ if member.leaving => ("is leaving", "`shoal ps` shows the robots and their states"),
            _ if self.is_joining(index) => ("is being started already", "`shoal ps` shows the robots and their states"),
            _ => {
                self.actions.push(Action::Order(Order::Restart { index }));
                return Ok(Waiting::new(Ticket::Restart(index), name.to_owned(), Owed::Joining));
            }
        };
        Err(refused(&format!("robot `{name}` {problem}"), Some(hint)))
    }

    /// The world does not let a robot go that an operator wanted to leave.
    pub(super) fn not_removed(&mut self, index: RobotIndex) {
        if let Some(member) = self.members.get_mut(index.at()) {
            member.leaving = false;
        }
    }
}

#[cfg(test)]
mod tests;
