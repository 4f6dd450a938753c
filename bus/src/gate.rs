//! The gate: how the world opens a tick and learns that every robot has answered, with one system call per robot.
//!
//! It is a file of a few cache lines that everybody maps. Futexes are process-shared. All of it is atomics; nobody
//! ever holds a lock, so nobody can die holding one.
//!
//! # Why no wake-up is lost
//!
//! *Agents* sleep on `turn`, which changes with every tick, with the meeting, the start and the stop, and only after the words
//! that say what happened. An agent loads `turn`, then looks at those words, then sleeps "if `turn` is still that".
//! Whatever happens before its load it sees; whatever happens after makes the kernel refuse the sleep, or wakes it.
//!
//! *The world* sleeps on `bell` in the same way. Who rings, and after what:
//! - [`Gate::ring_world`], [`Gate::announce_ready`], [`Gate::announce_met`] and [`Gate::stop`] count up `calls`, then ring.
//! - An agent that answers stores its slot, then counts `counter` down **if that is for its tick** (the tick is half of
//!   the word, so one compare-and-swap decides both), and rings if it was the last one.
//!
//! The world loads `bell`, then looks at `calls` and `counter`, then sleeps "if `bell` is still that": the argument of
//! the agents. A ring that changes neither (the late ring of a tick that is over) sends it back to sleep. What is left is that `counter` may not count what the world waits for:
//! - Too high: an agent died before it answered, or between its slot and its decrement. Then no answer is the last.
//! - Too low: an agent answered that the world did not expect, so it reaches zero early. Then the last answer finds
//!   zero already.
//!
//! Both are noticed in the same way: a wait for this tick has returned, and the world waits for the same tick again.
//! From then on every answer of this tick rings, because the world sets the flag `EACH` in `counter`, and returns once more
//! so that its caller looks at the slots *after* that. An agent's decrement and this are exchanges on one word, hence
//! ordered: if the agent's comes first, the world's exchange acquires it, and the slot stored before it is seen by that
//! look; if it comes second, it sees the flag and rings. In this state the world compares `bell` with what it was when
//! the last wait returned, so that a ring during the caller's look is not lost either.
//! An answer that finds the counter at zero rings too. So an early zero costs a look, and never a wake-up.
//!
//! Two deaths leave the world asleep until its time-out, which is why every wait has one: an agent killed between its
//! last decrement and its ring, and one killed between its slot and its decrement with nobody told. The daemon learns
//! of a death from the kernel, and rings.
//!
//! # Limits
//!
//! Words that must change in one piece with something else hold the lower 32 bits of a tick. They are compared for
//! equality only, so a mistake takes an answer that is exactly 2^32 ticks late.

use crate::clock::{now_ns, timespec};
use crate::map::Mapping;
use crate::{Address, Result};
use model::{Rate, RobotIndex, RobotInstance};
use rustix::thread::futex;
use std::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64};
use std::time::Duration;

pub(crate) const FILE: &str = "gate";
const MAGIC: u64 = u64::from_le_bytes(*b"shoalGt1");

// Lines of 64 bytes. What one side writes often does not share a line with what the other side reads often.
const MAX_ROBOTS: usize = 8;
const TURN: usize = 64;
const STOP: usize = 68;
/// The open tick plus one; zero before the first.
const TICK: usize = 72;
/// When the tick was opened: one word for even ticks, one for odd ones, so that a slow reader of tick k does not find
/// the time of k + 1.
const STAMPS: [usize; 2] = [80, 88];
const START: usize = 96;
const OVER: usize = 104;
const MEETING: usize = 108;
/// The incarnation of the world whose board and frames count.
const WORLD: usize = 112;
/// Whether no tick opens without an operator.
const PAUSED: usize = 116;
/// The bits of the factor of the rate; 0 if there is none.
const RATE: usize = 120;
const COUNTER: usize = 128;
const BELL: usize = 192;
const CALLS: usize = 196;
const PROGRESS: usize = 256;
const SLOTS: usize = 320;
const SLOT_SIZE: usize = 64;
/// In a slot: the incarnation that is ready, plus one.
const READY: usize = 0;
/// In a slot: incarnation and lower half of the tick of the newest answer.
const ANSWER: usize = 8;
/// In a slot: counts signs of life of a robot that nobody waits for. Only its own process writes it.
const SIGNS: usize = 16;
/// In a slot: the incarnation, which list of neighbours its robot had in its newest step (16 bits), and how many of them it heard
/// (16 bits).
const HEARD: usize = 24;
/// In a slot: the incarnation that has met its neighbours, plus one.
const MET: usize = 32;
/// In a slot: the incarnation that announced itself, and the number of its process.
const PROCESS: usize = 40;
/// In a slot: the incarnation that cannot hear somebody it should, plus one, and that one's slot.
const DEAF: usize = 48;
/// When each of the last ticks was opened, for observers; behind the slots.
const TRACE: usize = 1024;

