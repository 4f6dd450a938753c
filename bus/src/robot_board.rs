//! What a robot tells everybody: one small iceoryx2 blackboard per life, with its last two poses and its command.
//!
//! The incarnation is in the name, because a writer that was killed leaves its entries unwritable as long as the
//! service lives: the next life gets a board of its own.

use crate::board::{self, Board, Entry, EntryMut, Key};
use crate::node::Node;
use crate::{Result, Sizes};
use protocol::Seat;
use protocol::robot_to_robot::PosePair;
use protocol::robot_to_world::Command;

const POSE: Key = 0;
const COMMAND: Key = 1;

fn name(seat: Seat) -> String {
    format!("robot/{}/{}", seat.slot, seat.incarnation)
}

/// A robot's hand on its own board, which exists as long as this does.
pub struct RobotWriter {
    pose: EntryMut<PosePair>,
    command: EntryMut<Command>,
    _board: Board,
}

impl RobotWriter {
    /// Makes the board of this life, empty.
    ///
    /// # Errors
    /// When it exists already, or shared memory or open files have run out.
    pub fn create(node: &Node, seat: Seat, sizes: Sizes) -> Result<RobotWriter> {
        let name = name(seat);
        let creator = board::creator(node, &name, sizes.participants_max())
            .add(POSE, PosePair::default())
            .add(COMMAND, Command::default());
        let board = board::create(creator, &name)?;
        let writer = board::writer(&board, &name)?;
        Ok(RobotWriter {
            pose: board::entry_mut(&writer, &name, POSE)?,
            command: board::entry_mut(&writer, &name, COMMAND)?,
            _board: board,
        })
    }

    /// Tells the last two poses.
    pub fn pose(&mut self, pose: PosePair) {
        self.pose.update_with_copy(pose);
    }

    /// Asks the body for this.
    pub fn command(&mut self, command: Command) {
        self.command.update_with_copy(command);
    }
}

/// Somebody's eyes on the board of a robot. What a robot wrote stays readable when its process has died.
pub struct RobotReader {
    pose: Entry<PosePair>,
    command: Entry<Command>,
}

impl RobotReader {
    /// Opens the board of this life. It takes about 0.1 ms and five file descriptors.
    ///
    /// # Errors
    /// When the board is not there ([`BusError::is_missing`](crate::BusError::is_missing)), or has no place left.
    pub fn open(node: &Node, seat: Seat) -> Result<RobotReader> {
        let name = name(seat);
        let reader = board::reader(&board::open(node, &name)?, &name)?;
        Ok(RobotReader { pose: board::entry(&reader, &name, POSE)?, command: board::entry(&reader, &name, COMMAND)? })
    }

    /// The last two poses.
    pub fn pose(&self) -> PosePair {
        *self.pose.get()
    }

    /// The newest command.
    pub fn command(&self) -> Command {
        *self.command.get()
    }
}
