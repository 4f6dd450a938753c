//! One control cycle: right of way, what is known of others, the virtual obstacles of Eq. 9, candidates for crowds,
//! stops, and what the presets are.

use super::{assert_near, own, preset};
use crate::amr_apf::brake::Near;
use crate::amr_apf::clusters::force;
use crate::amr_apf::field::{Other, obstacle, robot};
use crate::amr_apf::params::{Params, PillarGaps, Preset, Side, Traps};
use crate::amr_apf::{AmrApf, Sum, Trap, pillar_gap, trap};
use crate::testing;
use crate::{Identity, Neighbor, Obstacle, PlanInput, Planner};
use geometry::Capsule;
use model::Drive;
use nalgebra::{Point2, Vector2};

/// A unicycle of the authors' size at the origin, facing +x, ticks of 0.1 s.
fn input<'a>(goal: [f64; 2], obstacles: &'a [Obstacle], neighbors: &'a [Neighbor]) -> PlanInput<'a> {
    PlanInput {
        radius_m: 0.22,
        goal: goal.into(),
        goal_tolerance_m: 0.06,
        obstacles,
        neighbors,
        map: obstacles,
        walls: None,
        ..testing::input()
    }
}

fn neighbor(id: u32, position: [f64; 2]) -> Neighbor {
    Neighbor {
        id,
        position: position.into(),
        yaw_rad: 0.0,
        velocity: Vector2::zeros(),
        radius_m: 0.22,
        age_s: 0.0,
        remaining_m: 1.0,
        arrived: false,
        stopped: false,
        next: None,
        intent: None,
    }
}

fn pillar(id: u32, at: [f64; 2]) -> Obstacle {
    Obstacle { id, shape: Capsule::disc(at.into(), 0.11), velocity: Vector2::zeros() }
}

fn planner_of(params: Params, slot: u32) -> AmrApf {
    AmrApf::new(params, Identity { seed: 1, robot: slot, incarnation: 0 })
}

fn planner(which: Preset) -> AmrApf {
    planner_of(preset(which), 0)
}

/// P_i > P_j: the robot that has farther to go, and has not arrived; P also: and does not stand still on purpose. Of two that have
/// as far the lower slot, in the programs neither.
#[test]
fn right_of_way() {
    for (remaining_m, arrived, stopped, slot, fixed, c1, exact) in [
        (3.1, false, false, 0, true, true, true),
        (2.9, false, false, 0, false, false, false),
        (3.1, true, false, 0, false, false, false),
        (3.1, false, true, 0, false, true, false),
        (3.0, false, false, 0, false, false, false),
        (3.0, false, false, 2, true, true, false),
    ] {
        let it = Neighbor { remaining_m, arrived, stopped, ..neighbor(1, [0.8, 0.0]) };
        let of = |params: Params| planner_of(params, slot).right_of_way(&it, &input([3.0, 0.0], &[], &[]));
        let what = format!("{remaining_m} m, arrived {arrived}, stopped {stopped}, slot {slot}");
        for which in [Preset::P, Preset::Fixed, Preset::Fleet] {
            assert_eq!(of(preset(which)), fixed, "{what}, {which:?}");
        }
        assert_eq!(of(preset(Preset::C1)), c1, "{what}, C1");
        assert_eq!(of(Params { exact: true, ..preset(Preset::P) }), exact, "{what}, exact");
        assert!(!of(preset(Preset::H)), "{what}, H");
    }
}

