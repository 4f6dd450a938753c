//! Every interleaving that the argument at the top of `gate.rs` names, and a crowd of threads that tries the rest.
#![expect(clippy::disallowed_methods, reason = "tests have threads and wait")]

use super::*;
use crate::clean::sweep;
use std::sync::Arc;
use std::thread;

/// A wait that takes this long has lost a wake-up: nothing in these tests sleeps longer than milliseconds.
const LOST: Duration = Duration::from_secs(8);
const TIMEOUT: Duration = Duration::from_secs(10);

struct Fleet {
    address: Address,
    gate: Gate,
}

impl Fleet {
    fn new(max_robots: u32) -> Fleet {
        let address = Address::create().unwrap();
        let gate = Gate::create(&address, max_robots).unwrap();
        // The first wait returns at once, in case somebody called before.
        gate.wait_call(TIMEOUT);
        Fleet { address, gate }
    }

    /// How long a wait for this tick takes.
    fn wait(&self, tick: u64, timeout: Duration) -> Duration {
        let start = now_ns();
        self.gate.wait_answers(tick, timeout);
        Duration::from_nanos(now_ns() - start)
    }
}

impl Drop for Fleet {
    fn drop(&mut self) {
        sweep(&self.address);
    }
}

fn instance(slot: u32) -> RobotInstance {
    RobotInstance { index: RobotIndex(slot), incarnation: 0 }
}

const SHORT: Duration = Duration::from_millis(60);

#[test]
fn the_last_answer_wakes_the_world_and_the_others_do_not() {
    let fleet = Fleet::new(3);
    fleet.gate.open_tick(7, 2, 1);
    fleet.gate.answer(instance(0), 7);
    assert!(fleet.gate.answered(instance(0), 7) && !fleet.gate.answered(instance(1), 7));
    assert!(
        !fleet.gate.answered(instance(0), 6)
            && !fleet.gate.answered(RobotInstance { index: RobotIndex(0), incarnation: 1 }, 7)
    );
    let rings = fleet.gate.map.u32_at(BELL).load(Acquire);
    thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(SHORT);
            fleet.gate.answer(instance(1), 7);
        });
        let waited = fleet.wait(7, TIMEOUT);
        assert!(waited >= SHORT / 2 && waited < LOST, "{waited:?}");
    });
    assert_eq!(fleet.gate.map.u32_at(BELL).load(Acquire), rings + 1);
    assert!(fleet.gate.answered(instance(1), 7));
}

#[test]
fn a_wait_with_nobody_missing_returns_at_once() {
    let fleet = Fleet::new(2);
    fleet.gate.open_tick(0, 0, 1);
    assert!(fleet.wait(0, TIMEOUT) < LOST);
    fleet.gate.open_tick(1, 1, 1);
    fleet.gate.answer(instance(0), 1);
    assert!(fleet.wait(1, TIMEOUT) < LOST);
}

#[test]
fn an_answer_for_an_older_tick_does_not_count() {
    let fleet = Fleet::new(2);
    fleet.gate.open_tick(1, 1, 1);
    fleet.gate.open_tick(2, 1, 1);
    fleet.gate.answer(instance(1), 1);
    assert!(fleet.gate.answered(instance(1), 1) && !fleet.gate.answered(instance(1), 2));
    assert!(fleet.wait(2, SHORT) >= SHORT, "nobody answered tick 2");
    // Not even one that shares the lower half of the tick with nothing but the one before.
    fleet.gate.open_tick(1 << 32, 1, 1);
    fleet.gate.answer(instance(1), 2);
    assert_eq!(fleet.gate.map.u64_at(COUNTER).load(Acquire) & REMAINING, 1);
}

#[test]
fn an_agent_that_died_before_its_decrement_costs_one_look_and_no_wake_up() {
    let fleet = Fleet::new(3);
    fleet.gate.open_tick(1, 3, 1);
    // Killed between its slot and its decrement: the counter will never reach zero.
    fleet.gate.slot(RobotIndex(0), ANSWER).unwrap().store(answer_of(instance(0), 1), Release);
    // The daemon rings; the world looks, still misses the others, and waits again.
    fleet.gate.ring_world();
    assert!(fleet.wait(1, TIMEOUT) < LOST);
    assert!(fleet.wait(1, TIMEOUT) < LOST, "once more, so that the caller looks after the flag is set");
    thread::scope(|scope| {
        scope.spawn(|| {
            for slot in [1, 2] {
                thread::sleep(SHORT);
                fleet.gate.answer(instance(slot), 1);
            }
        });
        for slot in [1, 2] {
            assert!(fleet.wait(1, TIMEOUT) < LOST);
            assert!(fleet.gate.answered(instance(slot), 1));
        }
    });
}

