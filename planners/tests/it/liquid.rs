//! The liquid methods, by example: the law, thinking in slices, what makes a robot think anew, driving, and the layer.
//! The paper's environments and counts are in `reproduce`.

use crate::inputs::{IDENTITY, LIMITS, Scene, build, disc, robot};
use geometry::Capsule;
use model::{BodyKind, Drive, Limits};
use nalgebra::{Point2, Vector2};
use shoal_planners::liquid::known::Known;
use shoal_planners::liquid::{Budget, Field, Law, Liquid, LiquidOnline, Progress, Search, offline, online};
use shoal_planners::{Identity, Obstacle, Planner};

const DT_S: f64 = 0.05;

fn law() -> Law {
    Liquid::new(offline::Params::default(), IDENTITY).law().clone()
}

fn field<'a>(law: &'a Law, obstacles: &'a [Obstacle], virtual_obstacles: &'a [Point2<f64>]) -> Field<'a> {
    Field { law, k_v: law.k_v, agent_radius_m: 0.03, goal: [3.0, 0.0].into(), obstacles, virtual_obstacles }
}

fn wall(id: u32, a: [f64; 2], b: [f64; 2]) -> Obstacle {
    Obstacle { id, shape: Capsule::segment(a.into(), b.into()), velocity: Vector2::zeros() }
}

/// A cup of discs that opens to the left, around (2, 0).
fn cup() -> Vec<Obstacle> {
    let angles = (-5..=5).map(|i| f64::from(i) * 0.33);
    (0..).zip(angles).map(|(id, angle): (u32, f64)| disc(id, [2.0 + angle.cos(), angle.sin()], 0.2)).collect()
}

fn drive(scene: &mut Scene, planner: &mut dyn Planner, ticks: u64) -> Vec<Point2<f64>> {
    let mut path = vec![scene.position];
    for tick in 0..ticks {
        if (scene.goal - scene.position).norm() <= 0.1 {
            break;
        }
        let plan = planner.plan(&scene.input(tick, DT_S));
        match plan.drive.within(&scene.limits) {
            Drive::Velocity(velocity) => {
                // The body changes its velocity as fast as it can.
                let change = (velocity - scene.velocity).cap_magnitude(scene.limits.accel_mps2_max * DT_S);
                scene.velocity += change;
            }
            Drive::Twist { speed_mps, turn_radps } => {
                scene.yaw_rad += turn_radps * DT_S;
                let change_max = scene.limits.accel_mps2_max * DT_S;
                let before = scene.velocity.norm();
                let speed = before + (speed_mps - before).clamp(-change_max, change_max);
                scene.velocity = speed * Vector2::new(scene.yaw_rad.cos(), scene.yaw_rad.sin());
            }
            other @ (Drive::Joints { .. } | Drive::Wheels { .. }) => {
                panic!("no method asks a mobile body for {other:?}")
            }
        }
        scene.position += scene.velocity * DT_S;
        path.push(scene.position);
    }
    path
}

#[test]
fn ties_go_to_the_smallest_number_and_equal_is_a_minimum() {
    let law = law();
    // On the axis, m and 16 − m are mirror images: close behind an obstacle, two are equally good.
    let obstacles = [disc(0, [0.66, 0.0], 0.3)];
    let best = field(&law, &obstacles, &[]).best(Point2::origin()).expect("there is room");
    let twin = field(&law, &obstacles, &[]).candidate(Point2::origin(), 16 - best.m);
    assert!((1..8).contains(&best.m) && (best.potential - twin.potential).abs() <= 1e-12, "{best:?} {twin:?}");
    // Without gains, all is level: nowhere is lower.
    let level = Law { k_t: 0.0, ..law };
    assert_eq!(field(&level, &[], &[]).descend(Point2::origin()), None);
}

#[test]
fn everything_infinite_is_a_minimum() {
    let law = law();
    let obstacles = [disc(0, [0.0, 0.0], 1.0)];
    let inside = field(&law, &obstacles, &[]);
    assert_eq!(inside.best(Point2::origin()), None);
    assert_eq!(inside.descend(Point2::origin()), None);
    assert_eq!(inside.at(Point2::origin()), f64::INFINITY);
    // Just inside, the way out is downhill.
    assert!(inside.descend([1.0, 0.0].into()).is_some());
}

