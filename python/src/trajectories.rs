//! Where everybody was at every tick, as arrays with a row for each tick and a column for each robot.

use crate::arrays::{column, pairs, table};
use model::Drive;
use protocol::inputs::{WorldInput, WorldInputs};
use protocol::world_to_observer::FrameBody;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use record::Body;

const NOWHERE: f64 = f64::NAN;

/// The trajectories of a run. All lists have `robots` entries for each tick.
#[derive(Debug, Default)]
pub(crate) struct Trajectories {
    robots: usize,
    ticks: Vec<u64>,
    position: Vec<[f64; 2]>,
    yaw_rad: Vec<f64>,
    goal: Vec<[f64; 2]>,
    joints_rad: Vec<[f64; 2]>,
    command: Vec<[f64; 2]>,
    arrived: Vec<bool>,
    active: Vec<bool>,
    /// Slots of those that take part in the newest tick, in their order.
    participants: Vec<usize>,
}

impl Trajectories {
    /// Those of this number of robots; more may come.
    pub(crate) fn of(robots: usize) -> Trajectories {
        Trajectories { robots, ..Trajectories::default() }
    }

    /// Adds a tick that has been opened: the robots that are there, by slot.
    pub(crate) fn frame(&mut self, tick: u64, bodies: &[Body]) {
        let from = self.position.len();
        let to = from + self.robots;
        self.ticks.push(tick);
        for list in [&mut self.position, &mut self.goal, &mut self.joints_rad, &mut self.command] {
            list.resize(to, [NOWHERE; 2]);
        }
        self.yaw_rad.resize(to, NOWHERE);
        self.arrived.resize(to, false);
        self.active.resize(to, false);
        self.participants.clear();
        for body in bodies.iter().filter(|body| !body.is_obstacle() && (body.index as usize) < self.robots) {
            let slot = body.index as usize;
            let at = from + slot;
            self.position[at] = body.position_m;
            self.yaw_rad[at] = body.yaw_rad;
            self.goal[at] = body.goal_m;
            self.joints_rad[at] = body.joints_rad;
            self.arrived[at] = body.flags & FrameBody::FLAG_ARRIVED != 0;
            self.active[at] = body.flags & FrameBody::FLAG_SILENT == 0;
            if self.active[at] {
                self.participants.push(slot);
            }
        }
    }

    /// Adds what the world was told before the frame of this tick: the commands of the tick before are among it.
    pub(crate) fn told(&mut self, tick: u64, inputs: &WorldInputs) {
        let Some(from) = self.position.len().checked_sub(self.robots) else { return };
        if self.ticks.last().is_none_or(|newest| newest + 1 != tick) {
            return;
        }
        let drives = inputs.inputs.iter().rev().find_map(|input| match input {
            WorldInput::Closed { drives } => Some(drives),
            _ => None,
        });
        let drives = drives.filter(|drives| drives.len() == self.participants.len());
        for (slot, drive) in self.participants.iter().zip(drives.into_iter().flatten()) {
            if let Some(drive) = drive {
                self.command[from + slot] = numbers(*drive);
            }
        }
    }

    /// As arrays, by their names.
    pub(crate) fn arrays<'py>(&self, py: Python<'py>, tick_hz: f64) -> PyResult<Bound<'py, PyDict>> {
        let shape = [self.ticks.len(), self.robots];
        let arrays = PyDict::new(py);
        arrays.set_item("tick", column(py, self.ticks.iter().copied()))?;
        arrays.set_item("time_s", column(py, self.ticks.iter().map(|tick| *tick as f64 / tick_hz)))?;
        arrays.set_item("position", pairs(py, &self.position, shape)?)?;
        arrays.set_item("yaw_rad", table(py, &self.yaw_rad, shape)?)?;
        arrays.set_item("goal", pairs(py, &self.goal, shape)?)?;
        arrays.set_item("joints_rad", pairs(py, &self.joints_rad, shape)?)?;
        arrays.set_item("command", pairs(py, &self.command, shape)?)?;
        arrays.set_item("arrived", table(py, &self.arrived, shape)?)?;
        arrays.set_item("active", table(py, &self.active, shape)?)?;
        Ok(arrays)
    }
}

/// The two numbers of a command.
fn numbers(drive: Drive) -> [f64; 2] {
    match drive {
        Drive::Velocity(velocity) => velocity.into(),
        Drive::Twist { speed_mps, turn_radps } => [speed_mps, turn_radps],
        Drive::Joints { rate_radps } | Drive::Wheels { rate_radps } => rate_radps,
    }
}
