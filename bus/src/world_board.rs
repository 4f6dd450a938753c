//! What the world tells every robot: one iceoryx2 blackboard with three entries per slot and one per piece.

use crate::board::{self, Board, Entry, EntryMut, Key, Watched};
use crate::node::Node;
use crate::{Result, Sizes};
use protocol::world_to_robot::{MAX_SENSED, NeighborList, NeighborRef, Odometry, Piece, SensedList};
use std::collections::HashMap;

const NAME: &str = "world";

/// Entries are numbered by kind, then by slot or piece.
#[derive(Clone, Copy)]
enum Kind {
    Odometry,
    Neighbors,
    Sensed,
    Piece,
}

fn key(kind: Kind, index: u32) -> Key {
    (kind as Key) << 32 | Key::from(index)
}

/// Makes the board, all of its entries empty. Its memory is written, hence reserved, here.
pub(crate) fn create(node: &Node, sizes: Sizes) -> Result<Board> {
    let mut creator = board::creator(node, NAME, sizes.participants_max());
    for slot in 0..sizes.max_robots {
        creator = creator
            .add(key(Kind::Odometry, slot), Odometry::default())
            .add(key(Kind::Neighbors, slot), NeighborList::EMPTY)
            .add(key(Kind::Sensed, slot), SensedList::EMPTY);
    }
    for piece in 0..sizes.pieces() {
        creator = creator.add(key(Kind::Piece, piece), Piece::default());
    }
    board::create(creator, NAME)
}

/// The world's hand on its board. There can be one at a time, and none after a world that was killed.
pub struct WorldWriter {
    odometry: Vec<EntryMut<Odometry>>,
    neighbors: Vec<EntryMut<NeighborList>>,
    sensed: Vec<EntryMut<SensedList>>,
    pieces: Vec<EntryMut<Piece>>,
}

impl WorldWriter {
    /// Opens every entry for writing.
    ///
    /// # Errors
    /// When the board is not there, or somebody else writes it.
    pub fn open(node: &Node, sizes: Sizes) -> Result<WorldWriter> {
        let writer = board::writer(&board::open(node, NAME)?, NAME)?;
        fn all<T: Copy + iceoryx2::prelude::ZeroCopySend + 'static>(
            writer: &iceoryx2::port::writer::Writer<crate::node::Ipc, Key>,
            kind: Kind,
            count: u32,
        ) -> Result<Vec<EntryMut<T>>> {
            (0..count).map(|index| board::entry_mut(writer, NAME, key(kind, index))).collect()
        }
        Ok(WorldWriter {
            odometry: all(&writer, Kind::Odometry, sizes.max_robots)?,
            neighbors: all(&writer, Kind::Neighbors, sizes.max_robots)?,
            sensed: all(&writer, Kind::Sensed, sizes.max_robots)?,
            pieces: all(&writer, Kind::Piece, sizes.pieces())?,
        })
    }

    /// Where the robot in this slot is.
    pub fn odometry(&mut self, slot: u32, odometry: Odometry) {
        self.odometry[slot as usize].update_with_copy(odometry);
    }

    /// Whom the robot in this slot hears, sorted by slot. To be written when it changes.
    pub fn neighbors(&mut self, slot: u32, neighbors: &[NeighborRef]) {
        let mut list = NeighborList::EMPTY;
        list.entries[..neighbors.len()].copy_from_slice(neighbors);
        list.len = neighbors.len() as u32;
        self.neighbors[slot as usize].update_with_copy(list);
    }

    /// Which pieces the robot in this slot sees, sorted. To be written when it changes.
    pub fn sensed(&mut self, slot: u32, pieces: &[u16]) {
        debug_assert!(pieces.len() <= MAX_SENSED);
        let mut list = SensedList::EMPTY;
        list.pieces[..pieces.len()].copy_from_slice(pieces);
        list.len = pieces.len() as u32;
        self.sensed[slot as usize].update_with_copy(list);
    }

    /// Where this piece is. To be written when it moves.
    pub fn piece(&mut self, index: u32, piece: Piece) {
        self.pieces[index as usize].update_with_copy(piece);
    }
}

/// A robot's eyes on the world's board.
pub struct WorldReader {
    reader: iceoryx2::port::reader::Reader<crate::node::Ipc, Key>,
    odometry: Entry<Odometry>,
    neighbors: Watched<NeighborList>,
    sensed: Watched<SensedList>,
    pieces: HashMap<u16, Watched<Piece>>,
    /// The lists have not been handed out yet.
    fresh: (bool, bool),
}

impl WorldReader {
    /// Opens the entries of this slot.
    ///
    /// # Errors
    /// When the board is not there, has no such slot, or has no place left for a reader.
    pub fn open(node: &Node, slot: u32) -> Result<WorldReader> {
        let reader = board::reader(&board::open(node, NAME)?, NAME)?;
        Ok(WorldReader {
            odometry: board::entry(&reader, NAME, key(Kind::Odometry, slot))?,
            neighbors: Watched::new(board::entry(&reader, NAME, key(Kind::Neighbors, slot))?),
            sensed: Watched::new(board::entry(&reader, NAME, key(Kind::Sensed, slot))?),
            pieces: HashMap::new(),
            fresh: (true, true),
            reader,
        })
    }

    /// Where the robot is.
    pub fn odometry(&self) -> Odometry {
        *self.odometry.get()
    }

    /// Whom it hears, if that was written since the last call (or this is the first).
    pub fn neighbors(&mut self) -> Option<&[NeighborRef]> {
        let changed = self.neighbors.refresh() | std::mem::take(&mut self.fresh.0);
        changed.then(|| self.neighbors.value().as_slice())
    }

    /// Which pieces it sees, if that was written since the last call (or this is the first).
    pub fn sensed(&mut self) -> Option<&[u16]> {
        let changed = self.sensed.refresh() | std::mem::take(&mut self.fresh.1);
        changed.then(|| self.sensed.value().as_slice())
    }

    /// Where this piece is now. What is not on the board (the world never names such a piece) is nowhere, and has no
    /// size. The entry is looked up at the first call and kept; a piece that does not move costs one load.
    pub fn piece(&mut self, index: u16) -> Piece {
        if let Some(watched) = self.pieces.get_mut(&index) {
            watched.refresh();
            return *watched.value();
        }
        match board::entry(&self.reader, NAME, key(Kind::Piece, u32::from(index))) {
            Ok(entry) => *self.pieces.entry(index).or_insert_with(|| Watched::new(entry)).value(),
            Err(_) => Piece { ax_m: f64::MAX, bx_m: f64::MAX, ..Piece::default() },
        }
    }
}

/// Sees where every robot is: for `ps` and the like.
pub struct WorldObserver {
    odometry: Vec<Entry<Odometry>>,
}

impl WorldObserver {
    /// Opens the odometry of every slot.
    ///
    /// # Errors
    /// When the board is not there, or has no place left for a reader.
    pub fn open(node: &Node) -> Result<WorldObserver> {
        let sizes = Sizes::of(node.address())?;
        let reader = board::reader(&board::open(node, NAME)?, NAME)?;
        let odometry = (0..sizes.max_robots).map(|slot| board::entry(&reader, NAME, key(Kind::Odometry, slot)));
        Ok(WorldObserver { odometry: odometry.collect::<Result<_>>()? })
    }

    /// Where the robot in this slot is.
    pub fn odometry(&self, slot: usize) -> Odometry {
        *self.odometry[slot].get()
    }
}