/// In the counter: ring for each answer, not only for the last one.
const EACH: u64 = 1 << 31;
const REMAINING: u64 = EACH - 1;
/// No instance has this incarnation and answers this tick.
const NEVER: u64 = u64::MAX;

/// What [`Gate::wait_tick`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TickWait {
    /// A tick is open that the caller has not seen. It is the newest one: a robot that slept misses ticks.
    Open {
        /// The tick.
        tick: u64,
        /// When the world opened it, monotonic clock, ns.
        stamp_ns: u64,
    },
    /// The run is over.
    Stopped,
    /// Nothing within the time-out.
    TimedOut,
}

/// Whether times are measured in this tick of a `lockstep` run: in one of sixteen. What the world and every robot count
/// into lies on many pages, and touching them in every tick would cost more than planning does.
pub fn is_measured(tick: u64) -> bool {
    tick.is_multiple_of(16)
}

/// Where the run is, for a live line. The fields are written one by one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The newest tick.
    pub tick: u64,
    /// Robots in the world.
    pub robots: u32,
    /// Robots that have arrived.
    pub arrived: u32,
    /// Contacts so far.
    pub contacts: u64,
    /// When this was written, monotonic clock, ns.
    pub stamp_ns: u64,
}

/// The gate of a fleet, as one process maps it.
///
/// Of the world's methods, only one thread of one process may call them; the others are for everybody.
pub struct Gate {
    map: Mapping,
    max_robots: u32,
    /// What the world remembers between two waits. Relaxed atomics, so that a gate can be shared by threads.
    heard_bell: AtomicU32,
    heard_calls: AtomicU32,
    /// The tick that a wait has returned for, plus one.
    waited: AtomicU64,
    /// That tick's counter has [`EACH`].
    each: AtomicBool,
}

impl Gate {
    /// Makes the gate of a fleet. Its memory is reserved at once.
    ///
    /// # Errors
    /// When shared memory is full or not accessible.
    pub fn create(address: &Address, max_robots: u32) -> Result<Gate> {
        let len = SLOTS + max_robots as usize * SLOT_SIZE + TRACE * 8;
        let map = Mapping::create(address, FILE, len, |map| {
            map.u32_at(MAX_ROBOTS).store(max_robots, Relaxed);
            for slot in 0..max_robots as usize {
                map.u64_at(SLOTS + slot * SLOT_SIZE + ANSWER).store(NEVER, Relaxed);
            }
            map.u64_at(0).store(MAGIC, Release);
        })?;
        Ok(Gate::on(map))
    }

    /// Maps the gate of a fleet.
    ///
    /// # Errors
    /// When there is none, or it is not of this build.
    pub fn open(address: &Address) -> Result<Gate> {
        Mapping::open(address, FILE, MAGIC).map(Gate::on)
    }

    fn on(map: Mapping) -> Gate {
        let room = map.len().saturating_sub(SLOTS + TRACE * 8) / SLOT_SIZE;
        let max_robots = map.u32_at(MAX_ROBOTS).load(Relaxed).min(u32::try_from(room).unwrap_or(u32::MAX));
        // One less than they are: the first wait returns once too often rather than miss a call from before.
        let heard = |at: usize| AtomicU32::new(map.u32_at(at).load(Acquire).wrapping_sub(1));
        let (heard_bell, heard_calls) = (heard(BELL), heard(CALLS));
        Gate { map, max_robots, heard_bell, heard_calls, waited: AtomicU64::new(0), each: AtomicBool::new(false) }
    }

    // ---- the world's side