#[test]
fn thin_bodies_are_not_jumped_over() {
    let law = Law { k_o: 1e-6, ..law() };
    let obstacles = [wall(0, [0.05, -0.5], [0.05, 0.5])];
    let jumping = Law { no_jumping: false, ..law.clone() };
    assert_eq!(field(&jumping, &obstacles, &[]).best(Point2::origin()).map(|best| best.m), Some(0));
    let best = field(&law, &obstacles, &[]).best(Point2::origin()).expect("there is room on this side");
    assert!(best.point.x < 0.02, "{best:?}");
}

#[test]
fn a_virtual_obstacle_is_not_larger_than_half_a_step() {
    let law = law();
    assert_eq!(law.virtual_radius_m(0.03), 0.03);
    assert_eq!(law.virtual_radius_m(0.2), 0.05);
    assert_eq!(Law { v_r_cap_steps: 0.0, ..law }.virtual_radius_m(0.2), 0.2);
}

#[test]
fn a_tick_thinks_no_more_than_its_slice_and_stands_still() {
    let params = offline::Params { rounds_per_tick: 7, ..offline::Params::default() };
    let mut liquid = Liquid::new(params, IDENTITY);
    let mut scene = Scene::new([0.0, 0.03], [5.0, 0.0]);
    scene.obstacles = cup();
    let mut rounds = 0;
    for tick in 0..1000 {
        let plan = liquid.plan(&scene.input(tick, DT_S));
        let spent = liquid.search().rounds_of_all() - rounds;
        rounds += spent;
        assert!(spent <= 7);
        if liquid.search().progress() == Progress::Found {
            assert!(tick > 5 && !plan.stopped && plan.drive != Drive::stop(BodyKind::Point));
            assert!(!liquid.search().virtual_obstacles().is_empty());
            return;
        }
        assert!(spent == 7 && plan.stopped && plan.drive == Drive::stop(BodyKind::Point), "{plan:?}");
    }
    panic!("never found a way out of the cup");
}

/// A field of discs, 1 m apart, of which the robot at the origin touches none.
fn orchard(count: u32) -> Vec<Obstacle> {
    (0..count).map(|id| disc(id, [f64::from(id % 32) - 15.5, f64::from(id / 32) - 15.5], 0.1)).collect()
}

#[test]
fn a_tick_among_many_pieces_does_a_bounded_number_of_looks() {
    /// What one tick may look at: 17 places a round, each at every piece.
    const LOOKS: usize = 40_000;
    for count in [1, 47, 48, 200, 816, 1024, 4096] {
        let mut scene = Scene::new([0.0, 0.0], [40.0, 30.0]);
        scene.obstacles = orchard(count);
        let mut liquid = Liquid::new(offline::Params::default(), IDENTITY);
        let mut online = LiquidOnline::new(online::Params::default(), IDENTITY);
        let (mut rounds, mut rounds_online, mut most) = (0, 0, 0);
        for tick in 0..40 {
            liquid.plan(&scene.input(tick, DT_S));
            let spent =
                liquid.search().rounds_of_all() - std::mem::replace(&mut rounds, liquid.search().rounds_of_all());
            assert!(spent <= 1 || spent * 17 * count as usize <= LOOKS, "{spent} rounds among {count} pieces");
            most = most.max(spent);
            online.plan(&scene.input(tick, DT_S));
            let spent = online.rounds() - std::mem::replace(&mut rounds_online, online.rounds());
            assert!(spent <= 1, "{spent} rounds among {count} pieces");
        }
        assert_eq!(most, (LOOKS / (17 * count as usize)).clamp(1, 50), "it thinks as much as it may: {count} pieces");
    }
}

#[test]
fn what_is_known_of_the_world_does_not_pile_up() {
    let mut known = Known::default();
    let mut scene = Scene::new([0.0, 0.0], [3.0, 0.0]);
    let corners = [[1.0, -1.0], [2.0, -1.0], [1.5, -2.0]];
    // A triangle and a disc that creep, slower than what counts as moving, and a robot that parks now here, now there.
    for step in 0..500 {
        let moved = Vector2::new(0.06 * f64::from(step), 0.0);
        let velocity = Vector2::new(0.009, 0.0);
        let edge = |i: usize| {
            let Obstacle { id, shape, .. } = wall(7, corners[i], corners[(i + 1) % 3]);
            Obstacle { id, shape: Capsule { a: shape.a + moved, b: shape.b + moved, ..shape }, velocity }
        };
        scene.obstacles = vec![Obstacle { velocity, ..disc(2, [moved.x, 3.0], 0.3) }, edge(0), edge(1), edge(2)];
        scene.neighbors = vec![robot(1, [moved.x, 9.0])];
        scene.neighbors[0].arrived = true;
        assert!(known.notice(&scene.input(0, DT_S), true, 0.05).standing, "step {step}");
        let ids: Vec<u32> = known.obstacles().iter().map(|known| known.id).collect();
        assert_eq!(ids, [2, 7, 7, 7, u32::MAX - 1], "step {step}");
        assert!(known.obstacles()[1..4].iter().all(|edge| edge.shape.a.x >= moved.x + 1.0), "step {step}");
    }
}

