//! The papers' equations with values computed by hand, one rule at a time: what the environments in `reproduce` rest on.
//! AMR-APF and its baseline have theirs beside their rules.

use crate::inputs::{IDENTITY, Scene, build, disc, robot};
use model::random::Stream;
use nalgebra::{Point2, Vector2};
use shoal_planners::liquid::{Budget, Field as Hills, Law, Liquid, Progress, Search, offline};
use shoal_planners::pso_via_points::field::{Bodies, Field, Variant};
use shoal_planners::pso_via_points::swarm::{Settings, Swarm, velocity};
use shoal_planners::pso_via_points::terrain::{Plane, Terrain};
use shoal_planners::rpoa::{Angles, Params, Rpoa, Rule, gaussian};
use shoal_planners::{Obstacle, Plan};

fn near(found: Vector2<f64>, expected: [f64; 2], what: &str) {
    assert!((found - Vector2::from(expected)).norm() < 1e-9, "{what}: {found:?} instead of {expected:?}");
}

// -- Matoui et al. 2017 ---------------------------------------------------------------------------------------------

fn matoui(params: &str, scene: &Scene) -> Plan {
    build("decentralized-apf", params, IDENTITY).plan(&scene.input(0, 0.05))
}

/// (2): -ξ (q - g), with our limit ξ d_c.
#[test]
fn matoui_2_the_pull() {
    let scene = Scene::new([0.0, 0.0], [3.0, 4.0]);
    near(matoui("attract_cap = 0.0", &scene).attractive, [3.0, 4.0], "without limit");
    near(matoui("attract_cap = 0.0\nxi = 2.0", &scene).attractive, [6.0, 8.0], "twice the gain");
    near(matoui("attract_cap = 1.0", &scene).attractive, [0.6, 0.8], "limit of 1 m");
    near(matoui("attract_cap = 2.0", &scene).attractive, [1.2, 1.6], "limit of 2 m");
    near(matoui("", &scene).attractive, [0.6, 0.8], "limit that follows the speed");
    near(matoui("", &Scene::new([0.0, 0.0], [0.3, 0.4])).attractive, [0.3, 0.4], "near the goal");
}

/// (4), (6): η (1/p - 1/p₀)ᵇ / p² away from the thing; at p = 0.5 of 1 that is 4 for both powers, at 0.4 9.375 and
/// 14.0625, at 0.8 0.390625 and 0.09765625.
#[test]
fn matoui_4_and_6_the_pushes() {
    for (p, plain, squared) in [(0.5, 4.0, 4.0), (0.4, 9.375, 14.0625), (0.8, 0.390625, 0.09765625), (1.01, 0.0, 0.0)] {
        for (power, size) in [(1, plain), (2, squared)] {
            let params = format!("eta = 1.0\nbracket_power = {power}\n");
            // Bodies have 0.2 m, and the disc 0.3 m.
            let mut scene = Scene::new([0.0, 0.0], [3.0, 4.0]);
            scene.obstacles = vec![disc(0, [p + 0.5, 0.0], 0.3)];
            near(matoui(&params, &scene).repulsive, [-size, 0.0], "a disc");
            scene.obstacles = vec![disc(0, [p, 0.0], 0.3)];
            near(matoui(&format!("{params}distance = \"centre\""), &scene).repulsive, [-size, 0.0], "its centre");
            scene.obstacles.clear();
            scene.neighbors = vec![robot(1, [0.0, -p - 0.4])];
            near(matoui(&params, &scene).repulsive, [0.0, size], "a robot");
        }
    }
    // Each has a threshold of its own: 1/0.5 - 1/2 = 1.5, times 4.
    let mut scene = Scene::new([0.0, 0.0], [3.0, 4.0]);
    scene.obstacles = vec![disc(0, [1.0, 0.0], 0.3)];
    scene.neighbors = vec![robot(1, [0.0, -0.9])];
    near(matoui("eta = 1.0\np_r = 2.0", &scene).repulsive, [-4.0, 6.0], "p_r");
    near(matoui("eta = 1.0\np_o = 2.0", &scene).repulsive, [-6.0, 4.0], "p_o");
}

/// The aid is ours: after standing still for a second, a push to the left of the goal.
#[test]
fn matoui_aid_pushes_to_the_left() {
    let mut planner = build("decentralized-apf", "aid = true\naid_wait_s = 0.2\naid_push_s = 0.1", IDENTITY);
    let mut scene = Scene::new([0.0, 0.0], [3.0, 0.0]);
    // Head on, where pull and push cancel each other: 0.1 (1/p - 1) / p² = 1 at p = 0.393003.
    scene.neighbors = vec![robot(1, [0.393_003 + 0.4, 0.0])];
    let aid: Vec<f64> = (0..8).map(|tick| planner.plan(&scene.input(tick, 0.05)).attractive.y).collect();
    assert_eq!(aid, [0.0, 0.0, 0.0, 0.2, 0.2, 0.0, 0.0, 0.0]);
}

