//! A fleet that runs.

use crate::fleet::{Fleet, Member};
use crate::frame::Frame;
use crate::vitals::{Look, Pulse, Used, Vitals};
use crate::{Body, WatchError};
use bus::{Address, FrameSubscriber, Gate, Node, OperatorClient, RobotReader, WorldObserver, clock};
use model::{RobotIndex, RobotInstance, Scenario};
use protocol::codec;
use protocol::daemon_to_robot::AgentSpec;
use protocol::operator_to_daemon::{EventRecord, Reply, Request, RobotStatus, Status};
use protocol::robot_to_robot::SharedPose;
use protocol::world_to_observer::FrameBody;
use protocol::world_to_robot::Odometry;
use serde::de::DeserializeOwned;
use std::cmp::Ordering;
use std::time::Duration;

/// A daemon that has not said how the fleet is after this long is not waited for.
const PATIENCE: Duration = Duration::from_millis(500);
/// Number of robots whose intentions are read at the same time; each takes some descriptors.
const CHOSEN_MAX: usize = 4;

/// Eyes on a running fleet. Nothing is asked of its robots.
pub struct Live {
    address: Address,
    gate: Gate,
    fleet: Fleet,
    revision: u64,
    /// Which life of the world `eyes` belongs to.
    incarnation: u32,
    eyes: Option<(FrameSubscriber, WorldObserver)>,
    /// There was a frame since it began to look.
    has_shown: bool,
    chosen: Vec<(RobotInstance, RobotReader)>,
    status: Status,
    events: u64,
    look: Option<Look>,
    node: Node,
}

impl Live {
    /// Finds the fleet at `address`. Frames are not written for it before it asks for one.
    ///
    /// # Errors
    /// When the fleet is gone, or its files are from another build.
    pub fn open(address: &Address, name: Option<&str>) -> Result<Live, WatchError> {
        let mut scenario: Scenario = left(address, world_sim::shell::SCENARIO_FILE)?;
        bus::attach_map(address, scenario.map.as_mut())?;
        let gate = Gate::open(address)?;
        Ok(Live {
            fleet: Fleet::of(address.id(), name, &scenario),
            revision: 0,
            incarnation: 0,
            eyes: None,
            has_shown: false,
            chosen: Vec::new(),
            status: Status { scenario: scenario.name.clone(), mode: scenario.clock.mode, ..Status::default() },
            events: 0,
            look: None,
            node: Node::new(address, "view")?,
            gate,
            address: address.clone(),
        })
    }

    /// What stays as it is.
    pub fn fleet(&self) -> &Fleet {
        &self.fleet
    }

    /// Goes up whenever [`Live::fleet`] changes: robots are added while it runs.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Whether the fleet has ended.
    pub fn is_over(&self) -> bool {
        self.gate.over() || self.gate.stopped() || !self.address.root().exists()
    }

    /// The newest frame, if there is one since the last call. From the first call on the world writes them.
    ///
    /// # Errors
    /// When the fleet is gone, or too many watch it.
    pub fn frame(&mut self) -> Result<Option<Frame>, WatchError> {
        let incarnation = self.gate.world_incarnation();
        if self.eyes.is_none() || incarnation != self.incarnation {
            self.rest();
            let eyes = (FrameSubscriber::open(&self.node, incarnation)?, WorldObserver::open(&self.node, incarnation)?);
            (self.eyes, self.incarnation) = (Some(eyes), incarnation);
        }
        let Some((frames, observer)) = &mut self.eyes else { return Ok(None) };
        let mut newest = None;
        while let Some(frame) = frames.take()? {
            newest = Some(frame);
        }
        let mut frame = match newest {
            Some((header, bodies)) => Frame::of(&header, &bodies),
            None if !self.has_shown => standing(&self.gate, observer, &self.status, self.fleet.tick_hz),
            None => return Ok(None),
        };
        self.has_shown = true;
        for body in frame.bodies.iter_mut().filter(|body| !body.is_obstacle()) {
            let odometry = observer.odometry(RobotIndex(body.index));
            body.goal_m = Some([odometry.goal_x_m, odometry.goal_y_m]);
        }
        let tick_hz = self.fleet.tick_hz;
        for (instance, reader) in &self.chosen {
            let body = frame.bodies.iter_mut().find(|body| !body.is_obstacle() && body.index == instance.index.0);
            if let Some(body) = body {
                intend(body, &reader.pose(), tick_hz);
            }
        }
        Ok(Some(frame))
    }

    /// Stops looking at frames until the next call of [`Live::frame`]: the world does not write them any more.
    pub fn rest(&mut self) {
        (self.eyes, self.has_shown) = (None, false);
        self.chosen.clear();
    }

    /// Whose intentions frames tell from now on; only some of them if there are many.
    pub fn choose(&mut self, robots: &[RobotIndex]) {
        let wanted: Vec<RobotInstance> = (robots.iter().take(CHOSEN_MAX))
            .filter_map(|index| self.status.robots.get(index.at()))
            .map(|RobotStatus { index, incarnation, .. }| RobotInstance { index: *index, incarnation: *incarnation })
            .collect();
        self.chosen.retain(|(instance, _)| wanted.contains(instance));
        for instance in wanted {
            if !self.chosen.iter().any(|(known, _)| *known == instance)
                && let Ok(reader) = RobotReader::open(&self.node, instance)
            {
                self.chosen.push((instance, reader));
            }
        }
    }

