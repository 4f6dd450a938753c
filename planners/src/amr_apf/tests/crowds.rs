//! Eq. 10: which robots are a crowd, the circle around it, what it means, and its force. ρ_r is 0.51 m in the presets
//! with s = 0.07 m (radius 0.22 m), 0.50 m in the later program (radius 0.20 m).

use super::{assert_near, off, own, preset, world};
use crate::amr_apf::clusters::{Crowd, Member, Scratch, crowd, crowds, force};
use crate::amr_apf::field::Own;
use crate::amr_apf::params::{Params, Preset, Which};
use nalgebra::{Point2, Vector2};

const RADIUS_M: f64 = 0.22;

fn members(places: &[[f64; 2]]) -> Vec<Member> {
    places.iter().map(|place| Member { position: Point2::from(*place), arrived: false }).collect()
}

/// A square with this side, its lower left corner here.
fn square([x, y]: [f64; 2], side: f64) -> [[f64; 2]; 4] {
    [[x, y], [x + side, y], [x + side, y + side], [x, y + side]]
}

#[track_caller]
fn check_circle(params: &Params, radius_m: f64, group: &[Member], expected: ([f64; 2], f64)) {
    let Crowd::Around { center, rho_m } = crowd(params, &own(0.0, [9.0, 0.0]), radius_m, group) else {
        panic!("the crowd acts")
    };
    assert!((center - Point2::from(expected.0)).norm() < 1e-9, "{center:?} instead of {expected:?}");
    assert!((rho_m - expected.1).abs() < 1e-9, "{rho_m} instead of {expected:?}");
}

/// Eq. 10 read literally: the smallest circle around the crowd, and ρ_r more.
#[test]
fn the_smallest_circle() {
    for params in [preset(Preset::Fixed), preset(Preset::Fleet), preset(Preset::Text)] {
        let check = |places: &[[f64; 2]], center, radius: f64| {
            check_circle(&params, RADIUS_M, &members(places), (center, radius + 0.51));
        };
        check(&[[2.0, -0.5], [2.0, 0.5]], [2.0, 0.0], 0.5);
        check(&square([2.0, -0.5], 1.0), [2.5, 0.0], 0.5f64.sqrt());
        // An obtuse triangle has its longest side as diameter, an equilateral one its centroid as centre.
        check(&[[2.0, -0.6], [2.0, 0.6], [2.1, 0.0]], [2.0, 0.0], 0.6);
        let height = 0.75f64.sqrt();
        check(&[[2.0, 0.0], [3.0, 0.0], [2.5, height]], [2.5, height / 3.0], 2.0 * height / 3.0);
    }
}

/// The programs of 2023: two make an equilateral triangle on the side away from the robot, with r_c = L/√2; three or
/// more a rectangle, with r_c of 2.5 times half its shorter side, at least 2 ρ_r. ρ_c = r_c + r_rob + s.
#[test]
fn the_circle_by_triangle_and_rectangle() {
    let height = 0.5 / 3f64.sqrt();
    for params in [preset(Preset::P), preset(Preset::C1)] {
        let check = |group: &[Member], center, r_c: f64| {
            check_circle(&params, RADIUS_M, group, (center, r_c + 0.29));
        };
        let pair = members(&[[2.0, -0.5], [2.0, 0.5]]);
        check(&pair, [2.0 + height, 0.0], 0.5f64.sqrt());
        // One that has arrived does not make three of them; the two that are farthest left and right count.
        let arrived = Member { position: Point2::new(2.2, 0.1), arrived: true };
        check(&[arrived, pair[1], pair[0]], [2.0 + height, 0.0], 0.5f64.sqrt());
        check(&members(&square([2.0, -0.5], 1.0)), [2.5, 0.0], 1.25);
        check(&members(&square([2.0, -0.3], 0.6)), [2.3, 0.0], 1.02);
        check(&members(&[[2.0, -0.45], [3.0, -0.45], [3.0, 0.45], [2.0, 0.45]]), [2.5, 0.0], 1.125);
    }
}

