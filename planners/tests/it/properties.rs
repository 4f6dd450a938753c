//! What holds for every method of the registry, whatever it is given. A method that is added is held to it too.

use crate::inputs::{Scene, every_method};
use geometry::Capsule;
use model::kind::Kind;
use model::value::Value;
use model::{BodyKind, Drive, Limits, ParamValue, ParamValues, Wheels};
use nalgebra::{Point2, Rotation2, Vector2};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use shoal_planners::{Identity, Intent, METHODS, Neighbor, Obstacle, Plan, Planner};

/// Fixed seed: a failure is the same for everybody. The failing input is printed in full and becomes a named row.
pub(crate) fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 256,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1986),
        ..ProptestConfig::default()
    }
}

const DT_S: f64 = 0.05;
/// Ticks planned in a row, so that what a method remembers is part of the properties.
const TICKS: u64 = 5;

fn vector(size: f64) -> impl Strategy<Value = Vector2<f64>> {
    (-size..size, -size..size).prop_map(|(x, y)| Vector2::new(x, y))
}

fn point(size: f64) -> impl Strategy<Value = Point2<f64>> {
    vector(size).prop_map(Point2::from)
}

fn neighbor(size: f64) -> impl Strategy<Value = Neighbor> {
    let age_s = prop_oneof![Just(0.0), 0.0..3.0f64];
    (point(size), -4.0..4.0f64, vector(2.0), 0.05..0.5f64, age_s, 0.0..10.0f64, any::<[bool; 2]>()).prop_map(
        |(position, yaw_rad, velocity, radius_m, age_s, remaining_m, [arrived, stopped])| Neighbor {
            id: 0,
            position,
            yaw_rad,
            velocity,
            radius_m,
            age_s,
            remaining_m,
            arrived,
            stopped,
            next: None,
            intent: None,
        },
    )
}

fn obstacle(size: f64) -> impl Strategy<Value = Obstacle> {
    (point(size), vector(3.0), any::<bool>(), 0.0..1.0f64, vector(1.0)).prop_map(
        |(a, along, is_disc, radius, velocity)| {
            let b = if is_disc { a } else { a + along };
            Obstacle { id: 0, shape: Capsule { a, b, radius }, velocity }
        },
    )
}

/// A robot somewhere within `size` of the origin, among up to `others` robots and as many obstacles.
pub(crate) fn scene(size: f64, others: usize) -> impl Strategy<Value = Scene> {
    let own = (
        point(size),
        -4.0..4.0f64,
        vector(1.0),
        0.05..0.5f64,
        proptest::sample::select(BodyKind::MOBILE),
        point(size),
        any::<bool>(),
    );
    let limits = (0.01..3.0f64, 0.0..1.0f64, 0.1..6.0f64);
    let around =
        (proptest::collection::vec(obstacle(size), 0..=others), proptest::collection::vec(neighbor(size), 0..=others));
    (own, limits, around).prop_map(|(own, (speed_mps_max, reverse_mps_max, turn_radps_max), around)| {
        let (position, yaw_rad, velocity, radius_m, kind, goal, arrived) = own;
        let (mut obstacles, mut neighbors) = around;
        // Every second obstacle is one more piece of the one before.
        obstacles.iter_mut().enumerate().for_each(|(i, obstacle)| obstacle.id = i as u32 / 2);
        neighbors.iter_mut().enumerate().for_each(|(i, neighbor)| neighbor.id = i as u32 + 1);
        Scene {
            position,
            yaw_rad,
            velocity,
            turn_radps: 0.0,
            radius_m,
            kind,
            wheels: (kind == BodyKind::DiffDrive).then_some(Wheels { accel_radps2_max: 50.0, ..Wheels::BURGER }),
            limits: Limits { speed_mps_max, reverse_mps_max, turn_radps_max, ..crate::inputs::LIMITS },
            goal,
            arrived,
            obstacles,
            neighbors,
        }
    })
}

/// A scene in which nothing overlaps the robot: there the plans depend smoothly on the scene, so that rounding stays
/// rounding.
fn clear_scene() -> impl Strategy<Value = Scene> {
    scene(3.0, 6).prop_map(|mut scene| {
        let (position, radius_m) = (scene.position, scene.radius_m);
        scene.obstacles.retain(|obstacle| obstacle.shape.distance(position) > radius_m + 0.05);
        scene.neighbors.retain(|other| {
            let ahead = other.position + other.velocity * other.age_s;
            let near = (ahead - position).norm().min((other.position - position).norm());
            near > radius_m + other.radius_m + 0.05
        });
        scene
    })
}