#[test]
fn slices_do_not_change_what_is_found() {
    let law = law();
    let obstacles = cup();
    let search = |slice: usize| {
        let mut search = Search::new(Budget { virtual_max: 100, rounds_max: 10_000, fallbacks: 0 });
        search.begin([0.0, 0.03].into(), [5.0, 0.0].into());
        while search.advance(&law, 0.2, &obstacles, slice) == Progress::Thinking {}
        assert_eq!(search.progress(), Progress::Found);
        (search.path().to_vec(), search.virtual_obstacles().to_vec(), search.rounds())
    };
    assert_eq!(search(1), search(1000));
    assert_eq!(search(3), search(1000));
}

#[test]
fn it_thinks_anew_when_its_goal_or_its_way_changes() {
    let mut liquid = Liquid::new(offline::Params::default(), IDENTITY);
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    scene.obstacles = vec![disc(3, [2.0, 2.0], 0.3)];
    drive(&mut scene, &mut liquid, 20);
    let path = liquid.search().path().to_vec();
    let mut after = |scene: &Scene| {
        liquid.plan(&scene.input(0, DT_S));
        liquid.search().path().to_vec()
    };
    // Neither something new beside the way nor a passer-by is a reason; something on the way is.
    scene.obstacles.push(disc(4, [2.0, -2.0], 0.3));
    assert_eq!(after(&scene), path);
    scene.obstacles.push(Obstacle { velocity: Vector2::x(), ..disc(5, [2.0, 0.0], 0.3) });
    assert_eq!(after(&scene), path);
    scene.obstacles[2].velocity = Vector2::zeros();
    let around = after(&scene);
    assert!(around != path && around[0] == scene.position);
    // It stays known when it is out of sight; a robot that has arrived counts too.
    scene.obstacles.pop();
    assert_eq!(after(&scene), around);
    let middle = around[around.len() / 2];
    scene.neighbors = vec![robot(9, [middle.x, middle.y])];
    assert_eq!(after(&scene), around);
    scene.neighbors[0].arrived = true;
    let second = after(&scene);
    assert!(second != around);
    scene.goal = [4.0, 1.0].into();
    let last = (0..20).map(|_| after(&scene)).last().expect("20 ticks");
    assert!((last.last().expect("has a start") - scene.goal).norm() < 0.1 + 1e-9);
}

/// A robot that plans round what moves, and again with every half step of it.
#[test]
fn it_plans_again_when_something_moves_if_it_is_asked_to() {
    let params = offline::Params { replan_moving: true, rounds_per_tick: 1000, ..offline::Params::default() };
    let mut liquid = Liquid::new(params, IDENTITY);
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    let mut after = |scene: &Scene| {
        liquid.plan(&scene.input(0, DT_S));
        assert_eq!(liquid.search().progress(), Progress::Found);
        liquid.search().path().to_vec()
    };
    let clear = |path: &[Point2<f64>], scene: &Scene| {
        let shape = scene.obstacles[0].shape;
        path.iter().map(|point| shape.distance(*point)).fold(f64::INFINITY, f64::min) - scene.radius_m
    };
    let straight = after(&scene);
    scene.obstacles = vec![Obstacle { velocity: Vector2::y(), ..disc(5, [2.0, 0.0], 0.3) }];
    let around = after(&scene);
    assert!(clear(&straight, &scene) < 0.0 && clear(&around, &scene) > 0.0);
    // Less than half a step does not count.
    let moved_to = |y: f64| Obstacle { velocity: Vector2::y(), ..disc(5, [2.0, y], 0.3) };
    scene.obstacles[0] = moved_to(0.04);
    assert_eq!(after(&scene), around);
    scene.obstacles[0] = moved_to(-0.3);
    let again = after(&scene);
    assert!(again != around && clear(&again, &scene) > 0.0);
    // Out of sight it is forgotten; at rest it is not.
    scene.obstacles.clear();
    assert_eq!(after(&scene), straight);
    scene.obstacles = vec![moved_to(0.0)];
    assert_eq!(after(&scene), around);
    scene.obstacles[0].velocity = Vector2::zeros();
    assert_eq!(after(&scene), around);
    scene.obstacles.clear();
    assert_eq!(after(&scene), around);
}

