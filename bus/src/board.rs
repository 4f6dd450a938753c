//! What the two kinds of boards share: an iceoryx2 blackboard whose entries are found by a number.

use crate::node::{Ipc, Node};
use crate::{BusError, Result};
use iceoryx2::port::reader::{BlackboardValue, EntryHandle, Reader};
use iceoryx2::port::writer::{EntryValueUninit, Writer};
use iceoryx2::prelude::ZeroCopySend;
use iceoryx2::service::builder::blackboard::Creator;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use std::fmt::Debug;

/// Names an entry of a board.
pub(crate) type Key = u64;
pub(crate) type Board = PortFactory<Ipc, Key>;
pub(crate) type Entry<T> = EntryHandle<Ipc, Key, T>;

/// Starts a board; entries are added to it before it is created.
pub(crate) fn creator(node: &Node, name: &str, participants_max: usize) -> Creator<Key, Ipc> {
    node.service(name).blackboard_creator::<Key>().max_readers(participants_max).max_nodes(participants_max)
}

pub(crate) fn create(creator: Creator<Key, Ipc>, name: &str) -> Result<Board> {
    creator.create().map_err(|e| BusError::port(object(name), "create the board", e))
}

pub(crate) fn open(node: &Node, name: &str) -> Result<Board> {
    let opener = node.service(name).blackboard_opener::<Key>();
    opener.open().map_err(|e| BusError::port(object(name), "open the board", e))
}

pub(crate) fn writer(board: &Board, name: &str) -> Result<Writer<Ipc, Key>> {
    board.writer_builder().create().map_err(|e| BusError::port(object(name), "become the writer", e))
}

pub(crate) fn reader(board: &Board, name: &str) -> Result<Reader<Ipc, Key>> {
    board.reader_builder().create().map_err(|e| BusError::port(object(name), "become a reader", e))
}

/// Becomes the writer of an entry. `blank` is what its unused memory is filled with.
pub(crate) fn entry_mut<T: Copy + ZeroCopySend + 'static>(
    writer: &Writer<Ipc, Key>,
    name: &str,
    key: Key,
    blank: &T,
) -> Result<EntryMut<T>> {
    let entry = writer.entry::<T>(&key).map_err(|e| BusError::port(object(name), "find an entry to write", e))?;
    let mut next = entry.loan_uninit();
    next.value_mut().write(*blank);
    Ok(EntryMut { next: Some(next) })
}

pub(crate) fn entry<T: Copy + ZeroCopySend>(reader: &Reader<Ipc, Key>, name: &str, key: Key) -> Result<Entry<T>> {
    reader.entry::<T>(&key).map_err(|e| BusError::port(object(name), "find an entry to read", e))
}

/// As [`entry`], for what not every board has.
pub(crate) fn entry_if_any<T: Copy + ZeroCopySend>(reader: &Reader<Ipc, Key>, key: Key) -> Option<Entry<T>> {
    // There is no other reason to fail.
    reader.entry::<T>(&key).ok()
}

fn object(name: &str) -> String {
    format!("board `{name}`")
}

/// The writer's end of an entry. An entry has two cells: readers copy out of one while the next value is made in the
/// other, in place. So nothing is copied into an entry that was not made elsewhere.
pub(crate) struct EntryMut<T: Copy + 'static> {
    /// The cell that readers do not look at. Publishing consumes it and gives the other one: it is always there.
    next: Option<EntryValueUninit<Ipc, Key, T>>,
}

impl<T: Copy + 'static> EntryMut<T> {
    /// Publishes what `fill` makes of the next cell, which holds an earlier value: the one before the newest, or a blank
    /// one. What `fill` leaves alone is published as it was.
    pub(crate) fn update<R>(&mut self, fill: impl FnOnce(&mut T) -> R) -> R {
        const LOANED: &str = "the next cell is on loan at any time";
        let next = self.next.as_mut().expect(LOANED);
        // SAFETY: both cells hold a whole `T`. Of the two, the published one was written when the entry was created, and
        // the other one by `entry_mut`, before either was first handed out here. No other handle writes: an entry has one
        // producer at a time. A reader that still copies out of this cell sees by the counter of the entry that the cell
        // is not the published one any more, and copies again.
        let result = fill(unsafe { next.value_mut().assume_init_mut() });
        let filled = self.next.take().expect(LOANED);
        // SAFETY: as above, the value is initialised, whatever `fill` wrote.
        let entry = unsafe { filled.assume_init_and_update() };
        self.next = Some(entry.loan_uninit());
        result
    }
}

/// An entry that is copied only when it has changed. Looking is one plain load of a shared word; reading is a copy and
/// a locked exchange on it, which all readers of the entry share.
pub(crate) struct Watched<T: Copy + 'static> {
    entry: Entry<T>,
    value: BlackboardValue<T>,
}

impl<T: Copy + 'static> Watched<T> {
    pub(crate) fn new(entry: Entry<T>) -> Watched<T> {
        let value = entry.get();
        Watched { entry, value }
    }

    /// Fetches the newest value; whether it is another one than before.
    pub(crate) fn refresh(&mut self) -> bool {
        let changed = !self.entry.is_up_to_date(&self.value);
        if changed {
            self.value = self.entry.get();
        }
        changed
    }

    pub(crate) fn value(&self) -> &T {
        &self.value
    }
}

impl<T: Copy + 'static> Debug for Watched<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watched").finish_non_exhaustive()
    }
}
