//! Planning does not allocate: counted by an allocator that asks the system for memory and remembers how often.

#[path = "../../../tests/counting.rs"]
mod counting;

use crate::inputs::{Scene, disc, every_method, robot};
use counting::calls;
use geometry::Capsule;
use model::BodyKind;
use nalgebra::{Point2, Vector2};
use shoal_planners::Obstacle;

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
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            scene.kind = kind;
            // The first tick may set up what the method keeps.
            planner.plan(&scene.input(0, 0.05));
            let before = calls();
            for tick in 1..10 {
                planner.plan(&scene.input(tick, 0.05));
            }
            assert_eq!(calls() - before, 0, "{}", method.name);
        }
    }
}
