//! The gate. `tick` is what its words and its system calls take while nobody sleeps: one thread opens a tick, gives the
//! answers of all instances, and waits for them. `ping` is a tick of one robot in another thread, on another processor:
//! two wake-ups, mostly.

use crate::home::{Home, Other};
use bus::{Gate, TickWait, clock};
use divan::Bencher;
use model::{RobotIndex, RobotInstance};
use std::time::Duration;

const PATIENCE: Duration = Duration::from_secs(1);

fn instance(slot: u32) -> RobotInstance {
    RobotInstance { index: RobotIndex(slot), incarnation: 0 }
}

/// Opens a tick, and waits until it is answered by so many.
fn open(gate: &Gate, tick: u64, instances: u32, answer: impl FnOnce()) {
    gate.open_tick(tick, instances, clock::now_ns());
    answer();
    while (0..instances).any(|slot| !gate.answered(instance(slot), tick)) {
        gate.wait_answers(tick, PATIENCE);
    }
}

#[divan::bench(args = [1, 15, 64, 200])]
fn tick(bencher: Bencher<'_, '_>, instances: u32) {
    let home = Home::new();
    let gate = Gate::create(&home.address, instances).unwrap();
    let mut tick = 0;
    bencher.bench_local(|| {
        tick += 1;
        open(&gate, tick, instances, || (0..instances).for_each(|slot| gate.answer(instance(slot), tick)));
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
                        theirs.answer(instance(0), tick);
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
