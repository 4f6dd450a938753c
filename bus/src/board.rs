//! What the two kinds of boards share: an iceoryx2 blackboard whose entries are found by a number.

use crate::node::{Ipc, Node};
use crate::{BusError, Result};
use iceoryx2::port::reader::{BlackboardValue, EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::ZeroCopySend;
use iceoryx2::service::builder::blackboard::Creator;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use std::fmt::Debug;

/// Names an entry of a board.
pub(crate) type Key = u64;
pub(crate) type Board = PortFactory<Ipc, Key>;
pub(crate) type Entry<T> = EntryHandle<Ipc, Key, T>;
pub(crate) type EntryMut<T> = EntryHandleMut<Ipc, Key, T>;

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

pub(crate) fn entry_mut<T: Copy + ZeroCopySend + 'static>(
    writer: &Writer<Ipc, Key>,
    name: &str,
    key: Key,
) -> Result<EntryMut<T>> {
    writer.entry::<T>(&key).map_err(|e| BusError::port(object(name), "find an entry to write", e))
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

/// An entry that is copied only when it has changed. Looking is one plain load of a shared word; reading is a copy and
/// a locked exchange on it, which all readers of the entry share.
pub(crate) struct Watched<T: Copy + 'static> {
    entry: Entry<T>,
    // Boxed: values are kilobytes.
    value: Box<BlackboardValue<T>>,
}

impl<T: Copy + 'static> Watched<T> {
    pub(crate) fn new(entry: Entry<T>) -> Watched<T> {
        let value = Box::new(entry.get());
        Watched { entry, value }
    }

    /// Fetches the newest value; whether it is another one than before.
    pub(crate) fn refresh(&mut self) -> bool {
        let changed = !self.entry.is_up_to_date(&self.value);
        if changed {
            *self.value = self.entry.get();
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