/// Where the other is now, and what it counts as: it kept its course since it spoke; after 0.3 s of silence it stands
/// there, after 2 s it is forgotten.
#[test]
fn what_is_known_of_another_robot() {
    let planner = planner(Preset::Fleet);
    let of = |age_s: f64| {
        let velocity = Vector2::new(0.1, -0.2);
        let it = Neighbor { age_s, velocity, remaining_m: 9.0, ..neighbor(1, [1.0, 0.0]) };
        planner.other(&it, &input([3.0, 0.0], &[], &[]))
    };
    for (age_s, place, parked) in [
        (0.0, [1.0, 0.0], false),
        (0.1, [1.01, -0.02], false),
        (0.3, [1.03, -0.06], false),
        (0.31, [1.03, -0.06], true),
        (2.0, [1.03, -0.06], true),
    ] {
        let it = of(age_s).expect("it is known");
        assert_near(it.position.coords, place, "place");
        assert_eq!((it.parked, it.right_of_way), (parked, !parked), "{age_s} s");
        assert!((it.rho_m - 0.51).abs() < 1e-12);
    }
    assert!(of(2.1).is_none());
    let of = |it: Neighbor| planner.other(&it, &input([3.0, 0.0], &[], &[])).expect("it is known").parked;
    assert!(!of(neighbor(1, [1.0, 0.0])));
    assert!(of(Neighbor { arrived: true, ..neighbor(1, [1.0, 0.0]) }));
    assert!(of(Neighbor { stopped: true, ..neighbor(1, [1.0, 0.0]) }));
    // Margins widen both robots: 2 (0.22 + 0.1) + 0.07.
    let wide = planner_of(Params { margin_m: 0.1, ..preset(Preset::Fleet) }, 0);
    let it = wide.other(&neighbor(1, [1.0, 0.0]), &input([3.0, 0.0], &[], &[])).expect("it is known");
    assert!((it.rho_m - 0.71).abs() < 1e-12);
}

/// A body faces where it is turned, unless its course shows that it need not drive ahead.
#[test]
fn where_another_robot_faces() {
    let planner = planner(Preset::Fleet);
    for (velocity, yaw_rad, faces_rad) in
        [([0.0, 0.0], 1.0, 1.0), ([0.2, 0.0], 0.29, 0.29), ([0.2, 0.0], 0.31, 0.0), ([0.0, 0.0005], 0.0, 0.0)]
    {
        let it = Neighbor { yaw_rad, velocity: velocity.into(), ..neighbor(1, [1.0, 0.0]) };
        let other = planner.other(&it, &input([3.0, 0.0], &[], &[])).expect("it is known");
        assert_eq!(other.heading_rad, faces_rad, "{velocity:?}, {yaw_rad}");
    }
}

/// Eq. 9 between a parked robot and a pillar D apart, ρ_r = 0.51 and ρ_o = 0.40 (later: 0.50 and 0.47): in the middle a robot
/// of ρ_r/1.5 = 0.34 while |D - ρ_r| < ρ_o; an obstacle of r_rob + D/3 + s while 0.75 (ρ_r + ρ_o) < D < ρ_r + ρ_o; the readings of
/// the text, (D + ρ_r + ρ_o)/2 and D/2 + (ρ_r + ρ_o)/4, while D < ρ_r + ρ_o.
#[test]
fn a_parked_robot_and_a_pillar_close_a_gap() {
    let of = |params: &Params, d: f64, [rho_r, rho_o, radius]: [f64; 3]| {
        trap(params, Point2::new(1.0, 0.0), Point2::new(1.0, d), rho_r, rho_o, radius)
    };
    let check = |params: &Params, zones, d: f64, expected: Option<(f64, bool)>| {
        let found = of(params, d, zones);
        assert_eq!(found.is_some(), expected.is_some(), "{:?}, {d}", params.traps);
        if let (Some(Trap { center, rho_m, parked }), Some((rho, as_robot))) = (found, expected) {
            assert!((rho_m - rho).abs() < 1e-9 && parked == as_robot, "{:?}, {d}: {rho_m}", params.traps);
            assert_eq!(center, Point2::new(1.0, d / 2.0));
        }
    };
    let early = [0.51, 0.40, 0.22];
    for (d, acts) in [(0.1, false), (0.12, true), (0.9, true), (0.92, false)] {
        for which in [Preset::P, Preset::C1, Preset::Fixed, Preset::Fleet] {
            check(&preset(which), early, d, acts.then_some((0.34, true)));
        }
        let text = preset(Preset::Text);
        check(&text, early, d, (d < 0.91).then_some(((d + 0.91) / 2.0, false)));
        check(
            &Params { traps: Traps::Half, ..text.clone() },
            early,
            d,
            (d < 0.91).then_some((d / 2.0 + 0.2275, false)),
        );
        check(&Params { traps: Traps::Off, ..text }, early, d, None);
    }
    for (d, acts) in [(0.72, false), (0.73, true), (0.96, true), (0.98, false)] {
        check(&preset(Preset::H), [0.50, 0.47, 0.20], d, acts.then_some((0.3 + d / 3.0, false)));
    }
}

