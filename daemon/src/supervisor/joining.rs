//! Newcomers that operators wait for: who hears whom.

use super::Supervisor;
use crate::coordinator::Member;
use crate::hearing::mutual;
use crate::processes::now;
use model::{ProcessState, Robot, RobotInstance};

impl Supervisor {
    /// Whom a robot will hear when it takes part: those that are in its radio range now.
    pub(super) fn foreseen(&self, robot: &Robot, instance: RobotInstance) -> Vec<RobotInstance> {
        let at = |member: &Member| {
            let odometry = self.observer.odometry(member.instance.index);
            [odometry.x_m, odometry.y_m]
        };
        let members = self.coordinator.members();
        let before = members.get(instance.index.at()).filter(|_| instance.incarnation > 0);
        let is_back = before.is_some_and(|before| before.restarts() > 0);
        let here = before.filter(|_| is_back).map_or(robot.start.into(), at);
        let near = members.iter().filter(|member| member.state == ProcessState::Running);
        let near = near.filter(|member| member.instance.index != instance.index);
        let distance_m = |[x_m, y_m]: [f64; 2]| (x_m - here[0]).hypot(y_m - here[1]);
        near.filter(|member| distance_m(at(member)) <= robot.radio_range_m).map(|member| member.instance).collect()
    }

    /// Tells the coordinator of newcomers that hear all their neighbours and are heard by them.
    pub(super) fn look_at_newcomers(&mut self) {
        for (newcomer, entered) in self.coordinator.newcomers() {
            let (observer, gate) = (&self.observer, &self.gate);
            let heard_of = |who: RobotInstance, version: u32| gate.heard_of(who, version);
            let others = self.coordinator.members().iter().map(|member| member.instance.index);
            if let Some(neighbors) = mutual(newcomer, entered, others, &|index| observer.told(index), &heard_of) {
                self.coordinator.joined(newcomer, neighbors, now());
            }
        }
    }
}