// -- Moaveni and Ghanbari Gol 2011 ------------------------------------------------------------------------------------

fn law() -> Law {
    let law = Liquid::new(offline::Params::default(), IDENTITY).law().clone();
    Law { k_o: 2.0, k_t: 3.0, v_r_m: 0.01, v_r_cap_steps: 0.0, step_m: 0.1, ..law }
}

fn hills<'a>(law: &'a Law, obstacles: &'a [Obstacle], virtual_obstacles: &'a [Point2<f64>]) -> Hills<'a> {
    Hills { law, k_v: 5.0, agent_radius_m: 0.2, goal: [3.0, 4.0].into(), obstacles, virtual_obstacles }
}

/// (1) to (10): K_t d of the goal, K_o / r² of an obstacle and K_v / r² of a virtual one, r from surface to surface;
/// infinite inside.
#[test]
fn liquid_1_to_10_the_potential() {
    let law = law();
    let obstacles = [disc(0, [1.0, 0.0], 0.3), disc(1, [0.0, -2.5], 0.3)];
    let virtual_obstacles = [Point2::new(0.0, 1.21)];
    let field = hills(&law, &obstacles, &virtual_obstacles);
    let q = Point2::origin();
    let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
    close(field.of_goal(q), 15.0);
    close(field.of_obstacle(&obstacles[0], q), 8.0);
    close(field.of_obstacle(&obstacles[1], q), 0.5);
    close(field.of_virtual(virtual_obstacles[0], q), 5.0);
    close(field.bar(q), 23.5);
    close(field.at(q), 28.5);
    assert_eq!(field.of_obstacle(&obstacles[0], [0.5, 0.0].into()), f64::INFINITY);
    assert_eq!(field.at([0.6, 0.0].into()), f64::INFINITY);
}

/// V_r' is V_r + A_r, up to a maximum number of steps.
#[test]
fn liquid_the_radius_of_virtual_obstacles() {
    let law = Law { v_r_cap_steps: 0.5, ..law() };
    assert!((law.virtual_radius_m(0.02) - 0.03).abs() < 1e-12);
    assert!((law.virtual_radius_m(0.2) - 0.05).abs() < 1e-12);
}

/// (12): directions 2 π m / A_nsd, counter-clockwise from +x; (13): the lowest of them, if it is lower.
#[test]
fn liquid_12_and_13_a_step() {
    let law = law();
    let field = hills(&law, &[], &[]);
    for (m, direction) in [(0, [1.0, 0.0]), (4, [0.0, 1.0]), (8, [-1.0, 0.0]), (12, [0.0, -1.0])] {
        near(law.directions[m], direction, "a direction");
        near(
            field.candidate(Point2::origin(), m).point.coords,
            [0.1 * direction[0], 0.1 * direction[1]],
            "a candidate",
        );
    }
    // The goal lies under 53.1°; nearest to that is 45° (m = 2), with 3 · 4.9010 of potential.
    let best = field.best(Point2::origin()).expect("there is room");
    assert_eq!(best.m, 2);
    let here = field.descend(Point2::origin()).expect("it is lower");
    near(here.coords, [0.1 * 0.5f64.sqrt(), 0.1 * 0.5f64.sqrt()], "the step");
    // On the goal every step leads up.
    assert_eq!(field.descend([3.0, 4.0].into()), None);
}

/// (13): where no step leads down, a virtual obstacle stays, and the next run starts from the start.
#[test]
fn liquid_13_the_next_run_starts_at_the_start() {
    let law = Law { k_o: 0.01, k_t: 1.0, k_v: 0.01, ..law() };
    // A pit before a wall of discs.
    let obstacles: Vec<Obstacle> = (0..9).map(|i| disc(i, [1.5, f64::from(i) * 0.4 - 1.6], 0.25)).collect();
    let mut search = Search::new(Budget { virtual_max: 50, rounds_max: 5000, fallbacks: 0 });
    search.begin([0.0, 0.0].into(), [3.0, 0.0].into());
    while search.virtual_obstacles().is_empty() {
        assert_eq!(search.advance(&law, 0.1, &obstacles, 1), Progress::Thinking);
    }
    assert_eq!(search.path(), [Point2::origin()]);
    assert!(search.failed_runs()[0] > 5);
    assert!((search.virtual_obstacles()[0].x - 0.1 * search.failed_runs()[0] as f64).abs() < 1e-9);
}

