//! The core of the world, with so many robots on a lattice that sway: who hears and sees whom (`open`: grid and
//! ranges), and how they move and touch (`close`: kinematics, swept contacts, the referee).

use divan::Bencher;
use model::{Drive, Physics};
use nalgebra::Vector2;
use scenarios::Draft;
use std::cell::RefCell;
use world_sim::World;

const BODIES: [usize; 4] = [15, 64, 200, 1000];
/// Of the lattice.
const SPACING_M: f64 = 2.0;
/// Twelve neighbours at most, some of which come and go.
const RADIO_M: f64 = 2.1 * SPACING_M;
const TICK_HZ: f64 = 50.0;

fn lattice(bodies: usize, physics: Physics) -> World {
    // In the middle, where the bodies are that have others all around, and out of their way.
    let obstacle = |index: i32| {
        let center_m = [index % 4, index / 4].map(|place| f64::from(place - 2) * SPACING_M + 0.5);
        Draft::new().with("shape", "disc").with("center_m", center_m).with("radius_m", 0.1)
    };
    let scenario = Draft::new()
        .with("world.x_m", [-1e3, 1e3])
        .with("world.y_m", [-1e3, 1e3])
        .with("world.physics", physics.word())
        .with("clock.mode", "single")
        .with("clock.tick_hz", TICK_HZ)
        .with("clock.duration_s", 1e5)
        .with("clock.stop", "duration")
        .with("defaults.sensor_range_m", SPACING_M)
        .with("defaults.radio_range_m", RADIO_M)
        .with("layout.kind", "grid")
        .with("layout.robots", bodies)
        .with("layout.spacing_m", SPACING_M)
        .with("layout.offset_m", [500.0, 0.0])
        .with("obstacle", (0..16).map(obstacle).collect::<Vec<_>>())
        .scenario("micro")
        .unwrap();
    let mut world = World::new(&scenario);
    open(&mut world);
    world.take_notices();
    world
}

/// Round in circles of 0.2 m across, each robot elsewhere on its circle.
fn close(world: &mut World) {
    let turn_rad = world.tick() as f64 * (5.0 / TICK_HZ);
    world.close(&mut |instance| {
        let (sin, cos) = (turn_rad + f64::from(instance.index.0)).sin_cos();
        Some(Drive::Velocity(Vector2::new(cos, sin) * 0.5))
    });
    assert!(!world.finished() && world.take_notices().is_empty() && world.contacts() == 0, "nothing happens in it");
}

fn open(world: &mut World) -> usize {
    world.due();
    world.open(&mut |_| true).odometry.len()
}

#[divan::bench(args = BODIES)]
fn open_and_close(bencher: Bencher<'_, '_>, bodies: usize) {
    let mut world = lattice(bodies, Physics::Kinematic);
    bencher.bench_local(|| {
        close(&mut world);
        open(&mut world)
    });
}

/// The same with bodies that have weight: a tick of 20 ms is four steps of the engine.
#[divan::bench(args = [15, 64, 200])]
fn solid(bencher: Bencher<'_, '_>, bodies: usize) {
    let mut world = lattice(bodies, Physics::Rapier);
    bencher.bench_local(|| {
        close(&mut world);
        open(&mut world)
    });
}

#[divan::bench(name = "open", args = BODIES, sample_size = 1, sample_count = 300)]
fn open_alone(bencher: Bencher<'_, '_>, bodies: usize) {
    let world = RefCell::new(lattice(bodies, Physics::Kinematic));
    bencher.with_inputs(|| close(&mut world.borrow_mut())).bench_local_values(|()| open(&mut world.borrow_mut()));
}

#[divan::bench(name = "close", args = BODIES, sample_size = 1, sample_count = 300)]
fn close_alone(bencher: Bencher<'_, '_>, bodies: usize) {
    let world = RefCell::new(lattice(bodies, Physics::Kinematic));
    close(&mut world.borrow_mut());
    let opened = || _ = open(&mut world.borrow_mut());
    bencher.with_inputs(opened).bench_local_values(|()| close(&mut world.borrow_mut()));
}