/// Eq. 9 between two pillars: an ordinary pillar in the middle while ρ < D < 1.65 ρ; the readings of the text while the zones
/// meet, D < 2 ρ.
#[test]
fn two_pillars_close_a_gap() {
    let of = |pillar_gaps, d| pillar_gap(&Params { pillar_gaps, ..preset(Preset::P) }, d, 0.4);
    for (d, midpoint, meet) in
        [(0.39, false, true), (0.41, true, true), (0.65, true, true), (0.67, false, true), (0.81, false, false)]
    {
        assert_eq!(of(PillarGaps::Off, d), None);
        assert_eq!(of(PillarGaps::Midpoint, d), midpoint.then_some(0.4), "{d}");
        assert_eq!(of(PillarGaps::Cover, d), meet.then_some(d / 2.0 + 0.4), "{d}");
        assert_eq!(of(PillarGaps::Half, d), meet.then_some(d / 2.0 + 0.2), "{d}");
    }
}

/// Eqs. 5 and 8: all obstacles and robots within reach are summed up, those of Eq. 9 included.
#[test]
fn forces_add_up() {
    let goal = [3.0, 0.2];
    let own = own(0.0, goal);
    let discs = [pillar(0, [0.6, -0.1]), pillar(1, [-0.4, 0.5])];
    let mut robots = [Neighbor { arrived: true, ..neighbor(1, [0.6, 0.5]) }, neighbor(2, [0.3, -0.8])];
    for (which, arrived) in [(Preset::P, true), (Preset::P, false), (Preset::H, true)] {
        let params = preset(which);
        robots[0].arrived = arrived;
        let mut planner = planner_of(params.clone(), 0);
        let scene = input(goal, &discs, &robots);
        let sum = planner.sum(&scene, &own, false);
        let rho_o = 0.33 + params.safety_m;
        let push = |at: [f64; 2], rho| obstacle(&params, &own, at.into(), rho, 0.0, false);
        let others = robots.map(|it| planner.other(&it, &scene).expect("it is known"));
        let obstacles = push([0.6, -0.1], rho_o) + push([-0.4, 0.5], rho_o);
        let mut pushes: Vector2<f64> = others.iter().map(|other| robot(&params, &own, other).force).sum();
        // A robot that only waits makes no trap.
        match (which, arrived) {
            (Preset::P, true) => {
                let middle = Other { position: Point2::new(0.6, 0.2), rho_m: 0.34, parked: true, ..others[0] };
                pushes += robot(&params, &own, &middle).force;
            }
            (Preset::H, _) => {
                // 0.6 m is less than 0.75 (0.54 + 0.43): nothing.
            }
            _ => {}
        }
        assert_near(sum.robots, pushes.into(), "robots");
        assert_near(sum.obstacles, obstacles.into(), "obstacles");
    }
    // The later program, 0.8 m apart: an obstacle of 0.22 + 0.8/3 + 0.1 in the middle.
    let params = preset(Preset::H);
    let discs = [pillar(0, [0.6, -0.3])];
    let robots = [Neighbor { arrived: true, ..neighbor(1, [0.6, 0.5]) }];
    let sum = planner_of(params.clone(), 0).sum(&input(goal, &discs, &robots), &own, false);
    let expected = obstacle(&params, &own, Point2::new(0.6, -0.3), 0.43, 0.0, false)
        + obstacle(&params, &own, Point2::new(0.6, 0.1), 0.32 + 0.8 / 3.0, 0.0, false);
    assert_near(sum.obstacles, expected.into(), "the later program");
    // Beyond 2 ρ_r = 1.08 the parked robot makes no trap.
    let robots = [Neighbor { arrived: true, ..neighbor(1, [1.0, 0.5]) }];
    let discs = [pillar(0, [0.5, -0.1])];
    let sum = planner_of(params.clone(), 0).sum(&input(goal, &discs, &robots), &own, false);
    assert_near(sum.obstacles, obstacle(&params, &own, Point2::new(0.5, -0.1), 0.43, 0.0, false).into(), "too far");
}

