//! What the world tells every robot: one iceoryx2 blackboard with four entries per slot and one per piece.

use crate::board::{self, Board, Entry, EntryMut, Key, Watched};
use crate::node::{Node, of_world};
use crate::{Result, Sizes};
use iceoryx2::prelude::ZeroCopySend;
use model::RobotIndex;
use protocol::world_to_robot::{Impairment, NeighborList, NeighborRef, Odometry, Piece, SensedList};
use std::cell::{Cell, RefCell};

/// The odometry of a slot, and how often each of its lists was written: who reads the one knows whether to look at the
/// others, which lie elsewhere.
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[repr(C)]
#[type_name("shoal.WorldOdometry.v1")]
pub(crate) struct Told {
    pub(crate) odometry: Odometry,
    pub(crate) neighbors_written: u32,
    pub(crate) sensed_written: u32,
}

/// Entries are numbered by kind, then by slot or piece.
#[derive(Clone, Copy)]
enum Kind {
    Odometry,
    Neighbors,
    Sensed,
    Piece,
    Impairment,
}

fn key(kind: Kind, index: u32) -> Key {
    (kind as Key) << 32 | Key::from(index)
}

/// Makes the board, all of its entries empty. Its memory is written, hence reserved, here.
pub(crate) fn create(node: &Node, sizes: Sizes, incarnation: u32) -> Result<Board> {
    let name = of_world("world", incarnation);
    let mut creator = board::creator(node, &name, sizes.participants_max());
    for robot in 0..sizes.max_robots {
        creator = creator
            .add(key(Kind::Odometry, robot), Told::default())
            .add(key(Kind::Neighbors, robot), NeighborList::EMPTY)
            .add(key(Kind::Sensed, robot), SensedList::EMPTY)
            .add(key(Kind::Impairment, robot), Impairment::default());
    }
    for piece in 0..sizes.pieces() {
        creator = creator.add(key(Kind::Piece, piece), Piece::default());
    }
    board::create(creator, &name)
}

/// Opens the board, which keeps it alive.
pub(crate) fn open(node: &Node, incarnation: u32) -> Result<Board> {
    board::open(node, &of_world("world", incarnation))
}

/// The world's hand on its board. There can be one at a time, and none after a world that was killed.
pub struct WorldWriter {
    odometry: Vec<EntryMut<Told>>,
    /// By slot, how often its lists of neighbours and of things in sight were written.
    written: Vec<[u32; 2]>,
    neighbors: Vec<EntryMut<NeighborList>>,
    sensed: Vec<EntryMut<SensedList>>,
    pieces: Vec<EntryMut<Piece>>,
    impairments: Vec<EntryMut<Impairment>>,
}