/// The later program: two as they are, three or more around the mean of the corners, the lowest of which counts twice;
/// r_c = distance + r_rob, ρ_c = r_c + r_rob + s.
#[test]
fn the_circle_around_the_mean() {
    let params = preset(Preset::H);
    let check = |places: &[[f64; 2]], center, farthest: f64| {
        check_circle(&params, 0.2, &members(places), (center, farthest + 0.5));
    };
    check(&[[2.0, -0.5], [2.0, 0.5]], [2.0, 0.0], 0.5);
    check(&[[2.0, 0.0], [2.0, -0.6], [2.0, 0.6]], [2.0, 0.0], 0.6);
    check(&square([2.0, -0.5], 1.0), [2.4, -0.1], 0.72f64.sqrt());
}

/// A goal inside the circle: nothing to go round. The robot strictly inside the hull: wait.
#[test]
fn what_a_crowd_means() {
    let around_us = members(&square([-0.5, -0.5], 1.0));
    let ahead = members(&square([2.0, -0.5], 1.0));
    let meaning = |which, goal, group: &[Member]| crowd(&preset(which), &own(0.0, goal), RADIUS_M, group);
    let acts = |crowd| matches!(crowd, Crowd::Around { .. });
    // r_c is √½ + 0.22 = 0.927 here, 1.25 by rectangle, √0.72 + 0.22 = 1.069 around the mean.
    for (which, at_x, inside, outside) in
        [(Preset::Fleet, 2.5, 0.92, 0.93), (Preset::P, 2.5, 1.24, 1.26), (Preset::H, 2.4, 1.06, 1.07)]
    {
        let y = if which == Preset::H { -0.1 } else { 0.0 };
        assert_eq!(meaning(which, [at_x + inside, y], &ahead), Crowd::HoldsGoal, "{which:?}");
        assert!(acts(meaning(which, [at_x + outside, y], &ahead)), "{which:?}");
        assert_eq!(meaning(which, [6.0, 0.0], &around_us), Crowd::HoldsRobot, "{which:?}");
        assert_eq!(meaning(which, [0.3, 0.2], &around_us), Crowd::HoldsGoal, "{which:?}");
        // In the circle, but not in the hull: the later program asks for the circle only.
        let held = if which == Preset::H { Crowd::HoldsGoal } else { Crowd::HoldsRobot };
        assert_eq!(meaning(which, [0.6, 0.0], &around_us), held, "{which:?}");
        // On the edge of the hull is not inside.
        assert!(acts(meaning(which, [6.0, 0.0], &members(&square([0.0, -0.5], 1.0)))), "{which:?}");
    }
    // Two robots do not hold a third one, and those that have arrived do not close a crowd.
    assert!(acts(meaning(Preset::Fleet, [6.0, 0.0], &around_us[..2])));
    let mut opened = around_us;
    (opened[0].arrived, opened[1].arrived) = (true, true);
    for which in [Preset::Fleet, Preset::P] {
        assert!(acts(meaning(which, [6.0, 0.0], &opened)), "{which:?}");
    }
}

/// What the crowds among these robots do.
fn all(params: &Params, own: &Own, candidates: &[Member]) -> Vector2<f64> {
    let mut scratch = Scratch::default();
    scratch.candidates.extend_from_slice(candidates);
    crowds(params, own, RADIUS_M, false, &mut scratch, |force| force).force
}

/// What one crowd of these robots does.
fn one(params: &Params, own: &Own, group: &[Member]) -> Vector2<f64> {
    match crowd(params, own, RADIUS_M, group) {
        Crowd::Around { center, rho_m } => force(params, own, center, rho_m, false),
        other => panic!("the crowd acts, not {other:?}"),
    }
}

/// Robots nearer than 2.2 ρ_r = 1.122 m belong together, also by way of a third one, in any order; one robot is not a crowd.
#[test]
fn who_belongs_together() {
    let (params, own) = (preset(Preset::Fixed), own(0.0, [9.0, 1.0]));
    let chain = members(&[[1.2, -1.12], [1.2, 1.12], [1.2, 0.0]]);
    assert!(one(&params, &own, &chain).norm() > 1.0);
    assert_near(all(&params, &own, &chain), one(&params, &own, &chain).into(), "a chain");
    assert_near(all(&params, &own, &chain[..2]), [0.0, 0.0], "the ends of it");
    assert_near(all(&params, &own, &members(&[[1.2, 0.0], [1.2, 1.125]])), [0.0, 0.0], "1.125 m apart");
    assert_near(all(&params, &own, &chain[2..]), [0.0, 0.0], "one");
    let wider = Params { c_adj: 4.5, ..params };
    assert_near(all(&wider, &own, &chain[..2]), one(&wider, &own, &chain[..2]).into(), "a wider c_adj");
}

