//! Planning does not allocate: counted by an allocator that asks the system for memory and remembers how often.

use crate::inputs::{Scene, disc, every_method, robot};
use nalgebra::{Point2, Vector2};
use shoal_planners::{Capsule, Kind, Obstacle};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    // Per thread, because other tests run at the same time.
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: every call goes to the system allocator unchanged; the counter needs no memory and no destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from the system allocator, with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[test]
fn planning_does_not_allocate() {
    let mut scene = Scene::new([0.0, 0.0], [5.0, 1.0]);
    scene.obstacles = (0..20).map(|i| disc(i, [1.0, f64::from(i)], 0.3)).collect();
    let corners = [[1.0, -1.0], [2.0, -1.0], [1.5, -2.0]].map(Point2::from);
    scene.obstacles.extend((0..3).map(|i| Obstacle {
        id: 20,
        shape: Capsule::segment(corners[i], corners[(i + 1) % 3]),
        velocity: Vector2::zeros(),
    }));
    scene.neighbors = (1..50).map(|i| robot(i, [-1.0, f64::from(i)])).collect();
    for (method, mut planner) in every_method() {
        for kind in [Kind::Point, Kind::Unicycle] {
            scene.kind = kind;
            // The first tick may set up what the method keeps.
            planner.plan(&scene.input(0, 0.05));
            let before = COUNT.get();
            for tick in 1..10 {
                planner.plan(&scene.input(tick, 0.05));
            }
            assert_eq!(COUNT.get() - before, 0, "{}", method.name);
        }
    }
}