/// Eq. 11: the pull, the obstacles, the robots and the crowds.
#[test]
fn the_total_force() {
    let goal = [9.0, 0.3];
    let discs = [pillar(0, [0.5, 0.3])];
    // The two of the crowd are out of reach by themselves, the third one is not, and belongs to no crowd.
    let robots = [neighbor(1, [1.3, 0.5]), neighbor(2, [1.3, -0.5]), neighbor(3, [-0.8, 0.0])];
    let (params, own) = (preset(Preset::Fixed), own(0.0, goal));
    let mut planner = planner_of(params.clone(), 0);
    let scene = input(goal, &discs, &robots);
    let third = planner.other(&robots[2], &scene).expect("it is known");
    let crowd = force(&params, &own, Point2::new(1.3, 0.0), 0.5 + 0.51, false);
    let expected =
        obstacle(&params, &own, Point2::new(0.5, 0.3), 0.4, 0.0, false) + robot(&params, &own, &third).force + crowd;
    assert!(crowd.norm() > 4.0);
    let plan = planner.plan(&scene);
    assert_near(plan.repulsive, expected.into(), "pushes");
    assert_near(plan.attractive, (Vector2::new(9.0, 0.3).normalize() * 4.0).into(), "pull");
}

/// Eq. 9 between two pillars 0.5 m apart: with `midpoint` an ordinary one between them.
#[test]
fn gaps_between_pillars_add_up() {
    let goal = [3.0, 0.2];
    let own = own(0.0, goal);
    let discs = [pillar(0, [0.6, 0.25]), pillar(1, [0.6, -0.25])];
    for which in [Preset::Fleet, Preset::Fixed, Preset::P, Preset::C1] {
        let params = preset(which);
        let push = |at: [f64; 2]| obstacle(&params, &own, at.into(), 0.4, 0.0, false);
        let closed = params.pillar_gaps == PillarGaps::Midpoint;
        assert_eq!(closed, matches!(which, Preset::Fleet | Preset::Fixed));
        let middle = if closed { push([0.6, 0.0]) } else { Vector2::zeros() };
        let sum = planner_of(params.clone(), 0).sum(&input(goal, &discs, &[]), &own, false);
        assert_near(sum.obstacles, (push([0.6, 0.25]) + push([0.6, -0.25]) + middle).into(), "pillars");
    }
}

/// Step 1 of Eq. 10: robots within c_r 2ρ_r, those that have arrived only within 2ρ_r; later: moving ones on the side of the
/// goal. Nothing while the goal is nearer than c_g 2ρ_r. 2ρ_r is 1.02 m, later 1.08 m.
#[test]
fn who_may_belong_to_a_crowd() {
    let count = |which, goal: [f64; 2], it: Neighbor| {
        let mut planner = planner(which);
        planner.crowds(&input(goal, &[], &[it]), &own(0.0, goal), false);
        planner.scratch.candidates.len()
    };
    let goal = [9.0, 0.0];
    for (which, reach_m) in
        [(Preset::Text, 2.55), (Preset::Fixed, 2.55), (Preset::P, 2.55), (Preset::C1, 3.06), (Preset::H, 3.24)]
    {
        for (d, counts) in [(reach_m - 0.01, 1), (reach_m + 0.01, 0)] {
            assert_eq!(count(which, goal, neighbor(1, [d, 0.0])), counts, "{which:?}, {d}");
        }
    }
    let arrived = |d| Neighbor { arrived: true, ..neighbor(1, [d, 0.0]) };
    let stopped = Neighbor { stopped: true, ..neighbor(1, [1.5, 0.0]) };
    for which in [Preset::Fixed, Preset::P, Preset::C1] {
        assert_eq!([1.01, 1.03].map(|d| count(which, goal, arrived(d))), [1, 0], "{which:?}");
        assert_eq!((count(which, goal, stopped), count(which, goal, neighbor(1, [-1.5, 0.0]))), (1, 1), "{which:?}");
    }
    assert_eq!((count(Preset::H, goal, stopped), count(Preset::H, goal, arrived(0.5))), (0, 0));
    assert_eq!([[0.1, 1.0], [-0.1, 1.0]].map(|at| count(Preset::H, goal, neighbor(1, at))), [1, 0]);
    // c_g: 2.5, C1 3.0, H 2.0.
    for (which, near_m) in [(Preset::Fixed, 2.55), (Preset::P, 2.55), (Preset::C1, 3.06), (Preset::H, 2.16)] {
        let near = [near_m - 0.01, near_m + 0.01].map(|d| count(which, [d, 0.0], neighbor(1, [1.0, 0.0])));
        assert_eq!(near, [0, 1], "{which:?}");
    }
    // The default goes round no crowds.
    assert_eq!(count(Preset::Fleet, goal, neighbor(1, [1.0, 0.0])), 0);
}