/// C1 does not link two that have arrived.
#[test]
fn arrived_robots_are_linked_or_not() {
    let own = own(0.0, [9.0, 1.0]);
    let mut pair = members(&[[1.2, -0.5], [1.2, 0.5]]);
    for (first, second, linked) in [(true, true, false), (true, false, true), (false, false, true)] {
        (pair[0].arrived, pair[1].arrived) = (first, second);
        for (which, links) in [(Preset::C1, linked), (Preset::P, true)] {
            assert_eq!(all(&preset(which), &own, &pair) != Vector2::zeros(), links, "{which:?}, {first}, {second}");
        }
    }
}

/// The programs of 2023 join in one pass over lists of later robots: the second misses the first group here, because
/// what links it comes only later.
#[test]
fn one_pass_joins_less() {
    let own = own(0.0, [9.0, 1.0]);
    let row = members(&[[1.5, -1.5], [1.5, 1.5], [1.5, 0.5], [1.5, -0.5]]);
    let params = Params { c_adj: 2.2, ..preset(Preset::C1) };
    assert_near(all(&params, &own, &row), one(&params, &own, &row).into(), "a connected component");
    let exact = Params { exact: true, ..params };
    let groups = [[row[0], row[2], row[3]].to_vec(), [row[1], row[2]].to_vec()];
    let expected: Vector2<f64> = groups.iter().map(|group| one(&exact, &own, group)).sum();
    assert_near(all(&exact, &own, &row), expected.into(), "one pass");
}

/// All crowds act in C1 and `fixed`, none by default, in P the one with the largest circle, in H the one with most members.
#[test]
fn which_crowds_act() {
    let own = own(0.0, [9.0, 0.0]);
    // A wide pair, and three that stand close together.
    let wide = members(&[[1.5, 0.3], [1.5, 1.3]]);
    let close = members(&[[1.2, -1.4], [1.4, -1.4], [1.3, -1.2]]);
    for groups in [[&wide[..], &close[..]], [&close[..], &wide[..]]] {
        let both = groups.concat();
        let base = preset(Preset::Fixed);
        let with = |clusters| Params { clusters, ..base.clone() };
        let forces = [&wide[..], &close[..]].map(|group| one(&base, &own, group));
        assert_near(all(&with(Which::All), &own, &both), (forces[0] + forces[1]).into(), "all");
        assert_near(all(&with(Which::Largest), &own, &both), forces[0].into(), "the largest");
        assert_near(all(&with(Which::Fullest), &own, &both), forces[1].into(), "the fullest");
        assert_near(all(&with(Which::Off), &own, &both), [0.0, 0.0], "none");
    }
    let which =
        [Preset::Fleet, Preset::Fixed, Preset::Text, Preset::C1, Preset::P, Preset::H].map(|p| preset(p).clusters);
    assert_eq!(which, [Which::Off, Which::All, Which::All, Which::All, Which::Largest, Which::Fullest]);
}

/// A crowd that holds the robot stops it.
#[test]
fn a_crowd_stops_whom_it_holds() {
    let params = preset(Preset::Fixed);
    let mut scratch = Scratch::default();
    scratch.candidates.extend(members(&square([-0.5, -0.5], 1.0)));
    let mut of = |own: &Own| crowds(&params, own, RADIUS_M, false, &mut scratch, |force| force);
    assert!(of(&own(0.0, [6.0, 0.0])).stop);
    assert!(!of(&own(0.0, [0.3, 0.0])).stop);
    assert!(!of(&Own { position: Point2::new(1.0, 0.0), ..own(0.0, [6.0, 0.0]) }).stop);
}