fn plans(planner: &mut dyn Planner, scene: &Scene) -> Vec<Plan> {
    (0..TICKS).map(|tick| planner.plan(&scene.input(tick, DT_S))).collect()
}

/// Holds one method's answer to what every answer must be.
pub(crate) fn check_sane(name: &str, scene: &Scene, plan: &Plan) -> Result<(), TestCaseError> {
    let finite = plan.drive.is_finite() && [plan.attractive, plan.repulsive].iter().all(|v| v.norm().is_finite());
    prop_assert!(finite, "{name}: {plan:?}");
    let limits = &scene.limits;
    let rounding = 1.0 + 1e-12;
    match (scene.kind, plan.drive.within(limits)) {
        (BodyKind::Point, Drive::Velocity(v)) => {
            prop_assert!(v.norm() <= limits.speed_mps_max * rounding, "{name}: {v:?}");
        }
        (BodyKind::Unicycle | BodyKind::DiffDrive, Drive::Twist { speed_mps, turn_radps }) => {
            prop_assert!(speed_mps <= limits.speed_mps_max && speed_mps >= -limits.reverse_mps_max, "{name}");
            prop_assert!(turn_radps.abs() <= limits.turn_radps_max, "{name}: {turn_radps}");
        }
        (BodyKind::TwoLinkArm, Drive::Joints { rate_radps }) => {
            let fastest = rate_radps.iter().fold(0.0, |fastest: f64, rate| fastest.max(rate.abs()));
            prop_assert!(fastest <= limits.turn_radps_max * rounding, "{name}: {rate_radps:?}");
        }
        (kind, drive) => prop_assert!(false, "{name}: {kind:?} cannot {drive:?}"),
    }
    Ok(())
}

/// Compares the plans of a scene with those of a changed one; `expected` says what the change does to a plan.
fn check_same(
    name: &str,
    scene: &Scene,
    changed: &Scene,
    expected: impl Fn(Plan) -> Plan,
) -> Result<(), TestCaseError> {
    let method = shoal_planners::find(name).expect("exists");
    let fresh = || (method.build)(&ParamValues::new(), crate::inputs::IDENTITY).expect("defaults fit");
    let (before, after) = (plans(&mut *fresh(), scene), plans(&mut *fresh(), changed));
    for (before, after) in before.into_iter().map(expected).zip(after) {
        let scale = 1.0 + before.attractive.norm() + before.repulsive.norm();
        let error = match (before.drive, after.drive) {
            (Drive::Velocity(a), Drive::Velocity(b)) => (a - b).norm(),
            (Drive::Twist { speed_mps: v, turn_radps: w }, Drive::Twist { speed_mps, turn_radps }) => {
                (v - speed_mps).abs().max((w - turn_radps).abs())
            }
            (Drive::Joints { rate_radps: [a, b] }, Drive::Joints { rate_radps: [c, d] }) => {
                (a - c).abs().max((b - d).abs())
            }
            _ => f64::INFINITY,
        };
        let terms = (before.attractive - after.attractive).norm() + (before.repulsive - after.repulsive).norm();
        prop_assert_eq!(before.stopped, after.stopped, "{}", name);
        prop_assert!(error <= 1e-6 && terms <= 1e-8 * scale, "{name}:\nexpected {before:?}\nfound    {after:?}");
    }
    Ok(())
}

/// The scene with every point, direction and heading mapped.
fn mapped(
    scene: &Scene,
    point: impl Fn(Point2<f64>) -> Point2<f64>,
    vector: impl Fn(Vector2<f64>) -> Vector2<f64>,
    yaw: impl Fn(f64) -> f64,
) -> Scene {
    let mut scene = scene.clone();
    scene.position = point(scene.position);
    scene.velocity = vector(scene.velocity);
    scene.yaw_rad = yaw(scene.yaw_rad);
    scene.goal = point(scene.goal);
    for obstacle in &mut scene.obstacles {
        obstacle.shape = Capsule { a: point(obstacle.shape.a), b: point(obstacle.shape.b), ..obstacle.shape };
        obstacle.velocity = vector(obstacle.velocity);
    }
    for neighbor in &mut scene.neighbors {
        neighbor.position = point(neighbor.position);
        neighbor.velocity = vector(neighbor.velocity);
        neighbor.yaw_rad = yaw(neighbor.yaw_rad);
    }
    scene
}