/// What the flags make of a command, at 0.2 m/s: P with a force of (4, 0.4), which alone gives 0.2 m/s and 0.5 rad/s.
#[test]
fn stops() {
    let of = |which, force: [f64; 2], front_stop, yields| {
        let sum = Sum { front_stop, yields, ..Sum::default() };
        let twist = planner(which).command(force.into(), &sum, &input([3.0, 0.0], &[], &[]));
        (twist.speed_mps, twist.turn_radps)
    };
    for which in [Preset::P, Preset::Fixed, Preset::Fleet] {
        assert_eq!(of(which, [4.0, 0.4], false, false), (0.2, 0.5));
        assert_eq!(of(which, [4.0, 0.4], true, false), (0.0, 0.5), "front stop: it turns on");
        assert_eq!(of(which, [4.0, 0.4], false, true), (0.0, 0.5), "yield stop: the same");
        assert_eq!(of(which, [4.0, 0.4], true, true), (0.0, 0.5));
    }
    // Below 2°/s (0.0349 rad/s) it creeps, but not when it is guarded, nor when it yields.
    for (f_t, creeps) in [(0.027, true), (0.028, false)] {
        let turn = 5.0 * f_t / 4.0;
        assert_eq!(of(Preset::P, [4.0, f_t], true, false), (if creeps { 0.05 } else { 0.0 }, turn));
        assert_eq!(of(Preset::Fixed, [4.0, f_t], true, false), (0.0, turn));
        assert_eq!(of(Preset::P, [4.0, f_t], true, true), (0.0, turn));
    }
    // Later: straight on, slowly.
    assert_eq!(of(Preset::H, [4.0, 0.4], false, true), (0.05, 0.0));
    assert_eq!(of(Preset::H, [4.0, 0.4], false, false), (0.2, 0.5));
}

/// Something nearer than ρ within 45° ahead blocks creeping; something within 1.5 ρ hides crowds from the later program.
#[test]
fn what_is_near_and_what_blocks() {
    let own = own(0.0, [3.0, 0.0]);
    let of = |obstacles: &[Obstacle], neighbors: &[Neighbor]| {
        let sum = planner(Preset::Fixed).sum(&input([3.0, 0.0], obstacles, neighbors), &own, false);
        (sum.near, sum.blocked)
    };
    for (d, bearing_deg, expected) in [
        (0.39, 0.0, (true, true)),
        (0.39, 44.0, (true, true)),
        (0.39, -46.0, (true, false)),
        (0.41, 0.0, (true, false)),
        (0.59, 90.0, (true, false)),
        (0.61, 0.0, (false, false)),
    ] {
        assert_eq!(of(&[pillar(0, super::off([0.0, 0.0], d, bearing_deg))], &[]), expected, "{d} m, {bearing_deg}°");
        // ρ_r = 0.51.
        let at = super::off([0.0, 0.0], d * 0.51 / 0.4, bearing_deg);
        assert_eq!(of(&[], &[neighbor(1, at)]), expected, "{d} m, {bearing_deg}°");
    }
}

