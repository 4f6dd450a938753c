//! What a robot tells everybody: one small iceoryx2 blackboard per life, with its command and its newest pose, or its last
//! two.
//!
//! Two poses take turns in two entries. So nobody reads what is being written: at tick k a robot writes one entry, and
//! its neighbours read its pose of tick k - 1, which is in the other one. Where it is the newest that counts, whatever its
//! tick, there is one entry: of two, only a look at both could tell which one has it.
//!
//! Where messages may be late or lost, robots also tell each other about borders: in one or two more entries, which take turns
//! with the poses.
//!
//! The incarnation is in the name, because a writer that was killed leaves its entries unwritable as long as the
//! service lives: the next life gets a board of its own.

use crate::board::{self, Board, Entry, EntryMut, Key};
use crate::node::Node;
use crate::{Result, Sizes, clock};
use model::RobotInstance;
use protocol::robot_to_robot::{PosePair, SharedBorder, SharedBorders, SharedPose};
use protocol::robot_to_world::Command;

const POSES: [Key; 2] = [0, 1];
const COMMAND: Key = 2;
const BORDERS: [Key; 2] = [3, 4];
/// A board that is neither there nor gone is looked for again for this long, this often.
const PASSING_NS: u64 = 50_000_000;
const AGAIN_NS: u64 = 1_000_000;

fn name(instance: RobotInstance) -> String {
    format!("robot/{}/{}", instance.index, instance.incarnation)
}

/// Which poses a board holds. Every reader finds that out by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Poses {
    /// The newest one: for `realtime`.
    Newest,
    /// The newest one and the one before it: for `lockstep`, where that of the tick before is wanted, whoever ran first.
    LastTwo,
}

/// A robot's hand on its own board, which exists as long as this does.
pub struct RobotWriter {
    first: EntryMut<SharedPose>,
    /// What takes turns with it, if the board holds two poses.
    second: Option<EntryMut<SharedPose>>,
    /// The next pose goes into the second one.
    turn: bool,
    command: EntryMut<Command>,
    /// As many as there are poses, or none.
    borders: Vec<EntryMut<SharedBorders>>,
    _board: Board,
}

impl RobotWriter {
    /// Makes the board of this life, empty.
    ///
    /// # Errors
    /// When it exists already, or shared memory or open files have run out.
    pub fn create(node: &Node, instance: RobotInstance, sizes: Sizes, poses: Poses) -> Result<RobotWriter> {
        RobotWriter::create_as(node, instance, sizes, poses, false)
    }

    /// The same; with `has_borders`, of a robot that tells others about borders.
    ///
    /// # Errors
    /// As [`RobotWriter::create`].
    pub fn create_as(
        node: &Node,
        instance: RobotInstance,
        sizes: Sizes,
        poses: Poses,
        has_borders: bool,
    ) -> Result<RobotWriter> {
        let name = name(instance);
        let borders: &[Key] = match (has_borders, poses) {
            (false, _) => &[],
            (true, Poses::Newest) => &BORDERS[..1],
            (true, Poses::LastTwo) => &BORDERS,
        };
        let mut creator = board::creator(node, &name, sizes.participants_max())
            .add(COMMAND, Command::default())
            .add(POSES[0], SharedPose::default());
        if poses == Poses::LastTwo {
            creator = creator.add(POSES[1], SharedPose::default());
        }
        for key in borders {
            creator = creator.add(*key, SharedBorders::default());
        }
        let board = board::create(creator, &name)?;
        let writer = board::writer(&board, &name)?;
        Ok(RobotWriter {
            first: board::entry_mut(&writer, &name, POSES[0], &SharedPose::default())?,
            second: match poses {
                Poses::Newest => None,
                Poses::LastTwo => Some(board::entry_mut(&writer, &name, POSES[1], &SharedPose::default())?),
            },
            turn: false,
            command: board::entry_mut(&writer, &name, COMMAND, &Command::default())?,
            borders: borders
                .iter()
                .map(|key| board::entry_mut(&writer, &name, *key, &SharedBorders::default()))
                .collect::<Result<_>>()?,
            _board: board,
        })
    }

    /// Tells others about borders what `fill` makes in place: it belongs to the pose that was told last. Nothing happens on a board
    /// without borders.
    pub fn borders(&mut self, fill: impl FnOnce(&mut SharedBorders)) {
        let place = usize::from(self.borders.len() == 2 && !self.turn);
        if let Some(entry) = self.borders.get_mut(place) {
            entry.update(fill);
        }
    }

