//! Where the robots are, and what they say of their way: what tasks are assigned by.

use super::Supervisor;
use crate::coordinator::{Member, Place};
use bus::RobotReader;
use protocol::robot_to_robot::SharedPose;
use protocol::world_to_robot::Odometry;

/// Whether the boards of the robots are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bids {
    /// They are, for an auction: about 0.1 ms for each robot.
    Read,
    /// They are not.
    Unread,
}

impl Supervisor {
    /// Where the robots are and where they are going, by the world's board; with [`Bids::Read`], how far it is, by each robot's
    /// own.
    pub(super) fn places(&self, bids: Bids) -> Vec<Option<Place>> {
        let place = |member: &Member| {
            let odometry = member.in_world().then(|| self.observer.odometry(member.instance.index))?;
            let goal_m = [odometry.goal_x_m, odometry.goal_y_m];
            let arrived = odometry.has(Odometry::FLAG_ARRIVED);
            Some(Place {
                at_m: [odometry.x_m, odometry.y_m],
                goal_m: (!arrived).then_some(goal_m),
                says_left_m: if bids == Bids::Read { self.says_left_m(member) } else { None },
            })
        };
        self.coordinator.members().iter().map(place).collect()
    }

    /// The distance to its present goal that a robot has published; `None` of one that has not spoken yet, or whose board
    /// cannot be opened. It is opened for this one look: a daemon that kept all of them open would need five descriptors for
    /// each robot.
    fn says_left_m(&self, member: &Member) -> Option<f64> {
        let pose = RobotReader::open(&self.node, member.instance).ok()?.pose();
        pose.has(SharedPose::FLAG_SPOKEN).then_some(pose.remaining_m)
    }
}