#[test]
fn an_answer_that_nobody_expected_costs_one_look_and_no_wake_up() {
    let fleet = Fleet::new(3);
    fleet.gate.open_tick(1, 1, 1);
    fleet.gate.answer(instance(2), 1);
    assert!(fleet.wait(1, TIMEOUT) < LOST, "the counter is zero, though instance 1 has not answered");
    thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(SHORT);
            fleet.gate.answer(instance(1), 1);
        });
        while !fleet.gate.answered(instance(1), 1) {
            assert!(fleet.wait(1, TIMEOUT) < LOST);
        }
    });
}

#[test]
fn a_call_is_heard_whenever_it_comes() {
    let fleet = Fleet::new(1);
    fleet.gate.open_tick(1, 1, 1);
    fleet.gate.ring_world();
    assert!(fleet.wait(1, TIMEOUT) < LOST, "before the wait");
    thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(SHORT);
            fleet.gate.ring_world();
        });
        fleet.gate.wait_call(TIMEOUT);
    });
    fleet.gate.announce_ready(instance(0));
    assert!(
        fleet.gate.is_ready(instance(0))
            && !fleet.gate.is_ready(RobotInstance { index: RobotIndex(0), incarnation: 1 })
    );
    let start = now_ns();
    fleet.gate.wait_call(TIMEOUT);
    fleet.gate.wait_call(SHORT);
    let waited = Duration::from_nanos(now_ns() - start);
    assert!(waited >= SHORT && waited < LOST, "the first at once, the second not at all: {waited:?}");
}

#[test]
fn the_late_ring_of_an_older_tick_does_not_end_a_wait() {
    let fleet = Fleet::new(1);
    fleet.gate.open_tick(1, 1, 1);
    thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(SHORT / 4);
            fleet.gate.ring();
        });
        assert!(fleet.wait(1, SHORT) >= SHORT);
    });
}

#[test]
fn agents_see_ticks_start_and_stop() {
    let fleet = Fleet::new(1);
    let agent = Gate::open(&fleet.address).unwrap();
    assert_eq!(agent.max_robots(), 1);
    assert_eq!(agent.wait_tick(None, SHORT), TickWait::TimedOut);
    fleet.gate.open_tick(0, 1, 5);
    assert_eq!(agent.wait_tick(None, TIMEOUT), TickWait::Open { tick: 0, stamp_ns: 5 });
    assert_eq!(agent.wait_tick(Some(0), SHORT), TickWait::TimedOut);
    fleet.gate.open_tick(1, 1, 6);
    fleet.gate.open_tick(2, 1, 7);
    assert_eq!(agent.wait_tick(Some(0), TIMEOUT), TickWait::Open { tick: 2, stamp_ns: 7 }, "the newest one");

    assert!(!agent.wait_meeting(SHORT));
    thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(SHORT);
            fleet.gate.call_meeting();
        });
        assert!(agent.wait_meeting(TIMEOUT));
    });
    assert!(!fleet.gate.has_met(instance(0)));
    agent.announce_met(instance(0));
    assert!(
        fleet.gate.has_met(instance(0)) && !fleet.gate.has_met(RobotInstance { index: RobotIndex(0), incarnation: 1 })
    );

    assert_eq!((agent.start_ns(), agent.wait_start(SHORT)), (None, None));
    thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(SHORT);
            fleet.gate.set_start(99);
        });
        assert_eq!(agent.wait_start(TIMEOUT), Some(99));
    });
    let signs = fleet.gate.signs(instance(0));
    agent.note_alive(instance(0));
    assert_ne!(fleet.gate.signs(instance(0)), signs);

    let progress = Progress { tick: 3, robots: 15, arrived: 7, contacts: 1 << 40, stamp_ns: 9 };
    fleet.gate.set_progress(progress);
    assert_eq!(agent.progress(), progress);

    thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(SHORT);
            agent.stop();
        });
        assert!(fleet.wait(2, TIMEOUT) < LOST, "the stop wakes the world");
    });
    assert!(fleet.gate.stopped());
    assert_eq!(agent.wait_tick(Some(2), TIMEOUT), TickWait::Stopped);
    assert_eq!(agent.wait_start(TIMEOUT), None);
    assert!(!agent.wait_meeting(TIMEOUT), "nobody meets any more");
}