/// A search goes on while things move: one that restarted with each move would never end.
#[test]
fn what_never_rests_does_not_keep_it_thinking() {
    let params = offline::Params { replan_moving: true, rounds_per_tick: 3, ..offline::Params::default() };
    let mut liquid = Liquid::new(params, IDENTITY);
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    let found = (0..100).find(|tick| {
        let y = 2.0 + 0.1 * (*tick % 2) as f64;
        scene.obstacles = vec![Obstacle { velocity: Vector2::y(), ..disc(5, [2.0, y], 0.3) }];
        liquid.plan(&scene.input(*tick, DT_S));
        liquid.search().progress() == Progress::Found
    });
    assert!(found.is_some_and(|tick| tick > 5), "{found:?}");
}

#[test]
fn without_a_way_it_stays_until_something_changes() {
    let params = offline::Params { virtual_max: 5, rounds_per_tick: 1000, ..offline::Params::default() };
    let mut liquid = Liquid::new(params, IDENTITY);
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    let ring = (0..8).map(|i| f64::from(i) * std::f64::consts::FRAC_PI_4);
    let ring = (0..).zip(ring).map(|(id, angle): (u32, f64)| disc(id, [4.0 + angle.cos(), angle.sin()], 0.4));
    scene.obstacles = ring.collect();
    let path = drive(&mut scene, &mut liquid, 50);
    assert_eq!(liquid.search().progress(), Progress::Failed);
    assert_eq!(*path.last().expect("has a start"), Point2::origin());
    let rounds = liquid.search().rounds_of_all();
    drive(&mut scene, &mut liquid, 50);
    assert_eq!(liquid.search().rounds_of_all(), rounds, "it thinks no more");
    scene.goal = [2.0, 2.0].into();
    drive(&mut scene, &mut liquid, 200);
    assert!((scene.position - scene.goal).norm() <= 0.1);
}

#[test]
fn what_is_known() {
    let mut known = Known::default();
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    let ids = |known: &Known| known.obstacles().iter().map(|obstacle| obstacle.id).collect::<Vec<_>>();
    let mut notice = |scene: &Scene| {
        let news = known.notice(&scene.input(0, DT_S), true, 0.05);
        assert!(!news.moving);
        (news.standing, ids(&known))
    };
    // A triangle of which two edges are in sight, then the third; the map is what is in sight at first.
    let corners = [[1.0, -1.0], [2.0, -1.0], [1.5, -2.0]];
    let edge = |i: usize| wall(7, corners[i], corners[(i + 1) % 3]);
    scene.obstacles = vec![disc(2, [0.0, 3.0], 0.3), edge(0), edge(1)];
    assert_eq!(notice(&scene), (true, vec![2, 7, 7]));
    assert_eq!(notice(&scene), (false, vec![2, 7, 7]));
    scene.obstacles = vec![edge(2)];
    assert_eq!(notice(&scene), (true, vec![2, 7, 7, 7]));
    // A disc that was moved by a little, by more, and one that moves.
    scene.obstacles = vec![disc(2, [0.04, 3.0], 0.3)];
    assert!(!notice(&scene).0);
    scene.obstacles = vec![disc(2, [0.4, 3.0], 0.3)];
    assert_eq!(notice(&scene), (true, vec![2, 7, 7, 7]));
    scene.obstacles[0].velocity = Vector2::x();
    assert_eq!(notice(&scene), (false, vec![7, 7, 7]));
    scene.neighbors = vec![robot(1, [5.0, 0.0])];
    assert_eq!(notice(&scene), (false, vec![7, 7, 7]));
    scene.neighbors[0].arrived = true;
    assert_eq!(notice(&scene), (true, vec![7, 7, 7, u32::MAX - 1]));
    scene.neighbors[0].arrived = false;
    assert_eq!(notice(&scene), (false, vec![7, 7, 7]));
}