    /// Opens a tick: `expected` robots are to answer it. The boards must be written before.
    pub fn open_tick(&self, tick: u64, expected: u32, stamp_ns: u64) {
        // A late decrement for an older tick fails from here on.
        self.map.u64_at(COUNTER).store(half(tick) << 32 | u64::from(expected), Release);
        self.map.u64_at(STAMPS[(tick & 1) as usize]).store(stamp_ns, Release);
        self.trace(tick).store(stamp_ns, Relaxed);
        self.map.u64_at(TICK).store(tick + 1, Release);
        self.turn();
    }

    /// Sleeps until all that were expected have answered this tick, or something else wants the world's attention, or
    /// the time-out is over. It promises nothing: the caller looks at the slots ([`Gate::answered`]) and at its orders
    /// after every return, and calls again if it still misses somebody.
    pub fn wait_answers(&self, tick: u64, timeout: Duration) {
        let again = self.waited.swap(tick + 1, Relaxed) == tick + 1;
        if !again {
            self.each.store(false, Relaxed);
        }
        let deadline_ns = now_ns().saturating_add(clamp_ns(timeout));
        let (bell_word, counter) = (self.map.u32_at(BELL), self.map.u64_at(COUNTER));
        loop {
            let bell = bell_word.load(Acquire);
            let calls = self.map.u32_at(CALLS).load(Acquire);
            // What was rung for before this load, the caller sees when it looks; what is rung for later differs from it.
            let rung = self.heard_bell.swap(bell, Relaxed) != bell;
            if self.heard_calls.swap(calls, Relaxed) != calls {
                return;
            }
            if again {
                if !self.each.swap(true, Relaxed) {
                    let _ = counter.fetch_update(AcqRel, Acquire, |c| (c >> 32 == half(tick)).then_some(c | EACH));
                    return;
                }
                if rung {
                    return;
                }
            } else {
                let counter = counter.load(Acquire);
                if counter >> 32 == half(tick) && counter & REMAINING == 0 {
                    return;
                }
            }
            let Some(left) = deadline_ns.checked_sub(now_ns()).filter(|&left| left > 0) else { return };
            // EAGAIN, EINTR and a wake-up are all the same: look again.
            let _ = futex::wait(bell_word, futex::Flags::empty(), bell, Some(&timespec(left)));
        }
    }

    /// Sleeps until somebody calls the world ([`Gate::ring_world`], an agent that has become ready, the stop), or the
    /// time-out is over. A call since the last wait returns at once.
    pub fn wait_call(&self, timeout: Duration) {
        let deadline_ns = now_ns().saturating_add(clamp_ns(timeout));
        let bell_word = self.map.u32_at(BELL);
        loop {
            let bell = bell_word.load(Acquire);
            let calls = self.map.u32_at(CALLS).load(Acquire);
            if self.heard_calls.swap(calls, Relaxed) != calls {
                return;
            }
            let Some(left) = deadline_ns.checked_sub(now_ns()).filter(|&left| left > 0) else { return };
            let _ = futex::wait(bell_word, futex::Flags::empty(), bell, Some(&timespec(left)));
        }
    }

    /// Whether this instance has answered this tick.
    pub fn answered(&self, instance: RobotInstance, tick: u64) -> bool {
        self.slot(instance.index, ANSWER).is_some_and(|word| word.load(Acquire) == answer_of(instance, tick))
    }

    /// Whether the agent of this instance has said that it is ready.
    pub fn is_ready(&self, instance: RobotInstance) -> bool {
        self.slot(instance.index, READY).is_some_and(|word| word.load(Acquire) == u64::from(instance.incarnation) + 1)
    }

    /// Before the start of a `realtime` run: everybody is ready, and whom each robot will hear is on its board. The agents
    /// may open the boards of those while no period is running.
    pub fn call_meeting(&self) {
        self.map.u32_at(MEETING).store(1, Release);
        self.turn();
    }

    /// Whether the agent of this instance has opened those boards.
    pub fn has_met(&self, instance: RobotInstance) -> bool {
        self.slot(instance.index, MET).is_some_and(|word| word.load(Acquire) == u64::from(instance.incarnation) + 1)
    }

    /// How many signs of life ([`Gate::note_alive`]) the agents of this instance's slot have given. It changes while the
    /// process runs, and stands still while it does not.
    pub fn signs(&self, instance: RobotInstance) -> u64 {
        self.slot(instance.index, SIGNS).map_or(0, |word| word.load(Relaxed))
    }