impl WorldWriter {
    /// Opens every entry of the board of this incarnation of the world for writing.
    ///
    /// # Errors
    /// When the board is not there, or somebody else writes it.
    pub fn open(node: &Node, sizes: Sizes, incarnation: u32) -> Result<WorldWriter> {
        let name = &of_world("world", incarnation);
        let writer = board::writer(&board::open(node, name)?, name)?;
        fn all<T: Copy + ZeroCopySend + 'static>(
            writer: &iceoryx2::port::writer::Writer<crate::node::Ipc, Key>,
            name: &str,
            kind: Kind,
            count: u32,
            blank: &T,
        ) -> Result<Vec<EntryMut<T>>> {
            (0..count).map(|index| board::entry_mut(writer, name, key(kind, index), blank)).collect()
        }
        Ok(WorldWriter {
            odometry: all(&writer, name, Kind::Odometry, sizes.max_robots, &Told::default())?,
            written: vec![[0; 2]; sizes.max_robots as usize],
            neighbors: all(&writer, name, Kind::Neighbors, sizes.max_robots, &NeighborList::EMPTY)?,
            sensed: all(&writer, name, Kind::Sensed, sizes.max_robots, &SensedList::EMPTY)?,
            pieces: all(&writer, name, Kind::Piece, sizes.pieces(), &Piece::default())?,
            impairments: all(&writer, name, Kind::Impairment, sizes.max_robots, &Impairment::default())?,
        })
    }

    /// Where the robot is: what `fill` makes in place, where older odometry is. What was written of the robot's lists
    /// before is found from here on.
    pub fn odometry(&mut self, index: RobotIndex, fill: impl FnOnce(&mut Odometry)) {
        let [neighbors_written, sensed_written] = self.written[index.at()];
        self.odometry[index.at()].update(|told| {
            fill(&mut told.odometry);
            (told.neighbors_written, told.sensed_written) = (neighbors_written, sensed_written);
        });
    }

    /// Whom the robot hears, and whom it will hear, both in the order of robots. To be written when one of them changes,
    /// before its odometry.
    pub fn neighbors(&mut self, index: RobotIndex, neighbors: &[NeighborRef], coming: &[NeighborRef]) {
        self.neighbors[index.at()].update(|list| list.set(neighbors, coming));
        self.hearing_written(index);
    }

    /// What the radio and faults do to the robot. To be written when it changes, before its odometry.
    pub fn impairment(&mut self, index: RobotIndex, impairment: Impairment) {
        self.impairments[index.at()].update(|told| *told = impairment);
        self.hearing_written(index);
    }

    /// Whom a robot hears and how well have one counter: neither changes often.
    fn hearing_written(&mut self, index: RobotIndex) {
        let [neighbors_written, _] = &mut self.written[index.at()];
        *neighbors_written = neighbors_written.wrapping_add(1);
    }

    /// Which pieces the robot sees, sorted. To be written when it changes, before its odometry.
    pub fn sensed(&mut self, index: RobotIndex, pieces: &[u16]) {
        self.sensed[index.at()].update(|list| list.set(pieces));
        let [_, sensed_written] = &mut self.written[index.at()];
        *sensed_written = sensed_written.wrapping_add(1);
    }

    /// Where this piece is: what `fill` makes in place. To be written when it moves.
    pub fn piece(&mut self, index: u32, fill: impl FnOnce(&mut Piece)) {
        self.pieces[index as usize].update(fill);
    }
}

/// A robot's eyes on the world's board.
pub struct WorldReader {
    reader: iceoryx2::port::reader::Reader<crate::node::Ipc, Key>,
    name: String,
    odometry: Entry<Told>,
    neighbors: Entry<NeighborList>,
    sensed: Entry<SensedList>,
    impairment: Entry<Impairment>,
    /// Sorted by index.
    pieces: Vec<(u16, Watched<Piece>)>,
    /// How often the lists were written, as the odometry told last, and as it was when they were handed out.
    written: Cell<[u32; 2]>,
    handed_out: [Option<u32>; 2],
}

impl WorldReader {
    /// Opens the entries of this robot on the board of this incarnation of the world
    /// ([`Gate::world_incarnation`](crate::Gate::world_incarnation)).
    ///
    /// # Errors
    /// When the board is not there, has no such robot, or has no place left for a reader.
    pub fn open(node: &Node, index: RobotIndex, incarnation: u32) -> Result<WorldReader> {
        let name = of_world("world", incarnation);
        let reader = board::reader(&board::open(node, &name)?, &name)?;
        Ok(WorldReader {
            odometry: board::entry(&reader, &name, key(Kind::Odometry, index.0))?,
            neighbors: board::entry(&reader, &name, key(Kind::Neighbors, index.0))?,
            sensed: board::entry(&reader, &name, key(Kind::Sensed, index.0))?,
            impairment: board::entry(&reader, &name, key(Kind::Impairment, index.0))?,
            pieces: Vec::new(),
            written: Cell::default(),
            handed_out: [None; 2],
            reader,
            name,
        })
    }

    /// Where the robot is.
    pub fn odometry(&self) -> Odometry {
        let told = self.odometry.get();
        self.written.set([told.neighbors_written, told.sensed_written]);
        told.odometry
    }

    /// Fills `list` with the robots that it hears, and `coming` with those that it will hear, if the world had written them,
    /// or the robot's [`impairment`](WorldReader::impairment), again when the odometry was last read (or this is the
    /// first look); returns whether it had.
    pub fn neighbors(&mut self, list: &mut Vec<NeighborRef>, coming: &mut Vec<NeighborRef>) -> bool {
        let now = Some(self.written.get()[0]);
        let changed = std::mem::replace(&mut self.handed_out[0], now) != now;
        if changed {
            let told = self.neighbors.get();
            list.clear();
            list.extend_from_slice(told.as_slice());
            coming.clear();
            coming.extend_from_slice(told.coming());
        }
        changed
    }

