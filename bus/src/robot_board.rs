//! What a robot tells everybody: one small iceoryx2 blackboard per life, with its last two poses and its command.
//!
//! The poses take turns in two entries. So nobody reads what is being written: at tick k a robot writes one entry, and
//! its neighbours read its pose of tick k - 1, which is in the other one.
//!
//! The incarnation is in the name, because a writer that was killed leaves its entries unwritable as long as the
//! service lives: the next life gets a board of its own.

use crate::board::{self, Board, Entry, EntryMut, Key};
use crate::node::Node;
use crate::{Result, Sizes};
use protocol::Seat;
use protocol::robot_to_robot::{PosePair, SharedPose};
use protocol::robot_to_world::Command;

const POSES: [Key; 2] = [0, 1];
const COMMAND: Key = 2;

fn name(seat: Seat) -> String {
    format!("robot/{}/{}", seat.slot, seat.incarnation)
}

/// A robot's hand on its own board, which exists as long as this does.
pub struct RobotWriter {
    poses: [EntryMut<SharedPose>; 2],
    /// Which of them is the next to write.
    turn: usize,
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
            .add(POSES[0], SharedPose::default())
            .add(POSES[1], SharedPose::default())
            .add(COMMAND, Command::default());
        let board = board::create(creator, &name)?;
        let writer = board::writer(&board, &name)?;
        Ok(RobotWriter {
            poses: [board::entry_mut(&writer, &name, POSES[0])?, board::entry_mut(&writer, &name, POSES[1])?],
            turn: 0,
            command: board::entry_mut(&writer, &name, COMMAND)?,
            _board: board,
        })
    }

    /// Tells a pose; the one before it stays.
    pub fn pose(&mut self, pose: SharedPose) {
        self.poses[self.turn].update_with_copy(pose);
        self.turn ^= 1;
    }

    /// Asks the body for this.
    pub fn command(&mut self, command: Command) {
        self.command.update_with_copy(command);
    }
}

/// Somebody's eyes on the board of a robot. What a robot wrote stays readable when its process has died.
pub struct RobotReader {
    poses: [Entry<SharedPose>; 2],
    /// Where the next pose to be heard should be.
    turn: usize,
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
        Ok(RobotReader {
            poses: [board::entry(&reader, &name, POSES[0])?, board::entry(&reader, &name, POSES[1])?],
            turn: 0,
            command: board::entry(&reader, &name, COMMAND)?,
        })
    }

    /// The last two poses.
    pub fn pose(&self) -> PosePair {
        let [newest, previous] = [*self.poses[0].get(), *self.poses[1].get()];
        // A robot may speak several times of one tick: then the stamp decides.
        if (newest.tick, newest.stamp_ns) < (previous.tick, previous.stamp_ns) {
            PosePair { newest: previous, previous: newest }
        } else {
            PosePair { newest, previous }
        }
    }

    /// As much of the last two poses as shows the newest one of a tick before `tick`. Mostly that is one entry, which
    /// nobody is writing.
    pub fn pose_before(&mut self, tick: u64) -> PosePair {
        let pose = *self.poses[self.turn].get();
        if pose.has(SharedPose::FLAG_SPOKEN) && pose.tick + 1 == tick {
            self.turn ^= 1;
            return PosePair { newest: pose, previous: SharedPose::default() };
        }
        // It has missed ticks, or is new: next time this is where the one that comes after the found one will be.
        let pair = self.pose();
        self.turn ^= usize::from(pair.before(tick) == Some(&pose));
        pair
    }

    /// The newest command.
    pub fn command(&self) -> Command {
        *self.command.get()
    }
}
