//! What the processes of a fleet share: memory, rings, and here also time, chance and the notes that are taken.

use crate::coverage::Coverage;
use crate::dice::{Dice, MS};
use crate::ring::Ring;
use crate::succession::Estate;
use bus::ToldNeighbors;
use daemon::coordinator::Missed;
use model::{RobotIndex, RobotInstance};
use protocol::robot_to_robot::PosePair;
use protocol::robot_to_world::Command;
use protocol::world_to_robot::{Impairment, NeighborRef, Odometry, Piece};
use shoal_tests::Tape;
use std::collections::BTreeMap;

/// A robot's board.
#[derive(Default)]
pub(crate) struct Board {
    pub(crate) poses: PosePair,
    pub(crate) command: Command,
    /// The world can open it.
    pub(crate) is_readable: bool,
}

/// What an agent says of itself in the gate.
#[derive(Clone, Default)]
pub(crate) struct Slot {
    pub(crate) ready: Option<u32>,
    pub(crate) met: Option<u32>,
    pub(crate) answer: Option<(RobotInstance, u64)>,
    pub(crate) signs: u64,
    /// Who said last how many neighbours it heard, and of which list.
    pub(crate) heard: Option<(RobotInstance, u32, usize)>,
}

/// The boards and the gate. The writer of every part is the process that has it in reality.
#[derive(Default)]
pub(crate) struct Memory {
    /// The open tick.
    pub(crate) tick: Option<u64>,
    pub(crate) meeting: bool,
    pub(crate) start_ns: Option<u64>,
    pub(crate) stopped: bool,
    pub(crate) slots: Vec<Slot>,
    pub(crate) odometry: Vec<Odometry>,
    pub(crate) neighbors: Vec<Vec<NeighborRef>>,
    /// By slot, how often its neighbours were written.
    pub(crate) versions: Vec<u32>,
    pub(crate) impairments: Vec<Impairment>,
    pub(crate) sensed: Vec<Vec<u16>>,
    pub(crate) pieces: Vec<Piece>,
    /// By life: a new one has a board of its own.
    pub(crate) boards: BTreeMap<RobotInstance, Board>,
}

impl Memory {
    pub(crate) fn is_ready(&self, instance: RobotInstance) -> bool {
        self.slots[instance.index.at()].ready == Some(instance.incarnation)
    }

    pub(crate) fn has_met(&self, instance: RobotInstance) -> bool {
        self.slots[instance.index.at()].met == Some(instance.incarnation)
    }

    pub(crate) fn answered(&self, instance: RobotInstance, tick: u64) -> bool {
        self.slots[instance.index.at()].answer == Some((instance, tick))
    }

    /// What the world told a robot last of itself and of its neighbours.
    pub(crate) fn told(&self, index: RobotIndex) -> Option<ToldNeighbors> {
        let slot = index.at();
        let (odometry, neighbors) = (self.odometry[slot], self.neighbors[slot].clone());
        Some(ToldNeighbors { odometry, neighbors, version: self.versions[slot] })
    }

    pub(crate) fn heard_of(&self, instance: RobotInstance, version: u32) -> Option<usize> {
        let (who, of, heard) = self.slots[instance.index.at()].heard?;
        (who == instance && of == version).then_some(heard)
    }

    pub(crate) fn signs(&self, instance: RobotInstance) -> u64 {
        self.slots[instance.index.at()].signs
    }
}

/// Who is to be woken by what a process did in its turn.
#[derive(Default)]
pub(crate) struct Calls {
    pub(crate) world: bool,
    pub(crate) daemon: bool,
    pub(crate) agents: bool,
}

/// Everything that a process can reach in its turn, and where time has got to.
pub(crate) struct Shared {
    /// The monotonic clock, ns.
    pub(crate) now: u64,
    pub(crate) dice: Dice,
    pub(crate) memory: Memory,
    pub(crate) orders: Ring,
    pub(crate) notices: Ring,
    /// Notices that found no room: counters that the world writes.
    pub(crate) missed: Missed,
    pub(crate) calls: Calls,
    /// How long the daemon has run, ns: what it slept through while it was stopped is not waiting time.
    pub(crate) daemon_awake_ns: u64,
    /// The world's process has ended.
    pub(crate) world_ended: bool,
    /// The storm is over: nothing bad happens any more.
    pub(crate) calm: bool,
    /// What outlives processes.
    pub(crate) estate: Estate,
    pub(crate) coverage: Coverage,
    pub(crate) trace: u64,
    /// Whether what happens is told, a line each: to find out why a seed fails.
    pub(crate) aloud: bool,
    /// The record of the run.
    pub(crate) tape: Option<Tape>,
}

impl Shared {
    pub(crate) fn new(seed: u64, slots: usize, orders_bytes: usize, notices_bytes: usize) -> Shared {
        let memory = Memory {
            slots: vec![Slot::default(); slots],
            odometry: vec![Odometry::default(); slots],
            neighbors: vec![Vec::new(); slots],
            versions: vec![0; slots],
            impairments: vec![Impairment::default(); slots],
            sensed: vec![Vec::new(); slots],
            ..Memory::default()
        };
        Shared {
            // Some machines have been up for long.
            now: 1_000_000 * MS,
            dice: Dice::new(seed),
            memory,
            orders: Ring::new(orders_bytes),
            notices: Ring::new(notices_bytes),
            missed: Missed::default(),
            calls: Calls::default(),
            daemon_awake_ns: 0,
            world_ended: false,
            calm: false,
            estate: Estate::default(),
            coverage: Coverage::default(),
            trace: seed,
            aloud: false,
            tape: None,
        }
    }

    /// How long a process takes for what it does, ns: mostly little, now and then long.
    pub(crate) fn haste(&mut self) -> u64 {
        match self.dice.below(if self.calm { 50 } else { 60 }) {
            0..40 => self.dice.between_ms(1, 8),
            40..58 => self.dice.between_ms(8, 60),
            58 => self.dice.between_ms(60, 350),
            _ => self.dice.between_ms(200, 1500),
        }
    }

    /// Says what happens.
    #[expect(clippy::print_stderr, reason = "asked for, to see why a seed fails")]
    pub(crate) fn tell(&self, what: impl FnOnce() -> String) {
        if self.aloud {
            eprintln!("{:10.4} {}", (self.now as f64 - 1e12) * 1e-9, what());
        }
    }

    /// Takes a word into the hash of everything that happened.
    pub(crate) fn note(&mut self, word: u64) {
        self.trace = (self.trace.rotate_left(23) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    /// Takes a message into it.
    pub(crate) fn note_bytes(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.note(u64::from_le_bytes(word));
        }
    }
}