/// Both methods, both kinds of body, with and without limits of acceleration, out of a cup and around a wall.
#[test]
fn bodies_get_out_of_a_cup_without_contact() {
    let quick = LIMITS;
    let lazy = Limits { accel_mps2_max: 2.0, ..LIMITS };
    let mut with_wall = vec![wall(0, [1.5, -1.5], [1.5, 1.2])];
    with_wall.push(disc(1, [0.0, 2.5], 0.3));
    for (name, obstacles) in [("cup", cup()), ("wall", with_wall)] {
        for method in ["liquid", "liquid-online"] {
            for kind in [BodyKind::Point, BodyKind::Unicycle] {
                for limits in [quick, lazy] {
                    let mut scene = Scene::new([0.0, 0.03], [5.0, 0.0]);
                    (scene.kind, scene.limits) = (kind, limits);
                    scene.obstacles.clone_from(&obstacles);
                    let path = drive(&mut scene, &mut *build(method, "", IDENTITY), 1200);
                    let distance = |p: &Point2<f64>| {
                        obstacles.iter().map(|o| o.shape.distance(*p) - 0.2).fold(f64::INFINITY, f64::min)
                    };
                    let clearance = path.iter().map(distance).fold(f64::INFINITY, f64::min);
                    let label = format!("{name} {method} {kind:?} {limits:?}");
                    assert!((scene.position - scene.goal).norm() <= 0.1, "{label}: ends at {:?}", scene.position);
                    assert!(clearance > 0.0, "{label}: {clearance:.3} m");
                }
            }
        }
    }
}

#[test]
fn a_path_is_followed_step_by_step() {
    let mut liquid = Liquid::new(offline::Params::default(), IDENTITY);
    let mut scene = Scene::new([0.0, 0.03], [5.0, 0.0]);
    scene.obstacles = cup();
    let path = drive(&mut scene, &mut liquid, 1000);
    let thought = liquid.search().path();
    for point in &thought[..thought.len() - 1] {
        assert!(path.iter().any(|p| (p - point).norm() < 1e-9), "{point:?} is left out");
    }
}

#[test]
fn online_rounds_are_steps_and_virtual_obstacles() {
    let mut liquid = LiquidOnline::new(online::Params::default(), IDENTITY);
    let mut scene = Scene::new([0.0, 0.03], [5.0, 0.0]);
    scene.obstacles = cup();
    for tick in 0..1000 {
        let before = liquid.rounds();
        let Drive::Velocity(velocity) = liquid.plan(&scene.input(tick, DT_S)).drive else { panic!("a point") };
        assert!(liquid.rounds() <= before + 1, "one round a tick");
        assert_eq!(liquid.rounds(), liquid.steps() + liquid.planted());
        scene.position += velocity * DT_S;
    }
    assert!((scene.position - scene.goal).norm() <= 1e-9, "the last piece is driven straight to the goal");
    assert!(liquid.planted() > 0);
    scene.goal = [-1.0, 0.0].into();
    liquid.plan(&scene.input(1000, DT_S));
    assert_eq!((liquid.planted(), liquid.virtual_obstacles().len()), (0, 0));
}

#[test]
fn virtual_obstacles_beside_what_moves_do_not_last() {
    let mut scene = Scene::new([0.0, 0.0], [3.0, 0.0]);
    // On a disc: every direction is infinite, which is a minimum.
    scene.obstacles = vec![Obstacle { velocity: Vector2::new(0.0, 0.02), ..disc(0, [0.0, 0.0], 1.0) }];
    for (lifetime_s, lasts) in [(5.0, false), (0.0, true)] {
        let params = online::Params { lifetime_s, ..online::Params::default() };
        let mut liquid = LiquidOnline::new(params, IDENTITY);
        liquid.plan(&scene.input(0, DT_S));
        assert_eq!(liquid.virtual_obstacles(), [scene.position]);
        let mut far = scene.clone();
        far.position = [-3.0, 0.0].into();
        liquid.plan(&far.input(99, DT_S));
        assert_eq!(liquid.virtual_obstacles().len(), 1);
        liquid.plan(&far.input(100, DT_S));
        assert_eq!(liquid.virtual_obstacles().len(), usize::from(lasts));
    }
}

#[test]
fn it_gives_up_and_begins_again_with_a_new_goal() {
    let params = online::Params { virtual_max: 3, ..online::Params::default() };
    let mut liquid = LiquidOnline::new(params, IDENTITY);
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    // On a disc: every direction is infinite, so every round is a minimum.
    scene.obstacles = vec![disc(0, [0.0, 0.0], 1.0)];
    for tick in 0..10 {
        assert_eq!(liquid.plan(&scene.input(tick, DT_S)).drive, Drive::stop(BodyKind::Point));
        assert_eq!(liquid.gave_up(), tick >= 3);
    }
    assert_eq!(liquid.rounds(), 4);
    scene.goal = [5.0, 0.0].into();
    liquid.plan(&scene.input(10, DT_S));
    assert!(!liquid.gave_up());
}