/// The plan with every direction mapped; a twist is the body's own affair, except for the side it turns to.
fn mapped_plan(plan: Plan, vector: impl Fn(Vector2<f64>) -> Vector2<f64>, side: f64) -> Plan {
    Plan {
        drive: match plan.drive {
            Drive::Velocity(v) => Drive::Velocity(vector(v)),
            Drive::Twist { speed_mps, turn_radps } => Drive::Twist { speed_mps, turn_radps: side * turn_radps },
            Drive::Joints { rate_radps } => Drive::Joints { rate_radps: rate_radps.map(|rate| side * rate) },
            // A mirror changes left and right.
            Drive::Wheels { rate_radps: [left, right] } if side < 0.0 => Drive::Wheels { rate_radps: [right, left] },
            drive @ Drive::Wheels { .. } => drive,
        },
        attractive: vector(plan.attractive),
        repulsive: vector(plan.repulsive),
        stopped: plan.stopped,
        state: plan.state,
        intent: plan.intent.map(|intent| Intent { wish: vector(intent.wish), corner: None, ..intent }),
    }
}

/// Every method, with its defaults and then with every other word and switch of every parameter on its own.
fn every_variant() -> Vec<(String, Box<dyn Planner>)> {
    let mut all = Vec::new();
    for method in METHODS {
        let build = |values: &ParamValues| (method.build)(values, crate::inputs::IDENTITY).expect("the parameters fit");
        all.push((method.name.to_owned(), build(&ParamValues::new())));
        for spec in (method.params)() {
            let values: Vec<ParamValue> = match spec.kind() {
                Kind::Bool => [false, true].map(ParamValue::Bool).into(),
                Kind::Choice(words) => words.iter().map(|word| ParamValue::Choice((*word).to_owned())).collect(),
                _ => Vec::new(),
            };
            for value in values.into_iter().filter(|value| Some(Value::from(value)) != spec.default()) {
                let name = format!("{}, {} = {value}", method.name, spec.name);
                all.push((name, build(&ParamValues::from([(spec.name.to_owned(), value)]))));
            }
        }
    }
    all
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn plans_are_finite_and_within_limits(
        near in scene(2.0, 12), far in scene(1e6, 12), offset in vector(1e6), crowded in scene(2.0, 12),
    ) {
        // A crowd a thousand kilometres from the origin, where a last digit is a tenth of a nanometre.
        let remote = mapped(&crowded, |p| p + offset, |v| v, |yaw| yaw);
        for scene in [near, far, remote] {
            for (method, mut planner) in every_method() {
                for plan in plans(&mut *planner, &scene) {
                    check_sane(method.name, &scene, &plan)?;
                }
            }
        }
    }

    #[test]
    fn equal_inputs_give_equal_plans(scene in scene(2.0, 8), seed: u64, robot in 0u32..1024) {
        let identity = Identity { seed, robot, incarnation: 1 };
        for method in METHODS {
            let fresh = || (method.build)(&ParamValues::new(), identity).expect("defaults fit");
            prop_assert_eq!(plans(&mut *fresh(), &scene), plans(&mut *fresh(), &scene), "{}", method.name);
        }
    }

    #[test]
    fn the_order_of_neighbors_does_not_matter(scene in clear_scene(), turn in 0usize..6) {
        let mut shuffled = scene.clone();
        shuffled.neighbors.reverse();
        let n = shuffled.neighbors.len();
        shuffled.neighbors.rotate_left(turn % n.max(1));
        for method in METHODS.iter().filter(|method| method.symmetry.neighbor_order) {
            check_same(method.name, &scene, &shuffled, |plan| plan)?;
        }
    }

    #[test]
    fn moving_the_world_moves_nothing_else(scene in clear_scene(), offset in vector(1000.0)) {
        let moved = mapped(&scene, |p| p + offset, |v| v, |yaw| yaw);
        for method in METHODS.iter().filter(|method| method.symmetry.translation) {
            check_same(method.name, &scene, &moved, |plan| plan)?;
        }
    }

    #[test]
    fn turning_the_world_turns_the_plan(scene in clear_scene(), angle in -3.0f64..3.0) {
        let turn = Rotation2::new(angle);
        let turned = mapped(&scene, |p| turn * p, |v| turn * v, |yaw| yaw + angle);
        for method in METHODS.iter().filter(|method| method.symmetry.rotation) {
            check_same(method.name, &scene, &turned, |plan| mapped_plan(plan, |v| turn * v, 1.0))?;
        }
    }

    #[test]
    fn mirroring_the_world_mirrors_the_plan(scene in clear_scene()) {
        let mirror = |v: Vector2<f64>| Vector2::new(v.x, -v.y);
        let mirrored = mapped(&scene, |p| Point2::new(p.x, -p.y), mirror, |yaw| -yaw);
        for method in METHODS.iter().filter(|method| method.symmetry.reflection) {
            check_same(method.name, &scene, &mirrored, |plan| mapped_plan(plan, mirror, -1.0))?;
        }
    }
}