    /// Tells the pose that `fill` makes in place: in the memory that readers look at next, where an older pose is. The
    /// pose before it stays, if the board holds two.
    pub fn pose<R>(&mut self, fill: impl FnOnce(&mut SharedPose) -> R) -> R {
        let next = self.second.as_mut().filter(|_| self.turn).unwrap_or(&mut self.first);
        let result = next.update(fill);
        self.turn = !self.turn;
        result
    }

    /// Asks the body for what `fill` makes in place, where an older command is.
    pub fn command(&mut self, fill: impl FnOnce(&mut Command)) {
        self.command.update(fill);
    }
}

/// Somebody's eyes on the board of a robot. What a robot wrote stays readable when its process has died.
pub struct RobotReader {
    first: Entry<SharedPose>,
    /// What takes turns with it, if the board holds two poses.
    second: Option<Entry<SharedPose>>,
    /// The next pose to be heard should be in the second one.
    turn: bool,
    command: Entry<Command>,
    /// As many as there are poses, or none.
    borders: Vec<Entry<SharedBorders>>,
}

impl RobotReader {
    /// Opens the board of this life. It takes about 0.1 ms and five file descriptors; longer where the board is just being
    /// made or cleared away.
    ///
    /// # Errors
    /// When the board is not there ([`BusError::is_missing`](crate::BusError::is_missing)), has no place left, or there
    /// are no descriptors left. Except for the first, the robot is there and cannot be heard.
    pub fn open(node: &Node, instance: RobotInstance) -> Result<RobotReader> {
        let begun_ns = clock::now_ns();
        loop {
            match RobotReader::open_once(node, instance) {
                Err(error) if error.may_pass() && clock::now_ns() - begun_ns < PASSING_NS => {
                    clock::sleep_until_ns(clock::now_ns() + AGAIN_NS);
                }
                result => return result,
            }
        }
    }

    fn open_once(node: &Node, instance: RobotInstance) -> Result<RobotReader> {
        let name = name(instance);
        let reader = board::reader(&board::open(node, &name)?, &name)?;
        Ok(RobotReader {
            first: board::entry(&reader, &name, POSES[0])?,
            second: board::entry_if_any(&reader, POSES[1]),
            turn: false,
            command: board::entry(&reader, &name, COMMAND)?,
            borders: BORDERS.iter().filter_map(|key| board::entry_if_any(&reader, *key)).collect(),
        })
    }

    /// The newest pose, as of some moment during the call. So nothing is older than what a call before gave, however long
    /// the reader slept.
    pub fn pose(&self) -> SharedPose {
        match self.second {
            None => *self.first.get(),
            Some(_) => self.pair().newest,
        }
    }

    /// The newest pose, and the one before it if the board holds two.
    fn pair(&self) -> PosePair {
        let first = *self.first.get();
        let Some(second) = &self.second else { return PosePair { newest: first, previous: SharedPose::default() } };
        let second = *second.get();
        // A robot may speak several times of one tick: then the stamp decides.
        if (first.tick, first.stamp_ns) < (second.tick, second.stamp_ns) {
            PosePair { newest: second, previous: first }
        } else {
            PosePair { newest: first, previous: second }
        }
    }

    /// The newest pose of a tick before `tick`; without [`SharedPose::FLAG_SPOKEN`] if there is none. Mostly that takes a
    /// look at one entry, which is not being written. For boards that hold two.
    pub fn pose_before(&mut self, tick: u64) -> SharedPose {
        let next = self.second.as_ref().filter(|_| self.turn).unwrap_or(&self.first);
        let pose = *next.get();
        if pose.has(SharedPose::FLAG_SPOKEN) && pose.tick + 1 == tick {
            self.turn = !self.turn;
            return pose;
        }
        // It has missed ticks, or is new: next time this is where the one that comes after the found one will be.
        let found = self.pair().before(tick).copied();
        self.turn ^= found == Some(pose);
        found.unwrap_or_default()
    }

    /// What the robot says to this one about the border between the two: the newest of a tick before `before`, or the newest.
    pub fn border(&self, to: RobotInstance, before: Option<u64>) -> SharedBorder {
        let mut newest: Option<(u64, SharedBorder)> = None;
        for entry in &self.borders {
            let told = entry.get();
            let counts = before.is_none_or(|before| told.tick < before);
            if counts && newest.is_none_or(|(tick, _)| tick < told.tick) {
                newest = Some((told.tick, told.to(to.index.0, to.incarnation)));
            }
        }
        newest.map(|(_, border)| border).unwrap_or_default()
    }