#[test]
fn robots_push_to_the_right_unless_switched_off() {
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    scene.neighbors = vec![robot(1, [0.8, 0.0])];
    for method in ["liquid", "liquid-online"] {
        let plan = build(method, "", IDENTITY).plan(&scene.input(0, DT_S));
        assert!(plan.repulsive.x < 0.0 && plan.repulsive.y < 0.0, "{method}: {plan:?}");
        let plan = build(method, "neighbors = false", IDENTITY).plan(&scene.input(0, DT_S));
        assert_eq!(plan.repulsive, Vector2::zeros());
        let Drive::Velocity(velocity) = plan.drive else { panic!("a point") };
        assert!((velocity - Vector2::x()).norm() < 1e-9, "{method}: {velocity:?}");
    }
    // What is behind only pushes on.
    scene.neighbors = vec![robot(1, [-0.8, 0.0])];
    let plan = build("liquid", "", IDENTITY).plan(&scene.input(0, DT_S));
    assert!(plan.repulsive.x > 0.0 && plan.repulsive.y.abs() < 1e-12, "{plan:?}");
    // In one place, two robots go two ways.
    scene.neighbors = vec![robot(1, [0.0, 0.0])];
    let lower = build("liquid", "", IDENTITY).plan(&scene.input(0, DT_S)).repulsive;
    scene.neighbors[0].id = 0;
    let higher = build("liquid", "", Identity { robot: 1, ..IDENTITY }).plan(&scene.input(0, DT_S)).repulsive;
    assert!(lower.x < 0.0 && higher.x > 0.0);
}

#[test]
fn a_push_does_not_lead_into_a_wall() {
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    scene.obstacles = vec![wall(0, [-5.0, -0.21], [9.0, -0.21])];
    scene.neighbors = vec![robot(1, [0.0, 0.45])];
    let mut planner = build("liquid", "k_o = 0.0001", IDENTITY);
    let Drive::Velocity(velocity) = planner.plan(&scene.input(0, DT_S)).drive else { panic!("a point") };
    assert!(velocity.y >= -0.01 / DT_S - 1e-9, "{velocity:?}");
}

#[test]
fn arrived_means_stay() {
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    scene.arrived = true;
    scene.neighbors = vec![robot(1, [0.5, 0.0])];
    for method in ["liquid", "liquid-online"] {
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            scene.kind = kind;
            let plan = build(method, "", IDENTITY).plan(&scene.input(0, DT_S));
            assert!(plan.stopped && plan.drive == Drive::stop(kind), "{method}");
        }
    }
}

/// Khatib's field as the force on a damped unit mass: v += (pull + push − k_v v) dt.
#[test]
fn khatib_of_second_order() {
    let params = "order = \"second\"\ndamping = 2.0\nk_att = 1.0\nattract_cap_m = 0.0\nk_rep = 0.1\ninfluence_m = 1.0";
    let mut planner = build("apf", params, IDENTITY);
    let mut scene = Scene::new([0.0, 0.0], [3.0, 4.0]);
    scene.obstacles = vec![disc(0, [0.9, 0.0], 0.3)];
    scene.velocity = Vector2::new(0.1, -0.2);
    let Drive::Velocity(velocity) = planner.plan(&scene.input(0, 0.01)).drive else { panic!("a point") };
    // The push is the worked example's: 0.1 (1/0.4 − 1) / 0.4² = 0.9375.
    let expected: Vector2<f64> = Vector2::new(0.1, -0.2) + 0.01 * Vector2::new(3.0 - 0.9375 - 0.2, 4.0 + 0.4);
    assert!((velocity - expected).norm() < 1e-12, "{velocity:?} {expected:?}");
    // A unicycle's mass is imagined: it goes on from tick to tick.
    scene.kind = BodyKind::Unicycle;
    scene.velocity = Vector2::zeros();
    let mut planner = build("apf", params, IDENTITY);
    let speeds: [f64; 3] = [0, 1, 2].map(|tick| match planner.plan(&scene.input(tick, 0.05)).drive {
        Drive::Twist { speed_mps, .. } => speed_mps,
        _ => panic!("a unicycle gets a twist"),
    });
    assert!(speeds[0] < speeds[1] && speeds[1] < speeds[2], "{speeds:?}");
}
