//! What can be read of the world, between its changes.

use super::World;
use crate::arm;
use crate::grid::Grid;
use crate::presence::{Presence, State};
use crate::ranges::Ranges;
use crate::referee::Referee;
use geometry::Capsule;
use model::{Robot, RobotInstance, Stop, TimelineAction, TimelineEvent};
use protocol::daemon_to_world::Order;
use protocol::world_to_daemon::Notice;
use protocol::world_to_observer::{FrameBody, FrameHeader};
use protocol::world_to_robot::{NeighborRef, Odometry, Piece};

/// Progress: at any time.
impl World {
    /// The tick that is open, or about to be opened.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Simulated time of the present tick, s.
    pub fn time_s(&self) -> f64 {
        self.tick as f64 * self.clock.dt_s()
    }

    /// Whether the run is over: it was told to stop, its time is up, or (unless it is to last its time) every robot
    /// has settled and nothing that could unsettle one is to come.
    ///
    /// Settled is a robot that has arrived, or is gone for good. One that is about to enter, paused or to be restarted
    /// is not, arrived or not, because it comes back by itself; a held one is once it has arrived, because nobody knows
    /// whether it ever comes back, and so is one that is paused until it is resumed. Joins, tasks and leaves that the
    /// timeline still holds for robots that are not gone are waited for, as are orders; faults and the radio are not.
    pub fn finished(&self) -> bool {
        self.stopped || self.tick >= self.clock.ticks_max || self.clock.stop == Stop::Arrived && self.is_settled()
    }

    fn is_settled(&self) -> bool {
        let settled = |(presence, referee): (&Presence, &Option<Referee>)| {
            let arrived = referee.as_ref().is_none_or(|referee| referee.arrival.is_some());
            presence.state == State::Vacant || presence.gone().is_some() || arrived && presence.entry().is_none()
        };
        let wakes = |event: &TimelineEvent| match event.what {
            TimelineAction::Join { robot } | TimelineAction::Leave { robot } | TimelineAction::Task { robot, .. } => {
                self.presences[robot].gone().is_none()
            }
            TimelineAction::Fault { .. } | TimelineAction::Radio { .. } => false,
        };
        self.presences.iter().zip(&self.referees).all(settled)
            && !self.events[self.next_event..].iter().any(wakes)
            && self.orders.iter().all(|order| matches!(order, Order::Absent { .. }))
    }

    /// The notices since the last call, in order. Allocates nothing when there are none; whoever runs a world takes
    /// them every tick.
    pub fn take_notices(&mut self) -> Vec<Notice> {
        self.journal.take_notices()
    }

    /// Hash over every tick so far, of slot, incarnation, position, heading, joints and goals done of every body in the
    /// world: equal for equal runs, to the last bit.
    pub fn trajectory_hash(&self) -> u64 {
        self.hash
    }

    /// Robots that are at their last goal.
    pub fn arrived_count(&self) -> usize {
        self.referees.iter().flatten().filter(|referee| referee.arrival.is_some()).count()
    }

    /// Robots that there are, late joiners and those that are gone included.
    pub fn robot_count(&self) -> usize {
        self.robots.iter().flatten().count()
    }

    /// Slots that have or had a robot; one more than the highest of them.
    pub fn slots(&self) -> usize {
        self.robots.len()
    }

    /// How many pieces there are: of obstacles, and of robots.
    pub fn pieces(&self) -> usize {
        self.shapes.len() + self.bodies.len() + self.arms.len()
    }

    /// The robot of a slot, as the scenario or the request that added it describes it.
    pub fn robot(&self, slot: usize) -> Option<&Robot> {
        self.robots.get(slot)?.as_ref()
    }

    /// The present life of a slot, and where it is in it.
    pub fn state(&self, slot: usize) -> Option<(RobotInstance, State)> {
        self.presences.get(slot).map(|presence| (presence.instance(), presence.state))
    }