    /// Says where the run is. No system call.
    pub fn set_progress(&self, progress: Progress) {
        let words = [
            progress.tick,
            u64::from(progress.robots) << 32 | u64::from(progress.arrived),
            progress.contacts,
            progress.stamp_ns,
        ];
        for (i, word) in words.into_iter().enumerate() {
            self.map.u64_at(PROGRESS + 8 * i).store(word, Relaxed);
        }
    }

    /// Says whether ticks of `lockstep` open without an operator, and at which rate.
    pub fn set_pace(&self, paused: bool, rate: Rate) {
        self.map.u32_at(PAUSED).store(paused.into(), Relaxed);
        self.map.u64_at(RATE).store(rate.factor().map_or(0, f64::to_bits), Relaxed);
    }

    /// The world's process of this incarnation goes on: its board is written, and robots read that from the next tick on.
    pub fn set_world_incarnation(&self, incarnation: u32) {
        self.map.u32_at(WORLD).store(incarnation, Release);
    }

    // ---- an agent's side

    /// Says which process is the agent of this instance: the caller. Behind a wrapper it is not the one that was started.
    pub fn announce_process(&self, instance: RobotInstance) {
        if let Some(word) = self.slot(instance.index, PROCESS) {
            word.store(u64::from(instance.incarnation) << 32 | u64::from(std::process::id()), Release);
        }
    }

    /// Says that this robot cannot hear the robot `to`, and that its process therefore ends.
    pub fn announce_deaf(&self, instance: RobotInstance, to: RobotIndex) {
        if let Some(word) = self.slot(instance.index, DEAF) {
            word.store((u64::from(instance.incarnation) + 1) << 32 | u64::from(to.0), Release);
        }
    }

    /// Says that this instance can take part from now on, and tells the world.
    pub fn announce_ready(&self, instance: RobotInstance) {
        if let Some(word) = self.slot(instance.index, READY) {
            word.store(u64::from(instance.incarnation) + 1, Release);
        }
        self.ring_world();
    }

    /// Sleeps until a tick is open that is not `after`, or the run is over, or the time-out is.
    pub fn wait_tick(&self, after: Option<u64>, timeout: Duration) -> TickWait {
        self.sleep_until(timeout, || {
            if self.stopped() {
                return Some(TickWait::Stopped);
            }
            let (tick, stamp_ns) = self.newest()?;
            (after != Some(tick)).then_some(TickWait::Open { tick, stamp_ns })
        })
        .unwrap_or(TickWait::TimedOut)
    }

    /// Answers a tick: everything this robot wrote before is visible to whoever sees the answer.
    pub fn answer(&self, instance: RobotInstance, tick: u64) {
        let Some(word) = self.slot(instance.index, ANSWER) else { return };
        word.store(answer_of(instance, tick), Release);
        let counted = self.map.u64_at(COUNTER).fetch_update(AcqRel, Acquire, |c| {
            (c >> 32 == half(tick)).then(|| if c & REMAINING == 0 { c } else { c - 1 })
        });
        // An answer for an older tick counts nowhere, and nobody waits for it.
        if let Ok(before) = counted
            && (before & REMAINING <= 1 || before & EACH != 0)
        {
            self.ring();
        }
    }

    /// Says that this robot's process is alive although nobody waits for it: it is held, or there are no ticks to answer.
    pub fn note_alive(&self, instance: RobotInstance) {
        if let Some(word) = self.slot(instance.index, SIGNS) {
            word.store(word.load(Relaxed).wrapping_add(1), Relaxed);
        }
    }

    /// Says how many neighbours this robot heard in the step that it is about to answer, of the list that the world wrote
    /// as this version. No system call.
    pub fn note_heard(&self, instance: RobotInstance, version: u32, neighbors: usize) {
        if let Some(word) = self.slot(instance.index, HEARD) {
            let heard = u64::from(version & 0xffff) << 16 | (neighbors as u64).min(0xffff);
            word.store(u64::from(instance.incarnation) << 32 | heard, Relaxed);
        }
    }