/// 2023, with ρ_c = 1: obliquely back at 112.5° with μ + 4, on the side of the goal if γ < 160° or |ψ| < 20°, else on that of
/// the heading; straight back with μ + 2 if γ ≤ 36° or d ≤ 0.8 ρ_c (C1: ρ_c). C1 has no cut-off at 2 ρ_c.
#[test]
fn the_oblique_force() {
    let (p, c1) = (preset(Preset::P), preset(Preset::C1));
    // μ at 1.6 (x = 5/8), at 0.9 (x = 10/9): 4 (10/9 · 11/9)², at 0.8 (x = 5/4), and where it stands at 4 (x = 1/4).
    let [far, near, inside, beyond] = [0.09765625, 4.0 * (110f64 / 81.0).powi(2), 14.0625, 0.0625];
    let aside = |size: f64, side: f64| off([0.0, 0.0], size + 4.0, side * 112.5);
    let back = |size: f64| [-size - 2.0, 0.0];
    let goal = |d: f64, gamma_deg: f64| off([d, 0.0], 2.0, 180.0 - gamma_deg);
    for (what, d, heading_deg, goal, of_p, of_c1) in [
        ("heading to the left", 1.6, 30.0, [9.0, 0.0], aside(far, 1.0), aside(far, 1.0)),
        ("heading to the right", 1.6, -30.0, [9.0, 0.0], aside(far, -1.0), aside(far, -1.0)),
        ("γ of 161°", 1.6, -30.0, goal(1.6, 161.0), aside(far, -1.0), aside(far, -1.0)),
        ("γ of 159°", 1.6, -30.0, goal(1.6, 159.0), aside(far, 1.0), aside(far, 1.0)),
        ("ψ of 19°", 1.6, -19.0, goal(1.6, 170.0), aside(far, 1.0), aside(far, 1.0)),
        ("ψ of 21°", 1.6, -21.0, goal(1.6, 170.0), aside(far, -1.0), aside(far, -1.0)),
        ("γ of 37°", 1.6, 30.0, goal(1.6, 37.0), aside(far, 1.0), aside(far, 1.0)),
        ("γ of 35°", 1.6, 30.0, goal(1.6, 35.0), back(far), back(far)),
        ("0.9 ρ_c", 0.9, 30.0, [9.0, 0.0], aside(near, 1.0), back(near)),
        ("0.8 ρ_c", 0.8, 30.0, [9.0, 0.0], back(inside), back(inside)),
        ("4 ρ_c", 4.0, 30.0, [9.0, 0.0], [0.0, 0.0], aside(beyond, 1.0)),
    ] {
        let own = own(heading_deg, goal);
        let of = |params| world(&own, force(params, &own, Point2::new(d, 0.0), 1.0, false));
        assert_near(of(&p), of_p, what);
        assert_near(of(&c1), of_c1, what);
        // What is near does not matter to them.
        assert_eq!(force(&p, &own, Point2::new(d, 0.0), 1.0, true), force(&p, &own, Point2::new(d, 0.0), 1.0, false));
        assert_near(of(&preset(Preset::Fleet)), of_p, what);
    }
}

/// 2025: sideways only, with μ + 3 and φ_r = 10°, if nothing else is near and the centre is in the half-plane of the goal.
#[test]
fn the_tangential_force() {
    let params = preset(Preset::H);
    let far = 0.09765625 + 3.0;
    for (what, d, heading_deg, goal, near, aside) in [
        ("heading to the left", 1.6, 30.0, [9.0, -1.0], false, far),
        ("heading to the right", 1.6, -30.0, [9.0, 1.0], false, -far),
        ("dead ahead", 1.6, 9.0, [9.0, -1.0], false, -far),
        ("11° is not dead ahead", 1.6, 11.0, [9.0, -1.0], false, far),
        ("something is near", 1.6, 30.0, [9.0, -1.0], true, 0.0),
        ("β of 89°", 1.6, 30.0, off([0.0, 0.0], 9.0, 89.0), false, far),
        ("β of 91°", 1.6, 30.0, off([0.0, 0.0], 9.0, 91.0), false, 0.0),
        ("beyond 2 ρ_c", 2.01, 30.0, [9.0, -1.0], false, 0.0),
    ] {
        let own = own(heading_deg, goal);
        let found = force(&params, &own, Point2::new(d, 0.0), 1.0, near);
        assert_near(world(&own, found), [0.0, aside], what);
    }
}