    /// Orders that have not taken effect yet.
    pub fn orders_waiting(&self) -> usize {
        self.orders.len() + self.opener.unanswered()
    }

    /// The log so far.
    pub fn events(&self) -> &[model::Event] {
        &self.journal.events
    }

    /// Contacts so far, between robots and with obstacles.
    pub fn contacts(&self) -> u64 {
        self.contacts.robots + self.contacts.obstacles
    }
}

/// Views for robots and observers: while a tick is open, of that tick.
impl World {
    /// Who plans in this tick and must answer, sorted by slot.
    pub fn participants(&self) -> &[RobotInstance] {
        &self.participants
    }

    /// What the robot is told of itself. The stamp is 0: its writer knows the time.
    pub fn odometry(&self, slot: usize) -> Odometry {
        let mut odometry = Odometry::default();
        self.tell_odometry(slot, &mut odometry);
        odometry
    }

    /// Makes `odometry` what the robot is told of itself, every field of it. The stamp is 0: its writer knows the time.
    pub fn tell_odometry(&self, slot: usize, odometry: &mut Odometry) {
        let (body, referee) = (&self.bodies[slot], self.referees[slot].as_ref());
        let goal = referee.map_or(body.pose.position, Referee::goal);
        let goal_yaw_rad = referee.and_then(Referee::goal_yaw_rad);
        *odometry = Odometry {
            tick: self.tick,
            stamp_ns: 0,
            x_m: body.pose.position.x,
            y_m: body.pose.position.y,
            yaw_rad: body.pose.yaw_rad,
            vx_mps: body.pose.velocity.x,
            vy_mps: body.pose.velocity.y,
            turn_radps: body.pose.turn_radps,
            joints_rad: self.joints_rad(slot),
            goal_x_m: goal.x,
            goal_y_m: goal.y,
            goal_yaw_rad: goal_yaw_rad.unwrap_or(0.0),
            incarnation: body.instance.incarnation,
            goals_done: referee.map_or(0, |referee| referee.goals_done),
            goals_left: referee.map_or(0, Referee::goals_left),
            flags: self.flags(slot) | if goal_yaw_rad.is_some() { Odometry::FLAG_GOAL_YAW } else { 0 },
        };
    }

    /// Joints of an arm, rad; zero for everybody else.
    fn joints_rad(&self, slot: usize) -> [f64; 2] {
        arm::of_slot(&self.arms, slot).map_or([0.0; 2], |arm| arm.state.joints_rad)
    }

    pub(super) fn flags(&self, slot: usize) -> u32 {
        let present = if self.bodies[slot].takes_part { Odometry::FLAG_PRESENT } else { 0 };
        let left = if self.presences[slot].state == State::Left { Odometry::FLAG_LEFT } else { 0 };
        present | left | if self.has_arrived(slot) { Odometry::FLAG_ARRIVED } else { 0 }
    }

    fn has_arrived(&self, slot: usize) -> bool {
        self.referees[slot].as_ref().is_some_and(|referee| referee.arrival.is_some())
    }

    /// The robots that this one hears, sorted by slot.
    pub fn neighbors(&self, slot: usize) -> &[NeighborRef] {
        self.ranges.heard(slot)
    }

    /// The robots that this one will hear from the next tick on, sorted by slot: they speak for the first time in this one.
    pub fn coming(&self, slot: usize) -> &[NeighborRef] {
        self.ranges.coming(slot)
    }

    /// Whom each slot will hear once everybody who is due now has entered and has spoken, for the slots that will hear
    /// anybody. Before the first tick, this is whom to get ready for.
    pub fn foreseen(&self) -> Vec<(usize, Vec<NeighborRef>)> {
        let mut bodies = self.bodies.clone();
        for (body, presence) in bodies.iter_mut().zip(&self.presences) {
            let due = presence.due(self.tick);
            (body.instance, body.in_world, body.takes_part, body.on_radio) = (presence.instance(), due, due, due);
        }
        let (mut grid, mut ranges) = (Grid::default(), Ranges::default());
        grid.rebuild(&bodies);
        ranges.update(&bodies, &self.arms, &self.shapes, &grid);
        ranges.heard_changed().iter().map(|slot| (*slot, ranges.heard(*slot).to_vec())).collect()
    }