/// Ours: a search that fails tries a sixth and a sixtieth of K_v.
#[test]
fn liquid_smaller_gains_are_tried() {
    let law = law();
    // Locked in: every run fails.
    let ring: Vec<Obstacle> = (0..12)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 12.0).sin_cos();
            disc(i, [cos, sin], 0.3)
        })
        .collect();
    let mut search = Search::new(Budget { virtual_max: 2, rounds_max: 100, fallbacks: 2 });
    search.begin([0.0, 0.0].into(), [3.0, 0.0].into());
    let mut divisors = vec![search.k_v_divisor()];
    while search.advance(&law, 0.2, &ring, 1) == Progress::Thinking {
        if divisors.last() != Some(&search.k_v_divisor()) {
            divisors.push(search.k_v_divisor());
        }
    }
    assert_eq!(divisors, [1.0, 6.0, 60.0]);
}

/// A virtual obstacle of the law K_v, not K_o, is what a sum has.
#[test]
fn liquid_virtual_obstacles_have_their_own_gain() {
    let law = law();
    let there = [Point2::new(0.0, 1.21)];
    let field = hills(&law, &[], &there);
    assert!((field.at(Point2::origin()) - 20.0).abs() < 1e-9);
    assert!((Hills { k_v: 10.0, ..field }.at(Point2::origin()) - 25.0).abs() < 1e-9);
}

// -- Mohajer et al. 2013 ------------------------------------------------------------------------------------------------

fn equal() -> Params {
    Params { angles: Angles::Equal, guard: false, ..Params::default() }
}

/// α exp(-μ d²).
#[test]
fn rpoa_a_hill() {
    assert_eq!(gaussian(3.0, 2.0, 0.0), 3.0);
    assert!((gaussian(3.0, 2.0, 0.5) - 3.0 * (-0.5f64).exp()).abs() < 1e-12);
    assert!((gaussian(1.0, 2.0, 2.0) - (-8.0f64).exp()).abs() < 1e-12);
}

/// J = Σ α_o exp(-μ_o d²) - α_T exp(-μ_T D²).
#[test]
fn rpoa_the_cost() {
    let params = Params { alpha_obs: 2.0, mu_obs: 3.0, alpha_target: 5.0, mu_target: 0.1, ..equal() };
    let mut scene = Scene::new([0.0, 0.0], [3.0, 0.0]);
    scene.obstacles = vec![disc(0, [1.0, 0.0], 0.3), disc(1, [0.0, 1.2], 0.3)];
    let mut rpoa = Rpoa::new(params, IDENTITY);
    rpoa.sense(&scene.input(0, 0.05));
    // 0.5 m and 0.7 m from surface to surface, 3 m to the target.
    let expected = 2.0 * (-0.75f64).exp() + 2.0 * (-1.47f64).exp() - 5.0 * (-0.9f64).exp();
    let found = rpoa.cost(scene.position, scene.goal);
    assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
}

/// Of the particles that lower the cost the nearest to the target; if none does, the one that raises it least.
#[test]
fn rpoa_which_particle() {
    let mut scene = Scene::new([0.0, 0.0], [9.0, 0.0]);
    scene.obstacles = vec![disc(0, [1.0, 0.3], 0.3)];
    let mut rpoa = Rpoa::new(equal(), IDENTITY);
    rpoa.sense(&scene.input(0, 0.05));
    let step = rpoa.choose(scene.position, scene.goal);
    assert_eq!(step.rule, Rule::Avoid);
    let cost = |rpoa: &mut Rpoa, offset: Vector2<f64>| rpoa.cost(scene.position + offset, scene.goal);
    let here = cost(&mut rpoa, Vector2::zeros());
    assert!(cost(&mut rpoa, step.offset) < here, "it lowers the cost");
    let particles = Params::default().particles;
    let circle: Vec<Vector2<f64>> = (0..particles)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(particles)).sin_cos();
            step.offset.norm() * Vector2::new(cos, sin)
        })
        .collect();
    let lower = circle.iter().filter(|offset| cost(&mut rpoa, **offset) < here);
    let nearest = lower.map(|offset| (scene.goal - scene.position - offset).norm()).fold(f64::INFINITY, f64::min);
    assert!(((scene.goal - scene.position - step.offset).norm() - nearest).abs() < 1e-9);
    // In a hollow between four discs all climb.
    scene.obstacles = (0..4)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::FRAC_PI_2 + 0.1).sin_cos();
            disc(i, [0.9 * cos, 0.9 * sin], 0.3)
        })
        .collect();
    let mut rpoa = Rpoa::new(Params { mu_obs: 40.0, ..equal() }, IDENTITY);
    rpoa.sense(&scene.input(0, 0.05));
    let step = rpoa.choose(scene.position, scene.goal);
    assert_eq!(step.rule, Rule::Fallback);
    let chosen = rpoa.cost(scene.position + step.offset, scene.goal);
    for offset in &circle {
        let offset = offset.normalize() * step.offset.norm();
        assert!(chosen <= rpoa.cost(scene.position + offset, scene.goal) + 1e-12);
    }
}