    /// Sleeps until the meeting is called, or the run is over, or the time-out is; true in the first case.
    pub fn wait_meeting(&self, timeout: Duration) -> bool {
        let called = || self.map.u32_at(MEETING).load(Acquire) != 0;
        self.sleep_until(timeout, || if self.stopped() { Some(false) } else { called().then_some(true) }) == Some(true)
    }

    /// Says that this instance has opened the boards of those whom it will hear first, and tells the world.
    pub fn announce_met(&self, instance: RobotInstance) {
        if let Some(word) = self.slot(instance.index, MET) {
            word.store(u64::from(instance.incarnation) + 1, Release);
        }
        self.ring_world();
    }

    /// Sleeps until the common time base is known, or the run is over, or the time-out is; `None` in the latter cases.
    pub fn wait_start(&self, timeout: Duration) -> Option<u64> {
        self.sleep_until(timeout, || if self.stopped() { Some(None) } else { self.start_ns().map(Some) }).flatten()
    }

    // ---- everybody's

    /// Ends the run, and wakes everybody to see it.
    pub fn stop(&self) {
        self.map.u32_at(STOP).store(1, Release);
        self.turn();
        self.ring_world();
    }

    /// Whether the run is over.
    pub fn stopped(&self) -> bool {
        self.map.u32_at(STOP).load(Acquire) != 0
    }

    /// The world: the last tick is over. Nobody need go on, and nothing counts any more; the processes end at the stop.
    pub fn set_over(&self) {
        self.map.u32_at(OVER).store(1, Release);
    }

    /// Whether the last tick is over.
    pub fn over(&self) -> bool {
        self.map.u32_at(OVER).load(Acquire) != 0
    }

    /// Makes the world look at its orders, now or at its next wait.
    pub fn ring_world(&self) {
        self.map.u32_at(CALLS).fetch_add(1, AcqRel);
        self.ring();
    }

    /// Sets the common time base of a `realtime` run, monotonic clock, ns, not zero.
    pub fn set_start(&self, start_ns: u64) {
        self.map.u64_at(START).store(start_ns, Release);
        self.turn();
    }

    /// The common time base, once it is set.
    pub fn start_ns(&self) -> Option<u64> {
        Some(self.map.u64_at(START).load(Acquire)).filter(|&ns| ns != 0)
    }

    /// Where the run is. No system call.
    pub fn progress(&self) -> Progress {
        let word = |i: usize| self.map.u64_at(PROGRESS + 8 * i).load(Relaxed);
        let (robots, arrived) = ((word(1) >> 32) as u32, word(1) as u32);
        Progress { tick: word(0), robots, arrived, contacts: word(2), stamp_ns: word(3) }
    }

    /// Whether ticks of `lockstep` open without an operator, and at which rate.
    pub fn pace(&self) -> (bool, Rate) {
        let factor = f64::from_bits(self.map.u64_at(RATE).load(Relaxed));
        let rate = if factor > 0.0 { Rate::Factor(factor) } else { Rate::Max };
        (self.map.u32_at(PAUSED).load(Relaxed) != 0, rate)
    }

    /// How often the world's process was replaced: the boards and frames of the present one have this in their names.
    pub fn world_incarnation(&self) -> u32 {
        self.map.u32_at(WORLD).load(Acquire)
    }

    /// The process that announced itself as the agent of this instance. It may have ended since.
    pub fn process(&self, instance: RobotInstance) -> Option<u32> {
        let word = self.slot(instance.index, PROCESS)?.load(Acquire);
        let pid = (word & u64::from(u32::MAX)) as u32;
        (word >> 32 == u64::from(instance.incarnation) && pid != 0).then_some(pid)
    }

    /// The robot that the agent of this instance could not hear, if it ended because of that.
    pub fn deaf_to(&self, instance: RobotInstance) -> Option<RobotIndex> {
        let word = self.slot(instance.index, DEAF)?.load(Acquire);
        (word >> 32 == u64::from(instance.incarnation) + 1).then_some(RobotIndex(word as u32))
    }

    /// How many neighbours this instance heard in its newest step; 0 before the first.
    pub fn heard(&self, instance: RobotInstance) -> usize {
        self.heard_word(instance).map_or(0, |word| (word & 0xffff) as usize)
    }