/// "Stopped" is told while it is true, in the programs of 2023 for good: until there is another goal.
#[test]
fn stopped_is_told() {
    // It leaves in front of us.
    let ahead = [neighbor(1, [0.45, 0.05])];
    for (which, sticks) in [(Preset::Fleet, false), (Preset::Fixed, false), (Preset::P, true), (Preset::C1, true)] {
        let mut planner = planner(which);
        assert!(!planner.plan(&input([3.0, 0.0], &[], &[])).stopped, "{which:?}");
        assert!(planner.plan(&input([3.0, 0.0], &[], &ahead)).stopped, "{which:?}");
        assert_eq!(planner.plan(&input([3.0, 0.0], &[], &[])).stopped, sticks, "{which:?}");
        assert!(!planner.plan(&input([3.0, 1.0], &[], &[])).stopped, "{which:?}");
    }
}

/// The default brakes for everything that it knows of: obstacles on their course, robots on their way, and those that
/// have arrived as things that stand.
#[test]
fn what_the_default_brakes_for() {
    let own = own(0.0, [3.0, 0.0]);
    let moving = Obstacle { velocity: Vector2::new(-0.1, 0.0), ..pillar(0, [0.45, 0.0]) };
    let robots = [
        neighbor(1, [0.5, 0.0]),
        Neighbor { arrived: true, ..neighbor(2, [0.0, 0.5]) },
        Neighbor { age_s: 3.0, ..neighbor(3, [0.0, -0.5]) },
        // So far away that nothing comes of it in time.
        neighbor(4, [-0.6, 0.0]),
    ];
    let mut planner = planner(Preset::Fleet);
    planner.sum(&input([3.0, 0.0], &[moving], &robots), &own, false);
    let expected = [
        Near::thing(&own, Point2::new(0.45, 0.0), 0.45 - 0.11 - 0.22, moving.velocity),
        Near::robot(&own, Point2::new(0.5, 0.0), 0.5 - 0.22 - 0.22),
        Near::thing(&own, Point2::new(0.0, 0.5), 0.5 - 0.22 - 0.22, Vector2::zeros()),
    ];
    assert_eq!(planner.near, expected);
    // A margin to plan with does not make a body wider.
    let mut wide = planner_of(Params { margin_m: 0.1, ..preset(Preset::Fleet) }, 0);
    wide.sum(&input([3.0, 0.0], &[moving], &robots), &own, false);
    assert_eq!(wide.near, expected);
    let far = [pillar(0, [2.5, 0.0])];
    for (keep_m, expected_mps) in [(0.0, 0.2), (2.0, 0.2), (2.15, 0.1), (2.2, 0.0)] {
        let mut planner = planner_of(Params { keep_m, ..preset(Preset::Fleet) }, 0);
        let Drive::Twist { speed_mps, .. } = planner.plan(&input([3.0, 0.0], &far, &[])).drive else {
            panic!("a twist")
        };
        assert!((speed_mps - expected_mps).abs() < 1e-9, "{keep_m}: {speed_mps}");
    }
}

/// A robot that has come no nearer for 4 s turns its pull aside, and is only pushed straight away from what is real: no
/// sides, no traps, no gaps, no crowds, no waiting.
#[test]
fn a_detour_is_plain() {
    let goal = [3.0, 0.2];
    let discs = [pillar(0, [0.6, 0.25]), pillar(1, [0.6, -0.25])];
    let robots =
        [Neighbor { arrived: true, ..neighbor(1, [0.6, 0.85]) }, neighbor(2, [-0.45, 0.1]), neighbor(3, [0.45, 0.05])];
    let params = preset(Preset::Fleet);
    let mut planner = planner_of(params.clone(), 0);
    let scene = input(goal, &discs, &robots);
    let plans: Vec<crate::Plan> = (0..60).map(|_| planner.plan(&scene)).collect();
    let pull = Vector2::new(3.0, 0.2).normalize() * 4.0;
    let aside = |plan: &crate::Plan| pull.angle(&plan.attractive).to_degrees();
    // The first tick is progress from nothing.
    let begin = plans.iter().position(|plan| aside(plan) > 1.0).expect("there is a detour");
    assert_eq!(begin, 42);
    assert!(plans[0].stopped && plans[begin - 1].stopped && !plans[begin].stopped);
    assert!((59.9..120.1).contains(&aside(&plans[begin])));
    let away = |at: [f64; 2], rho: f64| -Vector2::from(at).normalize() * params.push(Vector2::from(at).norm(), rho);
    let expected = away([0.6, 0.25], 0.4)
        + away([0.6, -0.25], 0.4)
        + away([0.6, 0.85], 0.51)
        + away([-0.45, 0.1], 0.51)
        + away([0.45, 0.05], 0.51);
    assert_near(plans[begin].repulsive, expected.into(), "pushes");
    assert!((plans[0].repulsive - expected).norm() > 1.0);
    // Another goal, another try.
    assert!(aside(&planner.plan(&input([3.0, 0.3], &discs, &robots))) < 5.0);
}

