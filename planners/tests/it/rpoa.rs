//! Random particle optimisation: what its worked examples, which are rows of `reproduce`, do not say.

use crate::inputs::{IDENTITY, Scene, build, disc, robot};
use geometry::Capsule;
use model::{BodyKind, Drive};
use nalgebra::{Point2, Vector2};
use proptest::prelude::*;
use shoal_planners::rpoa::{Angles, Params, Rpoa, Rule, Step};
use shoal_planners::{Identity, Neighbor, Obstacle, Plan, Planner};

const DT_S: f64 = 0.05;

fn equal() -> Params {
    Params { angles: Angles::Equal, guard: false, ..Params::default() }
}

fn step(params: Params, scene: &Scene) -> Step {
    let mut rpoa = Rpoa::new(params, IDENTITY);
    rpoa.sense(&scene.input(0, DT_S));
    rpoa.choose(scene.position, scene.goal)
}

fn wall(id: u32, a: [f64; 2], b: [f64; 2]) -> Obstacle {
    Obstacle { id, shape: Capsule::segment(a.into(), b.into()), velocity: Vector2::zeros() }
}

#[test]
fn speed_is_that_of_the_body_or_one_radius_a_tick() {
    let scene = Scene::new([0.0, 0.0], [9.0, 0.0]);
    for (radius, speed) in [(0.1, 1.0), (0.05, 1.0), (0.02, 0.4)] {
        let mut planner = build("rpoa", &format!("angles = \"equal\"\nstep_radius = {radius}"), IDENTITY);
        let Drive::Velocity(velocity) = planner.plan(&scene.input(0, DT_S)).drive else { panic!("a point's drive") };
        assert!((velocity - Vector2::new(speed, 0.0)).norm() < 1e-12, "{velocity:?}");
    }
}

/// The last step ends on the target if a particle stands there, and an arrived robot stays.
#[test]
fn it_can_stand_on_its_target() {
    let near = Scene::new([0.0, 0.0], [0.03, 0.0]);
    assert_eq!(step(equal(), &near).offset, Vector2::new(0.03, 0.0));
    let mut there = Scene::new([1.0, 2.0], [1.0, 2.0]);
    assert_eq!(step(equal(), &there).offset, Vector2::zeros());
    there.goal = [1.3, 2.0].into();
    there.arrived = true;
    for kind in [BodyKind::Point, BodyKind::Unicycle] {
        there.kind = kind;
        let plan = build("rpoa", "", IDENTITY).plan(&there.input(0, DT_S));
        assert_eq!(plan, Plan { stopped: true, ..Plan::only(Drive::stop(kind)) });
    }
}

#[test]
fn what_is_out_of_range_does_not_count() {
    let mut scene = Scene::new([0.0, 0.0], [9.0, 0.0]);
    let ahead = step(equal(), &scene);
    assert_eq!((ahead.index, ahead.rule), (0, Rule::Glide));
    // Surfaces are 1 m apart at 1.5 m between the centres.
    for (x, rule) in [(1.51, Rule::Glide), (1.49, Rule::Avoid)] {
        scene.obstacles = vec![disc(0, [x, 0.0], 0.3)];
        assert_eq!(step(equal(), &scene).rule, rule, "{x}");
        scene.obstacles.clear();
        scene.neighbors = vec![Neighbor { radius_m: 0.3, ..robot(1, [x, 0.0]) }];
        assert_eq!(step(equal(), &scene).rule, rule, "{x}");
        scene.neighbors.clear();
    }
}

#[test]
fn a_polygon_is_one_hill() {
    let corners = [[0.6, -1.0], [3.0, -1.0], [3.0, 1.0], [0.6, 1.0]];
    let edge = |id: u32, i: usize| wall(id, corners[i], corners[(i + 1) % 4]);
    let mut scene = Scene::new([0.0, 0.9], [9.0, 0.9]);
    let cost = |scene: &Scene| {
        let mut rpoa = Rpoa::new(equal(), IDENTITY);
        rpoa.sense(&scene.input(0, DT_S));
        (0..8)
            .map(|i| rpoa.cost(scene.position + 0.01 * Vector2::new(f64::from(i), 9.0), scene.goal))
            .collect::<Vec<_>>()
    };
    scene.obstacles = (0..4).map(|i| edge(0, i)).collect();
    let polygon = cost(&scene);
    // Alone, the nearest two edges are two hills; that they share a corner makes them higher, not the polygon.
    scene.obstacles = vec![edge(0, 2), edge(1, 3)];
    assert!(cost(&scene).iter().zip(&polygon).all(|(two, one)| *two > one + 0.1));
    scene.obstacles = vec![edge(0, 2), edge(0, 3)];
    assert_eq!(cost(&scene), polygon);
}

#[test]
fn robots_are_where_they_should_be_by_now() {
    let mut scene = Scene::new([0.0, 0.0], [9.0, 0.0]);
    let cost = |scene: &Scene| {
        let mut rpoa = Rpoa::new(equal(), IDENTITY);
        rpoa.sense(&scene.input(0, DT_S));
        rpoa.cost(scene.position, scene.goal)
    };
    let heard = |x: f64, age_s: f64| Neighbor { age_s, velocity: Vector2::new(-1.0, 0.0), ..robot(1, [x, 0.0]) };
    let mut cost_of = |neighbor: Neighbor| {
        scene.neighbors = vec![neighbor];
        cost(&scene)
    };
    assert!((cost_of(heard(1.2, 0.2)) - cost_of(heard(1.0, 0.0))).abs() < 1e-12);
    // Not for longer than 0.3 s.
    assert!((cost_of(heard(1.2, 5.0)) - cost_of(heard(0.9, 0.0))).abs() < 1e-12);
}