    /// How many neighbours this instance heard in its newest step, if its list of them was the one of this version.
    pub fn heard_of(&self, instance: RobotInstance, version: u32) -> Option<usize> {
        let word = self.heard_word(instance)?;
        (word >> 16 & 0xffff == u64::from(version & 0xffff)).then_some((word & 0xffff) as usize)
    }

    /// What the instance said in its newest step; `None` before the first. A step without neighbours before anything was
    /// ever listed looks like none.
    fn heard_word(&self, instance: RobotInstance) -> Option<u64> {
        let word = self.slot(instance.index, HEARD)?.load(Relaxed);
        (word >> 32 == u64::from(instance.incarnation)).then_some(word)
    }

    /// The open tick, or the last one that was; `None` before the first.
    pub fn newest_tick(&self) -> Option<u64> {
        self.map.u64_at(TICK).load(Acquire).checked_sub(1)
    }

    /// When this tick was opened, if it is among the newest [`Gate::TRACED`]; a tick that is older or to come has the
    /// time of another one.
    pub fn opened_ns(&self, tick: u64) -> u64 {
        self.trace(tick).load(Relaxed)
    }

    /// How many ticks back [`Gate::opened_ns`] knows.
    pub const TRACED: u64 = TRACE as u64;

    /// How many slots it has.
    pub fn max_robots(&self) -> u32 {
        self.max_robots
    }

    /// The open tick and its time. The time is overwritten by the next tick but one, and only after the next one was
    /// opened: if the tick is still the same after reading the time, they belong together.
    fn newest(&self) -> Option<(u64, u64)> {
        let word = self.map.u64_at(TICK);
        let mut opened = word.load(Acquire);
        loop {
            let tick = opened.checked_sub(1)?;
            let stamp_ns = self.map.u64_at(STAMPS[(tick & 1) as usize]).load(Acquire);
            match word.load(Acquire) {
                same if same == opened => return Some((tick, stamp_ns)),
                newer => opened = newer,
            }
        }
    }

    fn trace(&self, tick: u64) -> &AtomicU64 {
        self.map.u64_at(self.map.len() - TRACE * 8 + (tick % TRACE as u64) as usize * 8)
    }

    fn turn(&self) {
        let turn = self.map.u32_at(TURN);
        turn.fetch_add(1, AcqRel);
        let _ = futex::wake(turn, futex::Flags::empty(), i32::MAX as u32);
    }

    fn ring(&self) {
        let bell = self.map.u32_at(BELL);
        bell.fetch_add(1, AcqRel);
        let _ = futex::wake(bell, futex::Flags::empty(), 1);
    }

    /// The time-out is that of one sleep: somebody who is woken looks, and sleeps again as long as he likes.
    fn sleep_until<T>(&self, timeout: Duration, look: impl Fn() -> Option<T>) -> Option<T> {
        let turn = self.map.u32_at(TURN);
        let timeout = timespec(clamp_ns(timeout));
        loop {
            let seen = turn.load(Acquire);
            if let Some(found) = look() {
                return Some(found);
            }
            // EAGAIN, EINTR and a wake-up are all the same: look again.
            if futex::wait(turn, futex::Flags::empty(), seen, Some(&timeout)) == Err(rustix::io::Errno::TIMEDOUT) {
                return look();
            }
        }
    }

    fn slot(&self, index: RobotIndex, word: usize) -> Option<&AtomicU64> {
        debug_assert!(index.0 < self.max_robots, "robot {index} of {}", self.max_robots);
        (index.0 < self.max_robots).then(|| self.map.u64_at(SLOTS + index.at() * SLOT_SIZE + word))
    }
}

impl std::fmt::Debug for Gate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gate").field("max_robots", &self.max_robots).field("progress", &self.progress()).finish()
    }
}

/// The lower half of a tick.
fn half(tick: u64) -> u64 {
    tick & u64::from(u32::MAX)
}

fn answer_of(instance: RobotInstance, tick: u64) -> u64 {
    u64::from(instance.incarnation) << 32 | half(tick)
}

fn clamp_ns(timeout: Duration) -> u64 {
    // A day: what is longer is a mistake, and would not fit a timespec for ever.
    u64::try_from(timeout.as_nanos()).unwrap_or(u64::MAX).min(86_400_000_000_000)
}

#[cfg(test)]
pub(crate) mod layout;
#[cfg(test)]
mod tests;