/// What tells the presets apart.
#[test]
fn presets() {
    let all = [Preset::Fleet, Preset::Fixed, Preset::Text, Preset::P, Preset::C1, Preset::H].map(preset);
    let of = |get: fn(&Params) -> f64| all.each_ref().map(get);
    assert_eq!(of(|p| p.keep_m), [0.02, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(of(|p| p.patience_s), [4.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(of(|p| p.reach), [2.0, 2.0, 1.0, 2.0, 2.0, 2.0]);
    assert_eq!(of(|p| f64::from(p.bracket_power)), [2.0, 2.0, 1.0, 2.0, 2.0, 2.0]);
    assert_eq!(of(|p| p.c_a), [4.0; 6]);
    assert_eq!(of(|p| p.safety_m), [0.07, 0.07, 0.07, 0.07, 0.07, 0.1]);
    assert_eq!(of(|p| p.phi_o_deg), [20.0; 6]);
    assert_eq!(of(|p| p.phi_r_deg), [10.0; 6]);
    assert_eq!(of(|p| p.k_o), [3.0, 3.0, 0.0, 3.0, 2.0, 3.0]);
    assert_eq!(of(|p| p.k_r_far), [2.0, 2.0, 0.0, 2.0, 2.0, 3.0]);
    assert_eq!(of(|p| p.k_r_near), [4.0, 4.0, 0.0, 4.0, 4.0, 4.0]);
    assert_eq!(of(|p| p.c_r), [2.5, 2.5, 2.5, 2.5, 3.0, 3.0]);
    assert_eq!(of(|p| p.c_g), [2.5, 2.5, 2.5, 2.5, 3.0, 2.0]);
    assert_eq!(of(|p| p.c_adj), [2.2; 6]);
    assert_eq!(of(|p| p.c_rad), [2.5; 6]);
    assert_eq!(of(|p| p.crowd_wait_s), [5.0, 5.0, 5.0, 0.0, 0.0, 0.0]);
    assert_eq!(of(|p| p.turn_gain), [5.0, 5.0, 5.0, 5.0, 3.0, 5.0]);
    assert_eq!(of(|p| p.creep), [0.25; 6]);
    assert_eq!(of(|p| p.front_half_angle_deg), [45.0, 45.0, 45.0, 45.0, 90.0, 45.0]);
    let of = |get: fn(&Params) -> bool| all.each_ref().map(get);
    assert_eq!(of(|p| p.guarded), [true, true, true, false, false, false]);
    assert_eq!(of(|p| p.sticky_stop), [false, false, false, true, true, false]);
    assert_eq!(of(|p| p.follow_stop), [false, true, true, true, false, true]);
    assert_eq!(of(|p| p.right_of_way), [true, true, true, true, true, false]);
    assert_eq!(of(|p| p.side == Side::Offsets), [true, false, false, false, true, false]);
    assert_eq!(of(|p| p.exact || p.sgn_zero), [false; 6]);
    let named = [Preset::Fleet, Preset::Fixed, Preset::Text, Preset::P, Preset::C1, Preset::H];
    assert_eq!(all.each_ref().map(|p| p.preset), named);
    assert_eq!(Params::of_values(&model::ParamValues::new()), preset(Preset::Fleet));
}
