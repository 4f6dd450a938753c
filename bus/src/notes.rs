//! What agents note of their steps, where a run is recorded: a ring in a file for each, from the agent to the process that
//! writes the record. A full ring loses the note, which is said with the next one; no process waits, and a note costs no system call.

use crate::ring::Ring;
use crate::{Address, BusError, Result};
use model::RobotInstance;
use protocol::inputs::AgentNote;

/// Name of the file in the root of a run that says where its record goes, if it is recorded.
pub const RECORD_FILE: &str = "record";
const DIRECTORY: &str = "notes";
/// A step is noted in about six bytes per neighbour: room for some hundred steps.
const BYTES: usize = 64 * 1024;
const BYTES_PER_ROBOT: usize = 1024;

/// Memory of the rings of this number of robots, bytes, with rings of earlier incarnations that the recorder has not emptied yet.
pub(crate) fn bytes_needed(max_robots: u32) -> u64 {
    let robots = u64::from(max_robots);
    robots * (BYTES as u64 + BYTES_PER_ROBOT as u64 * robots) * 5 / 4
}

/// Whether the run in this root is recorded.
pub fn is_recorded(address: &Address) -> bool {
    address.file(RECORD_FILE).exists()
}

/// An agent's end.
pub struct NoteWriter {
    ring: Ring,
    buffer: Vec<u8>,
    lost: u64,
}

impl NoteWriter {
    /// Makes the ring of this robot instance in a fleet that can hold `max_robots`.
    ///
    /// # Errors
    /// When shared memory is full or not accessible.
    pub fn create(address: &Address, instance: RobotInstance, max_robots: u32) -> Result<NoteWriter> {
        let directory = address.file(DIRECTORY);
        match std::fs::create_dir(&directory) {
            Err(e) if e.kind() != std::io::ErrorKind::AlreadyExists => {
                return Err(BusError::io(&directory, "make the directory of the notes", e));
            }
            _ => {}
        }
        let name = name(instance);
        Ring::create(address, &name, BYTES + BYTES_PER_ROBOT * max_robots as usize)?;
        Ok(NoteWriter { ring: Ring::open(address, &name)?, buffer: Vec::new(), lost: 0 })
    }

    /// Hands a note over, or loses it.
    pub fn note(&mut self, note: &AgentNote) {
        if self.lost > 0 && self.push(&AgentNote::Lost(self.lost)) {
            self.lost = 0;
        }
        if self.lost > 0 || !self.push(note) {
            self.lost += 1;
        }
    }

    fn push(&mut self, note: &AgentNote) -> bool {
        self.buffer.clear();
        note.encode(&mut self.buffer);
        self.ring.push(&self.buffer)
    }
}

/// The other end of all rings of a fleet.
pub struct NoteReaders {
    address: Address,
    rings: Vec<Source>,
}

/// The ring of an agent.
struct Source {
    instance: RobotInstance,
    ring: Ring,
    /// A later life of its robot has come: this one has ended, and what it has noted is there.
    has_ended: bool,
}

impl NoteReaders {
    /// Of the fleet in this root, whose agents come and go.
    pub fn new(address: &Address) -> NoteReaders {
        NoteReaders { address: address.clone(), rings: Vec::new() }
    }

    /// An agent has come. Its ring has no name any more from now on, and is gone when both ends have let it go. One that does not
    /// note anything has none.
    pub fn open(&mut self, instance: RobotInstance) {
        let name = name(instance);
        if let Ok(ring) = Ring::open(&self.address, &name) {
            let _ = std::fs::remove_file(self.address.file(&name));
            // A process ends before the next one of its robot starts.
            for source in self.rings.iter_mut().filter(|source| source.instance.index == instance.index) {
                source.has_ended = true;
            }
            self.rings.push(Source { instance, ring, has_ended: false });
        }
    }

    /// Takes all notes that are there: `put` gets each, as bytes.
    pub fn drain(&mut self, put: &mut dyn FnMut(RobotInstance, &[u8])) {
        self.rings.retain(|source| {
            while let Some(note) = source.ring.pop() {
                put(source.instance, &note);
            }
            !source.has_ended
        });
    }
}

fn name(instance: RobotInstance) -> String {
    format!("{DIRECTORY}/{}-{}", instance.index, instance.incarnation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clean;
    use model::RobotIndex;

    fn instance(index: u32, incarnation: u32) -> RobotInstance {
        RobotInstance { index: RobotIndex(index), incarnation }
    }

    fn taken(readers: &mut NoteReaders) -> Vec<(u32, u32, AgentNote)> {
        let mut notes = Vec::new();
        readers.drain(&mut |who, bytes| {
            notes.push((who.index.0, who.incarnation, AgentNote::decode(bytes).unwrap()));
        });
        notes
    }

    const BEGAN: AgentNote = AgentNote::Began { is_own: false };

    #[test]
    fn notes_come_in_order_and_what_finds_no_room_is_counted() {
        let address = Address::create().unwrap();
        let mut readers = NoteReaders::new(&address);
        assert_eq!(taken(&mut readers), [], "no agent is there");
        let mut writer = NoteWriter::create(&address, instance(3, 0), 1).unwrap();
        writer.note(&BEGAN);
        readers.open(instance(3, 0));
        assert_eq!(taken(&mut readers), [(3, 0, BEGAN)]);
        // Each takes sixteen bytes.
        let room = (BYTES + BYTES_PER_ROBOT) / 16;
        (0..room + 7).for_each(|_| writer.note(&BEGAN));
        assert_eq!(taken(&mut readers).len(), room);
        writer.note(&BEGAN);
        assert_eq!(taken(&mut readers), [(3, 0, AgentNote::Lost(7)), (3, 0, BEGAN)]);
        clean::sweep(&address);
    }

    #[test]
    fn a_dead_agent_is_heard_out_and_its_ring_let_go() {
        let address = Address::create().unwrap();
        let mut readers = NoteReaders::new(&address);
        let mut first = NoteWriter::create(&address, instance(0, 0), 4).unwrap();
        first.note(&BEGAN);
        drop(first);
        readers.open(instance(0, 0));
        let mut second = NoteWriter::create(&address, instance(0, 1), 4).unwrap();
        second.note(&BEGAN);
        readers.open(instance(0, 1));
        readers.open(instance(7, 0));
        assert_eq!(taken(&mut readers), [(0, 0, BEGAN), (0, 1, BEGAN)]);
        assert_eq!((taken(&mut readers).len(), readers.rings.len()), (0, 1));
        assert_eq!(std::fs::read_dir(address.file(DIRECTORY)).unwrap().count(), 0, "nothing is left behind");
        clean::sweep(&address);
    }
}