    /// The pieces that this one sees, sorted by index.
    pub fn sensed(&self, slot: usize) -> &[u16] {
        self.ranges.sensed(slot)
    }

    /// A piece where it is now: of an obstacle, or after those, by slot, the body of a robot or the two links of an arm.
    /// The velocity of an obstacle is that of its motion at this instant, that of a link that of its middle.
    pub fn piece(&self, index: usize) -> Piece {
        let mut piece = Piece::default();
        self.tell_piece(index, &mut piece);
        piece
    }

    /// Makes `told` the piece where it is now, every field of it.
    pub fn tell_piece(&self, index: usize, told: &mut Piece) {
        let (capsule, velocity, obstacle, robot) = match index.checked_sub(self.shapes.len()) {
            None => {
                let owner = self.shapes.owner(index);
                (self.shapes.piece(index), self.shapes.obstacles[owner].velocity, owner, 0)
            }
            Some(piece) => {
                let (slot, link) = arm::owner(&self.arms, piece);
                let body = &self.bodies[slot];
                let (shape, velocity, robot) = match (link, arm::of_slot(&self.arms, slot)) {
                    (Some(link), Some(arm)) => (arm.links()[link], arm.link_velocities()[link], 0),
                    _ => (Capsule::disc(body.pose.position, body.radius_m), body.pose.velocity, slot as u32 + 1),
                };
                (shape, velocity, self.shapes.obstacles.len() + slot, robot)
            }
        };
        *told = Piece {
            ax_m: capsule.a.x,
            ay_m: capsule.a.y,
            bx_m: capsule.b.x,
            by_m: capsule.b.y,
            radius_m: capsule.radius,
            vx_mps: velocity.x,
            vy_mps: velocity.y,
            obstacle: obstacle as u32,
            robot,
        };
    }

    /// What comes before the bodies of a frame. The stamp is 0: its writer knows the time.
    pub fn frame_header(&self) -> FrameHeader {
        FrameHeader {
            tick: self.tick,
            stamp_ns: 0,
            time_s: self.time_s(),
            arrived: self.arrived_count() as u32,
            contacts: u32::try_from(self.contacts()).unwrap_or(u32::MAX),
        }
    }

    /// Every robot in the world, by slot, then every moving obstacle, appended to `out`. Also valid between ticks.
    pub fn frame(&self, out: &mut Vec<FrameBody>) {
        for (slot, body) in self.bodies.iter().enumerate().filter(|(_, body)| body.in_world) {
            let arrived = if self.has_arrived(slot) { FrameBody::FLAG_ARRIVED } else { 0 };
            out.push(FrameBody {
                x_m: body.pose.position.x,
                y_m: body.pose.position.y,
                yaw_rad: body.pose.yaw_rad,
                radius_m: body.radius_m,
                vx_mps: body.pose.velocity.x,
                vy_mps: body.pose.velocity.y,
                joints_rad: self.joints_rad(slot),
                index: slot as u32,
                flags: arrived | if body.takes_part { 0 } else { FrameBody::FLAG_SILENT },
            });
        }
        for (index, obstacle) in self.shapes.obstacles.iter().enumerate().filter(|(_, obstacle)| obstacle.moves()) {
            let (at, radius_m) = (obstacle.reference(), self.shapes.piece(obstacle.pieces.start).radius);
            out.push(FrameBody {
                x_m: at.x,
                y_m: at.y,
                yaw_rad: 0.0,
                radius_m,
                vx_mps: obstacle.velocity.x,
                vy_mps: obstacle.velocity.y,
                joints_rad: [0.0; 2],
                index: index as u32,
                flags: FrameBody::FLAG_OBSTACLE,
            });
        }
    }
}