/// An obstacle 1 m ahead on the way to a target 5 m away: of 60 particles that of 90° (number 15) is the nearest to lower the
/// cost, although it is farther from the target. If only nearer ones are taken, none lowers it, and 84° raises it least.
#[test]
fn rpoa_nearer_particles_only() {
    let mut scene = Scene::new([0.0, 0.0], [5.0, 0.0]);
    scene.radius_m = 0.0;
    scene.obstacles = vec![disc(0, [1.0, 0.0], 0.0)];
    for (nearer_only, index, rule) in [(false, 15, Rule::Avoid), (true, 14, Rule::Fallback)] {
        let mut rpoa = Rpoa::new(Params { nearer_only, ..equal() }, IDENTITY);
        rpoa.sense(&scene.input(0, 0.05));
        let step = rpoa.choose(scene.position, scene.goal);
        assert_eq!((step.index, step.rule), (index, rule));
    }
}

/// The radius of the circle is C_t, and no more than the way that is left.
#[test]
fn rpoa_the_circle_ends_at_the_target() {
    let scene = Scene::new([0.0, 0.0], [9.0, 0.0]);
    let step = |goal: [f64; 2]| {
        let mut rpoa = Rpoa::new(Params { step_radius: 0.1, ..equal() }, IDENTITY);
        rpoa.sense(&scene.input(0, 0.05));
        rpoa.choose(scene.position, goal.into()).offset
    };
    near(step([9.0, 0.0]), [0.1, 0.0], "far");
    near(step([0.04, 0.0]), [0.04, 0.0], "near");
}

// -- Raheem and Badr 2017 -------------------------------------------------------------------------------------------------

fn field() -> Field {
    Field { k_att: 2.0, k_rep: 3.0, influence_m: 1.0, goal_power: 2, bias: Vector2::new(0.5, -0.25), bias_fade_m: 2.0 }
}

/// (1) to (5), n = 2, K_a = 2, K_rep = 3: a disc whose surface is 0.5 m away, the goal 5 m.
#[test]
fn pso_1_to_5_the_field() {
    let field = field();
    let obstacles = [disc(0, [0.8, 0.0], 0.3)];
    let bodies = Bodies { obstacles: &obstacles, ring: None, radius_m: 0.0 };
    let (q, goal) = (Point2::origin(), Point2::new(3.0, 4.0));
    assert!((field.attractive_potential(q, goal) - 25.0).abs() < 1e-9);
    near(field.attraction(q, goal), [6.0, 8.0], "(2)");
    // Bracket 1/0.5 - 1/1 = 1; D² = 25.
    assert!((field.repulsive_potential(q, goal, &bodies) - 1.5 * 25.0).abs() < 1e-9);
    // Away: 3 · 1 · 25 / 0.25 = 300; towards the goal: 3 · 1 · 5 = 15.
    near(field.repulsion(q, goal, &bodies), [-300.0 + 15.0 * 0.6, 15.0 * 0.8], "(5)");
    let plain = Field { goal_power: 0, ..field };
    near(plain.repulsion(q, goal, &bodies), [-12.0, 0.0], "n = 0");
    assert!((plain.repulsive_potential(q, goal, &bodies) - 1.5).abs() < 1e-9);
    // The body's radius takes off, and nothing is felt from 1 m on.
    let wide = Bodies { radius_m: 0.1, ..bodies };
    near(plain.repulsion(q, goal, &wide), [-3.0 * 1.5 / 0.16, 0.0], "0.4 m");
    near(plain.repulsion([-0.51, 0.0].into(), goal, &bodies), [0.0, 0.0], "1.01 m");
}