    /// How everybody does; what is measured is of the time since the last call. It takes some milliseconds with many robots.
    ///
    /// # Errors
    /// When the fleet is gone. A daemon that does not answer is said in what is returned.
    pub fn vitals(&mut self) -> Result<Vitals, WatchError> {
        let unanswered = self.ask_daemon().err().map(|error| error.to_string());
        let (events, unanswered) = match unanswered {
            Some(why) => (Vec::new(), Some(why)),
            None => match self.ask_events() {
                Ok(events) => (events, None),
                Err(error) => (Vec::new(), Some(error.to_string())),
            },
        };
        if unanswered.is_some() {
            let progress = self.gate.progress();
            self.status.tick = progress.tick;
            self.status.time_s = progress.tick as f64 / self.fleet.tick_hz;
        }
        let pids = self.status.robots.iter().filter_map(|robot| Some((robot.index, robot.pid?)));
        let look = Look {
            at_ns: clock::now_ns(),
            stats: bus::stats::read_all(&self.address)?,
            robots: pids.filter_map(|(index, pid)| Some((index, Used::by(pid)?))).collect(),
            world: Used::by(self.status.world_pid),
        };
        let pulse = Pulse::between(self.look.as_ref(), &look, self.fleet.mode, self.fleet.tick_hz);
        self.look = Some(look);
        Ok(Vitals { status: self.status.clone(), unanswered, events, pulse })
    }

    fn ask_daemon(&mut self) -> Result<(), WatchError> {
        match OperatorClient::new(&self.address).ask(&Request::Status, PATIENCE)? {
            Reply::Status(status) => self.take_status(status),
            _ => Err(WatchError::Confused),
        }
    }

    fn ask_events(&mut self) -> Result<Vec<EventRecord>, WatchError> {
        match OperatorClient::new(&self.address).ask(&Request::Events { after: self.events }, PATIENCE)? {
            Reply::Events(events) => {
                self.events = events.last().map_or(self.events, |newest| newest.number);
                Ok(events)
            }
            _ => Err(WatchError::Confused),
        }
    }

    /// A robot that is new, or that has the slot of another one, is asked for at the file that its agent was given.
    fn take_status(&mut self, status: Status) -> Result<(), WatchError> {
        self.status = status;
        for robot in &self.status.robots {
            let slot = robot.index.at();
            if self.fleet.members.get(slot).is_some_and(|member| member.id == robot.id) {
                continue;
            }
            let instance = RobotInstance { index: robot.index, incarnation: robot.incarnation };
            // It is written just before its process starts: another look will find it.
            let Ok(spec) = left::<AgentSpec>(&self.address, &robot_agent::shell::spec_file(instance)) else { break };
            let member = Member::of(&spec.robot);
            let members = &mut self.fleet.members;
            match slot.cmp(&members.len()) {
                Ordering::Less => members[slot] = member,
                Ordering::Equal => members.push(member),
                Ordering::Greater => break,
            }
            self.revision += 1;
        }
        Ok(())
    }
}

/// The fleet as the world's board has it: a world that waits opens no tick, and so shows no frame. Obstacles that move are not on it.
fn standing(gate: &Gate, observer: &WorldObserver, status: &Status, tick_hz: f64) -> Frame {
    let progress = gate.progress();
    let there = status.robots.iter().filter(|robot| robot.position_m.is_some());
    let body = |robot: &RobotStatus| {
        let odometry = observer.odometry(robot.index);
        let is_silent = !odometry.has(Odometry::FLAG_PRESENT);
        let flags = [(robot.arrived, FrameBody::FLAG_ARRIVED), (is_silent, FrameBody::FLAG_SILENT)];
        Body {
            index: robot.index.0,
            flags: flags.into_iter().filter(|(set, _)| *set).map(|(_, flag)| flag).sum(),
            position_m: [odometry.x_m, odometry.y_m],
            yaw_rad: odometry.yaw_rad,
            joints_rad: odometry.joints_rad,
            ..Body::default()
        }
    };
    Frame {
        tick: progress.tick,
        time_s: progress.tick as f64 / tick_hz,
        arrived: progress.arrived,
        contacts: u32::try_from(progress.contacts).unwrap_or(u32::MAX),
        bodies: there.map(body).collect(),
    }
}

/// What a robot says of its plan.
fn intend(body: &mut Body, pose: &SharedPose, tick_hz: f64) {
    (body.pull, body.push) = (pose.pull, pose.push);
    if pose.has(SharedPose::FLAG_NEXT) {
        body.command_mps = Some([(pose.next_x_m - pose.x_m) * tick_hz, (pose.next_y_m - pose.y_m) * tick_hz]);
    }
}

/// What the daemon left in a file of the fleet's root.
fn left<T: DeserializeOwned>(address: &Address, name: &str) -> Result<T, WatchError> {
    let path = address.file(name);
    #[expect(clippy::disallowed_methods, reason = "what the daemon left is in files")]
    let bytes = std::fs::read(&path).map_err(|error| WatchError::File(path.clone(), error))?;
    codec::decode(&bytes).map_err(|error| WatchError::Build(path, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_that_says_nothing_has_no_intentions() {
        let mut body = Body::default();
        intend(&mut body, &SharedPose::default(), 50.0);
        assert_eq!((body.pull, body.push, body.command_mps), ([0.0; 2], [0.0; 2], None));
        let mut pose = SharedPose { x_m: 1.0, next_x_m: 1.02, flags: SharedPose::FLAG_NEXT, ..SharedPose::default() };
        (pose.pull, pose.push) = ([0.0, -1.0], [0.5, 0.0]);
        intend(&mut body, &pose, 50.0);
        assert!((body.command_mps.unwrap()[0] - 1.0).abs() < 1e-9);
        assert_eq!((body.pull, body.push), ([0.0, -1.0], [0.5, 0.0]));
    }
}