/// Cases that random numbers do not hit: everything in one place, nothing at all, a crowd.
#[test]
fn degenerate_scenes() {
    let here = [1.0, -2.0];
    let mut rows = vec![Scene::new(here, here), Scene::new(here, [4.0, 4.0]), Scene::new([-1e6, 1e6], [1e6, -1e6])];
    for goal in [here, [4.0, 4.0]] {
        let mut piled = Scene::new(here, goal);
        piled.neighbors = (1..=3).map(|id| crate::inputs::robot(id, here)).collect();
        piled.obstacles = vec![
            crate::inputs::disc(0, here, 0.0),
            crate::inputs::disc(1, here, 0.5),
            Obstacle { id: 2, shape: Capsule::segment([0.0, -2.0].into(), [3.0, -2.0].into()), velocity: Vector2::x() },
            crate::inputs::disc(3, goal, 0.5),
        ];
        rows.push(piled.clone());
        piled.radius_m = 0.0;
        piled.goal = Point2::from(goal) + Vector2::new(f64::MIN_POSITIVE, 0.0);
        rows.push(piled);
    }
    let mut crowd = Scene::new(here, [4.0, 4.0]);
    crowd.neighbors =
        (1..=1000).map(|id| crate::inputs::robot(id, [f64::from(id % 40) * 0.1, f64::from(id / 40) * -0.1])).collect();
    rows.push(crowd);
    let mut heap = Scene::new(here, [4.0, 4.0]);
    heap.neighbors = (1..=1000).map(|id| crate::inputs::robot(id, here)).collect();
    rows.push(heap);
    let remote = |scene: &Scene| mapped(scene, |p| p + Vector2::new(-1e6, 1e6), |v| v, |yaw| yaw);
    rows.extend(rows.iter().map(remote).collect::<Vec<_>>());
    for (mut scene, kind) in rows.iter().flat_map(|scene| BodyKind::MOBILE.iter().map(|kind| (scene.clone(), *kind))) {
        scene.kind = kind;
        for (name, mut planner) in every_variant() {
            for plan in plans(&mut *planner, &scene) {
                check_sane(&name, &scene, &plan).unwrap_or_else(|problem| panic!("{problem}"));
            }
        }
    }
}

/// More robots than any list of a method holds: which of them count must not hang on the order in which they are heard.
#[test]
fn the_order_of_a_thousand_neighbors_does_not_matter() {
    let mut stream = model::random::Stream::new(1, 0, 0, "crowd");
    for kind in BodyKind::MOBILE {
        let mut crowd = Scene { kind: *kind, ..Scene::new([0.0, 0.0], [9.0, 4.0]) };
        crowd.neighbors = (1..=4000)
            .map(|id| crate::inputs::robot(id, [stream.between(-9.0, 9.0), stream.between(-9.0, 9.0)]))
            .filter(|other| (other.position - crowd.position).norm() > 0.5)
            .take(1000)
            .collect();
        let mut sorted = crowd.clone();
        sorted.neighbors.sort_by(|a, b| b.position.x.total_cmp(&a.position.x));
        let mut reversed = crowd.clone();
        reversed.neighbors.reverse();
        for method in METHODS.iter().filter(|method| method.symmetry.neighbor_order) {
            for other in [&sorted, &reversed] {
                check_same(method.name, &crowd, other, |plan| plan).unwrap_or_else(|problem| panic!("{problem}"));
            }
        }
    }
}

/// A symmetry is given up with a reason: a fixed set of directions, or a side that is preferred.
#[test]
fn no_method_gives_up_more_symmetry_than_it_must() {
    for method in METHODS {
        assert!(method.symmetry.translation && method.symmetry.neighbor_order, "{}", method.name);
        let whole = method.symmetry.rotation && method.symmetry.reflection;
        let fixed =
            ["rpoa", "liquid", "liquid-online", "pso-via-points", "orca", "power-law", "lanes"].contains(&method.name);
        assert!(whole != fixed, "{}", method.name);
    }
}