/// A small generator, for delays: the same for the same seed.
struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % n
    }

    /// Mostly nothing, sometimes a turn of the scheduler, seldom some time.
    fn dawdle(&mut self) {
        match self.below(64) {
            0 => thread::sleep(Duration::from_micros(self.below(400))),
            1..16 => thread::yield_now(),
            _ => {}
        }
    }
}

/// Agents that answer at any time, one that dies without a word, one that answers though nobody expects it, one that is
/// given up and answers too late, and somebody who rings all the time: no wait may run into its time-out.
#[test]
fn no_wake_up_is_lost_in_a_crowd() {
    const AGENTS: u32 = 8;
    const TICKS: u64 = 4000;
    const DIES_AT: u64 = 1000;
    let (dies, unasked, late) = (instance(3), instance(5), instance(6));
    for seed in [1, 2, 3] {
        let fleet = Fleet::new(AGENTS);
        let dead = Arc::new(AtomicBool::new(false));
        thread::scope(|scope| {
            for slot in 0..AGENTS {
                let (address, dead) = (fleet.address.clone(), Arc::clone(&dead));
                scope.spawn(move || {
                    let (gate, mut random) =
                        (Gate::open(&address).unwrap(), Random((seed << 32) + u64::from(slot) + 1));
                    let (me, mut last) = (instance(slot), None);
                    gate.announce_ready(me);
                    loop {
                        let tick = match gate.wait_tick(last, TIMEOUT) {
                            TickWait::Open { tick, stamp_ns } => {
                                assert_eq!(stamp_ns, tick + 1);
                                tick
                            }
                            TickWait::Stopped => return,
                            TickWait::TimedOut => panic!("seed {seed}: agent {slot} was not woken after {last:?}"),
                        };
                        last = Some(tick);
                        random.dawdle();
                        if me == dies && tick >= DIES_AT {
                            // What the daemon does when the kernel tells it.
                            dead.store(true, Release);
                            gate.ring_world();
                            return;
                        }
                        if me == late && tick % 97 == 0 {
                            thread::sleep(Duration::from_millis(2));
                        }
                        gate.answer(me, tick);
                    }
                });
            }
            scope.spawn(|| {
                let (gate, mut random) = (Gate::open(&fleet.address).unwrap(), Random(seed << 40));
                while !gate.stopped() {
                    thread::sleep(Duration::from_micros(200 + random.below(3000)));
                    gate.ring_world();
                }
            });
            let mut random = Random(seed);
            while !(0..AGENTS).all(|slot| fleet.gate.is_ready(instance(slot))) {
                let start = now_ns();
                fleet.gate.wait_call(TIMEOUT);
                assert!(now_ns() - start < LOST.as_nanos() as u64);
            }
            for tick in 0..TICKS {
                let mut expected: Vec<RobotInstance> = (0..AGENTS).map(instance).collect();
                let is_dead = |who| who == dies && dead.load(Acquire);
                let is_left_out = |who| (who == unasked && tick % 50 == 0) || (who == late && tick % 97 == 0);
                expected.retain(|&who| !is_dead(who) && !is_left_out(who));
                fleet.gate.open_tick(tick, expected.len() as u32, tick + 1);
                random.dawdle();
                loop {
                    expected.retain(|&who| !is_dead(who) && !fleet.gate.answered(who, tick));
                    if expected.is_empty() {
                        break;
                    }
                    let waited = fleet.wait(tick, TIMEOUT);
                    if waited > LOST {
                        fleet.gate.stop();
                        panic!("seed {seed}: tick {tick}: no wake-up, {expected:?} missing, {waited:?}");
                    }
                }
            }
            fleet.gate.stop();
        });
        assert!(dead.load(Acquire));
    }
}

#[test]
fn the_process_of_a_robot_instance_is_that_of_its_present_life() {
    let fleet = Fleet::new(2);
    let (old, new) = (instance(1), RobotInstance { index: RobotIndex(1), incarnation: 1 });
    assert_eq!((fleet.gate.process(old), fleet.gate.deaf_to(old)), (None, None));
    fleet.gate.announce_process(new);
    fleet.gate.announce_deaf(new, RobotIndex(0));
    let of = |instance| (fleet.gate.process(instance), fleet.gate.deaf_to(instance));
    assert_eq!(
        [of(new), of(old), of(instance(0))],
        [(Some(std::process::id()), Some(RobotIndex(0))), (None, None), (None, None)]
    );
}
