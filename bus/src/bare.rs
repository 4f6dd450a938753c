//! The floor that the gate is measured against: a futex barrier of processes that carries nothing. The same wake
//! pattern (one wake for all, the last one wakes the opener), without slots, boards, deaths or time.
//!
//! Unlike in a fleet, its members wait without a bound: the kernel ends them with whoever started them
//! ([`die_with_parent`](crate::process::die_with_parent)).

use crate::clock::{now_ns, timespec};
use crate::map::Mapping;
use crate::{Address, BusError, Result};
use rustix::thread::futex;
use std::sync::atomic::Ordering::{AcqRel, Acquire, Release};
use std::time::Duration;

const FILE: &str = "bare";
const MAGIC: u64 = u64::from_le_bytes(*b"shoalBa1");

// Lines of 64 bytes, as in the gate.
const TURN: usize = 64;
const STOP: usize = 68;
const LEFT: usize = 128;
const BELL: usize = 192;
const MEMBERS: usize = 256;
const LEN: usize = 320;

/// One barrier, as one process maps it.
pub struct Barrier {
    map: Mapping,
}

impl Barrier {
    /// Makes the barrier of this address, open to nobody yet.
    ///
    /// # Errors
    /// When shared memory is full or not accessible.
    pub fn create(address: &Address) -> Result<Barrier> {
        let map = Mapping::create(address, FILE, LEN, |map| map.u64_at(0).store(MAGIC, Release))?;
        Ok(Barrier { map })
    }

    /// Maps the barrier of this address.
    ///
    /// # Errors
    /// When there is none, or it is not of this build.
    pub fn open(address: &Address) -> Result<Barrier> {
        Ok(Barrier { map: Mapping::open(address, FILE, MAGIC)? })
    }

    /// How many have joined.
    pub fn members(&self) -> u32 {
        self.map.u32_at(MEMBERS).load(Acquire)
    }

    /// The opener's side: lets all members through once, and waits for the last of them.
    ///
    /// # Errors
    /// When one of them does not come within the patience: it has died.
    pub fn round(&self, members: u32, patience: Duration) -> Result<()> {
        let (left, bell) = (self.map.u32_at(LEFT), self.map.u32_at(BELL));
        left.store(members, Release);
        self.turn();
        let patience = timespec(u64::try_from(patience.as_nanos()).unwrap_or(u64::MAX));
        loop {
            let seen = bell.load(Acquire);
            if left.load(Acquire) == 0 {
                return Ok(());
            }
            if futex::wait(bell, futex::Flags::empty(), seen, Some(&patience)) == Err(rustix::io::Errno::TIMEDOUT) {
                return Err(BusError::new(
                    "bare barrier",
                    "wait for its members",
                    "one of them has not come",
                    "try again; is the machine out of memory or processes?",
                ));
            }
        }
    }

    /// A member's side: joins, and goes through every round until the stop.
    pub fn serve(&self) {
        let (turn, left, bell) = (self.map.u32_at(TURN), self.map.u32_at(LEFT), self.map.u32_at(BELL));
        let mut seen = turn.load(Acquire);
        self.map.u32_at(MEMBERS).fetch_add(1, AcqRel);
        while self.map.u32_at(STOP).load(Acquire) == 0 {
            let now = turn.load(Acquire);
            if now == seen {
                let _ = futex::wait(turn, futex::Flags::empty(), seen, None);
                continue;
            }
            seen = now;
            if left.fetch_sub(1, AcqRel) == 1 {
                bell.fetch_add(1, AcqRel);
                let _ = futex::wake(bell, futex::Flags::empty(), 1);
            }
        }
    }

    /// Sends everybody home.
    pub fn stop(&self) {
        self.map.u32_at(STOP).store(1, Release);
        self.turn();
    }

    fn turn(&self) {
        let turn = self.map.u32_at(TURN);
        turn.fetch_add(1, AcqRel);
        let _ = futex::wake(turn, futex::Flags::empty(), i32::MAX as u32);
    }
}

/// Periods of a bare timer: sleeps until each one is due, and does nothing else. How late each wake-up was, ns.
pub fn timer(first_ns: u64, period_ns: u64, periods: usize) -> Vec<u32> {
    crate::clock::set_timer_slack_1ns();
    let mut late_ns = Vec::with_capacity(periods);
    let mut due_ns = first_ns;
    while late_ns.len() < periods {
        crate::clock::sleep_until_ns(due_ns);
        late_ns.push(u32::try_from(now_ns().saturating_sub(due_ns)).unwrap_or(u32::MAX));
        due_ns += period_ns;
    }
    late_ns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_round_lets_everybody_through_once() {
        let address = Address::create().unwrap();
        let barrier = Barrier::create(&address).unwrap();
        #[expect(clippy::disallowed_methods, reason = "members are threads here")]
        let members: Vec<_> = (0..5)
            .map(|_| {
                let member = Barrier::open(&address).unwrap();
                std::thread::spawn(move || member.serve())
            })
            .collect();
        while barrier.members() < 5 {
            crate::clock::sleep_until_ns(now_ns() + 1_000_000);
        }
        for _ in 0..2000 {
            barrier.round(5, Duration::from_secs(20)).unwrap();
        }
        assert!(barrier.round(6, Duration::from_millis(50)).is_err(), "there are five");
        barrier.stop();
        members.into_iter().for_each(|member| member.join().unwrap());
        crate::clean::sweep(&address);
    }

    #[test]
    fn a_timer_does_not_drift() {
        let first_ns = now_ns() + 1_000_000;
        let late_ns = timer(first_ns, 500_000, 20);
        let end_ns = now_ns();
        assert_eq!(late_ns.len(), 20);
        assert!(end_ns >= first_ns + 19 * 500_000);
    }
}
