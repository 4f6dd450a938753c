//! The gate. `tick` is what its words and its system calls take while nobody sleeps: one thread opens a tick, gives the
//! answers of all seats, and waits for them. `ping` is a tick of one robot in another thread, on another processor:
//! two wake-ups, mostly.

use crate::home::{Home, Other};
use bus::{Gate, TickWait, clock};
use divan::Bencher;
use model::Seat;
use std::time::Duration;

const PATIENCE: Duration = Duration::from_secs(1);

fn seat(slot: u32) -> Seat {
    Seat { slot, incarnation: 0 }
}

/// Opens a tick, and waits until it is answered by so many.
fn open(gate: &Gate, tick: u64, seats: u32, answer: impl FnOnce()) {
    gate.open_tick(tick, seats, clock::now_ns());
    answer();
    while (0..seats).any(|slot| !gate.answered(seat(slot), tick)) {
        gate.wait_answers(tick, PATIENCE);
    }
}

#[divan::bench(args = [1, 15, 64, 200])]
fn tick(bencher: Bencher<'_, '_>, seats: u32) {
    let home = Home::new();
    let gate = Gate::create(&home.address, seats).unwrap();
    let mut tick = 0;
    bencher.bench_local(|| {
        tick += 1;
        open(&gate, tick, seats, || (0..seats).for_each(|slot| gate.answer(seat(slot), tick)));
    });
}

#[divan::bench]
fn ping(bencher: Bencher<'_, '_>) {
    let home = Home::new();
    let gate = Gate::create(&home.address, 1).unwrap();
    let theirs = Gate::open(&home.address).unwrap();
    let robot = Other::new(move || {
        move |_| {
            let mut last = None;
            loop {
                match theirs.wait_tick(last, PATIENCE) {
                    TickWait::Open { tick, .. } => {
                        theirs.answer(seat(0), tick);
                        last = Some(tick);
                    }
                    TickWait::TimedOut | TickWait::Stopped => return,
                }
            }
        }
    });
    robot.begin(0);
    let mut tick = 0;
    bencher.bench_local(|| {
        tick += 1;
        open(&gate, tick, 1, || {});
    });
    gate.stop();
}