    /// The newest command.
    pub fn command(&self) -> Command {
        *self.command.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Address, clean};
    use model::RobotIndex;
    use proptest::prelude::*;
    use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::SeqCst};

    const INSTANCE: RobotInstance = RobotInstance { index: RobotIndex(0), incarnation: 0 };
    const SIZES: Sizes = Sizes { max_robots: 1, shape_pieces: 0 };

    /// Swept at the end.
    struct Fleet(Address);

    impl Fleet {
        fn new() -> Fleet {
            Fleet(Address::create().unwrap())
        }

        fn node(&self) -> Node {
            Node::new(&self.0, "test").unwrap()
        }
    }

    impl Drop for Fleet {
        fn drop(&mut self) {
            clean::sweep(&self.0);
        }
    }

    fn pose(tick: u64, stamp_ns: u64) -> SharedPose {
        SharedPose { tick, stamp_ns, x_m: stamp_ns as f64, flags: SharedPose::FLAG_SPOKEN, ..SharedPose::default() }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Between two looks any number of poses is told, of one tick or of several, and two readers look at odd times.
        #[test]
        fn a_look_finds_the_newest_poses(
            last_two: bool, looks in prop::collection::vec((prop::collection::vec(0..3_u64, 0..6), 0..2_usize), 0..40)
        ) {
            let fleet = Fleet::new();
            let node = fleet.node();
            let poses = if last_two { Poses::LastTwo } else { Poses::Newest };
            let mut writer = RobotWriter::create(&node, INSTANCE, SIZES, poses).unwrap();
            let readers = [(); 2].map(|()| RobotReader::open(&node, INSTANCE).unwrap());
            let mut told = PosePair::default();
            for (ticks, reader) in looks {
                for ticks in ticks {
                    told.push(pose(told.newest.tick + ticks, told.newest.stamp_ns + 1));
                    writer.pose(|pose| *pose = told.newest);
                }
                let previous = if last_two { told.previous } else { SharedPose::default() };
                prop_assert_eq!(readers[reader].pair(), PosePair { previous, ..told });
                prop_assert_eq!(readers[reader].pose(), told.newest);
            }
        }

        /// However many ticks a reader misses, and whether the robot has spoken of this tick already.
        #[test]
        fn a_look_before_a_tick_finds_the_pose_of_the_tick_before(
            ticks in prop::collection::vec((1..4_u64, any::<bool>()), 1..40)
        ) {
            let fleet = Fleet::new();
            let node = fleet.node();
            let mut writer = RobotWriter::create(&node, INSTANCE, SIZES, Poses::LastTwo).unwrap();
            let mut reader = RobotReader::open(&node, INSTANCE).unwrap();
            let (mut tick, mut told) = (0, 0);
            for (missed, ahead) in ticks {
                tick += missed;
                while told < tick + u64::from(ahead) {
                    writer.pose(|next| *next = pose(told, told + 1));
                    told += 1;
                }
                prop_assert_eq!(reader.pose_before(tick), pose(tick - 1, tick));
            }
        }
    }

    #[test]
    fn beside_a_writer_a_look_finds_what_was_the_newest_meanwhile() {
        const LOOKS: usize = 20_000;
        for poses in [Poses::Newest, Poses::LastTwo] {
            let fleet = Fleet::new();
            let (begun, told, enough) = (AtomicU64::new(0), AtomicU64::new(0), AtomicBool::new(false));
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    let node = fleet.node();
                    let mut writer = RobotWriter::create(&node, INSTANCE, SIZES, poses).unwrap();
                    // Ends by itself, should the reader fail.
                    for stamp_ns in 1..u64::MAX {
                        begun.store(stamp_ns, SeqCst);
                        writer.pose(|next| *next = pose(stamp_ns / 3, stamp_ns));
                        told.store(stamp_ns, SeqCst);
                        if enough.load(SeqCst) || stamp_ns > 1_000_000_000 {
                            break;
                        }
                    }
                });
                while told.load(SeqCst) == 0 {
                    std::thread::yield_now();
                }
                let reader = RobotReader::open(&fleet.node(), INSTANCE).unwrap();
                let mut last = 0;
                for _ in 0..LOOKS {
                    let oldest = told.load(SeqCst).max(last);
                    let found = reader.pose();
                    let newest = begun.load(SeqCst);
                    last = found.stamp_ns;
                    let whole = found == pose(last / 3, last);
                    if !(whole && (oldest..=newest).contains(&last)) {
                        enough.store(true, SeqCst);
                        panic!("{poses:?}: {found:?}, told {oldest} to {newest}");
                    }
                }
                enough.store(true, SeqCst);
            });
        }
    }
}