/// (7) to (20): the repulsion turned to the left, to the right, or a constant force, which fades near the goal.
#[test]
fn pso_7_to_20_the_variants() {
    let field = Field { goal_power: 0, ..field() };
    let obstacles = [disc(0, [0.8, 0.0], 0.3)];
    let bodies = Bodies { obstacles: &obstacles, ring: None, radius_m: 0.0 };
    let force = |variant, goal: [f64; 2]| field.force(variant, Point2::origin(), goal.into(), &bodies);
    // Pull (6, 8), push (-12, 0).
    for (variant, expected) in [
        (Variant::Plain, [-6.0, 8.0]),
        (Variant::Left, [-6.0, -4.0]),
        (Variant::Right, [-6.0, 20.0]),
        (Variant::FadedBias, [-5.5, 7.75]),
        (Variant::LiteralBias, [-5.5, 7.75]),
    ] {
        near(force(variant, [3.0, 4.0]), expected, "5 m from the goal");
    }
    // 1 m from the goal half of it is left.
    near(force(Variant::FadedBias, [0.0, 1.0]), [-11.75, 1.875], "faded");
    near(force(Variant::LiteralBias, [0.0, 1.0]), [-11.5, 1.75], "literal");
}

/// (21): w v + c1 r1 (own best - x) + c2 r2 (best - x).
#[test]
fn pso_21_the_velocity() {
    assert!((velocity(0.7, 1.5, 2.0, 0.2, 1.0, 3.0, 0.5, 0.5, 0.25) - (0.14 + 1.5 - 0.25)).abs() < 1e-12);
    assert!((velocity(0.5, 0.0, 2.0, 0.2, 1.0, 3.0, 2.0, 0.5, 1.0) - (0.1 + 2.0)).abs() < 1e-12);
}

/// Metres of missing clearance, over samples and obstacles, times the weight.
#[test]
fn pso_nearness_costs() {
    let obstacles = [disc(0, [1.0, 0.0], 0.3)];
    let plane = Plane { obstacles: &obstacles, radius_m: 0.2, margin_m: 0.1, penalty: 10.0 };
    let samples = [[0.0, 0.0], [0.5, 0.0], [1.0, 0.45], [2.0, 0.0]].map(Point2::from);
    // 0.6 m are wanted between centres: 0.1 m are missing at the second sample, 0.15 m at the third.
    assert!((plane.penalty(&samples).0 - 2.5).abs() < 1e-9, "{:?}", plane.penalty(&samples));
    assert!(!plane.passes(&samples));
    assert!(plane.passes(&[[0.0, 1.0], [2.0, 1.0]].map(Point2::from)));
}

fn settings() -> Settings {
    Settings {
        via_points: 2,
        particles: 20,
        iterations: 40,
        inertia: 0.7,
        own_pull: 1.5,
        swarm_pull: 1.5,
        clamp: 0.2,
        box_m: 0.5,
        samples: 40,
        jitter_m: 0.3,
        aside_m: 0.0,
        patience: 0,
        gain_m: 0.0,
    }
}

/// A swarm at the end of its work on an arc of 4 m by 2 m, with nothing in the way.
fn swarm(settings: &Settings) -> Swarm {
    let base: Vec<Point2<f64>> = (0..=20)
        .map(|i| f64::from(i) / 20.0)
        .map(|t| Point2::new(4.0 * t, 2.0 * (1.0 - (2.0 * t - 1.0).powi(2))))
        .collect();
    let plane = Plane { obstacles: &[], radius_m: 0.0, margin_m: 0.0, penalty: 0.0 };
    let (mut swarm, mut stream) = (Swarm::default(), Stream::new(3, 0, 0, "pso"));
    swarm.begin(settings, &base, &mut stream);
    let mut budget = i64::MAX;
    assert!(swarm.advance(&plane, &mut stream, &mut budget));
    swarm
}

/// The best of the swarm never becomes worse, and comes near to the straight line of 4 m.
#[test]
fn pso_the_swarm_gets_better() {
    let swarm = swarm(&settings());
    let history = swarm.history();
    assert!(history.windows(2).all(|pair| pair[1] <= pair[0]), "{history:?}");
    assert_eq!(swarm.iterations(), 40);
    let (first, last) = (history[0], history[history.len() - 1]);
    assert!(first > 4.05 && last < 4.0 + 0.1 * (first - 4.0), "{first} to {last}");
}

/// Velocities keep to a part of the box: to none of it, and the swarm stays where it was drawn.
#[test]
fn pso_the_limit_of_velocities() {
    let swarm = swarm(&Settings { clamp: 0.0, ..settings() });
    let history = swarm.history();
    assert!(history.iter().all(|cost| *cost == history[0]), "{history:?}");
}