    /// Which writing of the lists of neighbours the odometry that was last read tells of.
    pub fn neighbors_version(&self) -> u32 {
        self.written.get()[0]
    }

    /// What the radio and faults do to the robot. It is new when [`neighbors`](WorldReader::neighbors) says so.
    pub fn impairment(&self) -> Impairment {
        *self.impairment.get()
    }

    /// Fills `list` with the pieces that it sees, if the world had written them again when the odometry was last read (or
    /// this is the first look); returns whether it had.
    pub fn sensed(&mut self, list: &mut Vec<u16>) -> bool {
        let now = Some(self.written.get()[1]);
        let changed = std::mem::replace(&mut self.handed_out[1], now) != now;
        if changed {
            list.clear();
            list.extend_from_slice(self.sensed.get().as_slice());
        }
        changed
    }

    /// Where this piece is now. What is not on the board (the world never names such a piece) is nowhere, and has no
    /// size. The entry is looked up at the first call and kept; a piece that does not move costs one load.
    pub fn piece(&mut self, index: u16) -> Piece {
        match self.pieces.binary_search_by_key(&index, |(known, _)| *known) {
            Ok(place) => {
                let (_, watched) = &mut self.pieces[place];
                watched.refresh();
                *watched.value()
            }
            Err(place) => match board::entry(&self.reader, &self.name, key(Kind::Piece, u32::from(index))) {
                Ok(entry) => {
                    self.pieces.insert(place, (index, Watched::new(entry)));
                    *self.pieces[place].1.value()
                }
                Err(_) => Piece { ax_m: f64::MAX, bx_m: f64::MAX, ..Piece::default() },
            },
        }
    }
}

/// Sees where every robot is, and whom it hears: for `ps` and the like.
pub struct WorldObserver {
    odometry: Vec<Entry<Told>>,
    name: String,
    reader: iceoryx2::port::reader::Reader<crate::node::Ipc, Key>,
    /// The lists of neighbours that have been asked for, by slot.
    neighbors: RefCell<Vec<Option<Entry<NeighborList>>>>,
}

/// What the world told a robot last.
#[derive(Clone, Debug, Default)]
pub struct ToldNeighbors {
    /// Where it is.
    pub odometry: Odometry,
    /// Whom it hears.
    pub neighbors: Vec<NeighborRef>,
    /// Which writing of that list this is, see [`Gate::heard_of`](crate::Gate::heard_of).
    pub version: u32,
}

impl WorldObserver {
    /// Opens the odometry of every robot on the board of this incarnation of the world.
    ///
    /// # Errors
    /// When the board is not there, or has no place left for a reader.
    pub fn open(node: &Node, incarnation: u32) -> Result<WorldObserver> {
        let sizes = Sizes::of(node.address())?;
        let name = of_world("world", incarnation);
        let reader = board::reader(&board::open(node, &name)?, &name)?;
        let odometry = (0..sizes.max_robots).map(|robot| board::entry(&reader, &name, key(Kind::Odometry, robot)));
        let odometry = odometry.collect::<Result<Vec<_>>>()?;
        let neighbors = RefCell::new(odometry.iter().map(|_| None).collect());
        Ok(WorldObserver { odometry, name, reader, neighbors })
    }

    /// What the robot was told last of itself and of its neighbours. `None` while the world is writing it, or if it cannot be
    /// read.
    pub fn told(&self, index: RobotIndex) -> Option<ToldNeighbors> {
        let before = self.odometry[index.at()].get();
        let mut lists = self.neighbors.borrow_mut();
        let entry = match &mut lists[index.at()] {
            Some(entry) => entry,
            none => none.insert(board::entry(&self.reader, &self.name, key(Kind::Neighbors, index.0)).ok()?),
        };
        let neighbors = entry.get().as_slice().to_vec();
        let told = self.odometry[index.at()].get();
        let version = told.neighbors_written;
        (version == before.neighbors_written).then(|| ToldNeighbors { odometry: told.odometry, neighbors, version })
    }

    /// Where the robot is.
    pub fn odometry(&self, index: RobotIndex) -> Odometry {
        self.odometry[index.at()].get().odometry
    }
}