/// Between two walls every particle climbs one of them; without a way out it takes what climbs least.
#[test]
fn fallback_and_guard() {
    let mut boxed = Scene::new([0.0, 0.0], [9.0, 0.0]);
    // Narrow hills on all sides: the robot stands in a hollow.
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    boxed.obstacles = (0..4).map(|i| wall(i as u32, corners[i], corners[(i + 1) % 4])).collect();
    let narrow = Params { mu_obs: 100.0, ..equal() };
    assert_eq!(step(narrow.clone(), &boxed).rule, Rule::Fallback);
    // 0.3 m to each wall: with 0.35 m to keep, no particle gains clearance.
    let guarded = Params { guard: true, d_safe: 0.35, ..narrow };
    let kept = step(guarded, &boxed);
    assert_eq!(kept.rule, Rule::Guard);
}

#[test]
fn modified_rule() {
    let mut scene = Scene::new([0.0, 0.0], [9.0, 0.0]);
    scene.obstacles = vec![disc(0, [1.0, 0.4], 0.3)];
    // So little weight that distance decides, then so much that cost does.
    let bold = step(Params { lambda: 1e-6, ..equal() }, &scene);
    let shy = step(Params { lambda: 1e6, ..equal() }, &scene);
    assert_eq!((bold.index, bold.rule), (0, Rule::Weighted));
    assert!((scene.position + shy.offset - Point2::new(1.0, 0.4)).norm() > 1.07 + 0.095);
}

#[test]
fn robots_draw_their_own_numbers() {
    let scene = Scene::new([0.0, 0.0], [9.0, 0.0]);
    let plan = |identity: Identity| build("rpoa", "", identity).plan(&scene.input(0, DT_S)).drive;
    let own = plan(IDENTITY);
    assert_eq!(own, plan(IDENTITY));
    for other in
        [Identity { robot: 1, ..IDENTITY }, Identity { seed: 2, ..IDENTITY }, Identity { incarnation: 1, ..IDENTITY }]
    {
        assert_ne!(own, plan(other));
    }
}

#[test]
fn it_notices_that_it_is_stuck() {
    let mut rpoa = Rpoa::new(Params::default(), IDENTITY);
    let mut scene = Scene::new([0.0, 0.0], [9.0, 0.0]);
    let mut stuck_at = |scene: &Scene, ticks: std::ops::Range<u64>| {
        let stuck = |tick: &u64| {
            rpoa.plan(&scene.input(*tick, DT_S));
            rpoa.is_stuck()
        };
        ticks.filter(stuck).collect::<Vec<u64>>()
    };
    assert_eq!(stuck_at(&scene, 0..101), [100]);
    // A little nearer is not enough, a little more is.
    scene.position.x = 0.05;
    assert_eq!(stuck_at(&scene, 101..102), [101]);
    scene.position.x = 0.15;
    assert_eq!(stuck_at(&scene, 102..202), []);
    assert_eq!(stuck_at(&scene, 202..203), [202]);
    // Another target is another try.
    scene.goal = [0.0, 12.0].into();
    assert_eq!(stuck_at(&scene, 203..210), []);
}

proptest! {
    #![proptest_config(crate::properties::config())]

    /// Whatever the course of a robot, one tick does not bring it nearer than the guard says to anything that stands
    /// still, unless it gains clearance.
    #[test]
    fn the_guard_holds_for_a_tick(
        yaw_rad in -4.0f64..4.0,
        unicycle: bool,
        discs in proptest::collection::vec((-1.5f64..1.5, -1.5f64..1.5, 0.05f64..0.5), 1..8),
    ) {
        let mut scene = Scene::new([0.0, 0.0], [9.0, 1.0]);
        scene.yaw_rad = yaw_rad;
        scene.kind = if unicycle { BodyKind::Unicycle } else { BodyKind::Point };
        scene.obstacles = discs.iter().zip(0..).map(|((x, y, radius), id)| disc(id, [*x, *y], *radius)).collect();
        let clearance = |position: Point2<f64>| {
            let distances = scene.obstacles.iter().map(|obstacle| obstacle.shape.distance(position) - scene.radius_m);
            distances.fold(f64::INFINITY, f64::min)
        };
        let now = clearance(scene.position);
        prop_assume!(now > 0.0);
        let next = match build("rpoa", "", IDENTITY).plan(&scene.input(0, DT_S)).drive {
            Drive::Velocity(velocity) => scene.position + velocity * DT_S,
            Drive::Twist { speed_mps, turn_radps } => {
                let (sin, cos) = (yaw_rad + turn_radps * DT_S).sin_cos();
                scene.position + speed_mps * DT_S * Vector2::new(cos, sin)
            }
            other => panic!("no method asks a mobile body for {other:?}"),
        };
        // The particle keeps the distance; half way to it, where a point gets in a tick, may be a little nearer.
        prop_assert!(clearance(next) > (now - 0.02).min(0.15 - 0.02), "{} after {now}", clearance(next));
    }
}
