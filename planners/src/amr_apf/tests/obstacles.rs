//! Eqs. 1 to 5: the pull, how things are seen, the side rule, and what obstacles do.

use super::{assert_near, off, own, preset, world};
use crate::amr_apf::field::{attraction, mu, obstacle};
use crate::amr_apf::params::{Params, Preset, Rule};
use nalgebra::Point2;
use std::f64::consts::{FRAC_PI_2, PI};

/// Eq. 1: C_a = 4 towards the goal, whatever its distance; twice that nearer than 0.5 m.
#[test]
fn the_pull_has_one_size() {
    let params = preset(Preset::P);
    for (heading_deg, goal, expected) in [
        (0.0, [3.0, 0.0], [4.0, 0.0]),
        (90.0, [30.0, 0.0], [0.0, -4.0]),
        (180.0, [0.0, 0.6], [0.0, -4.0]),
        (0.0, [0.0, 0.5], [0.0, 4.0]),
        (0.0, [0.0, 0.49], [0.0, 8.0]),
        (45.0, [0.3, 0.3], [8.0, 0.0]),
    ] {
        assert_near(attraction(&params, &own(heading_deg, goal)), expected, "pull");
    }
    assert_near(attraction(&Params { c_a: 3.0, ..params }, &own(0.0, [1.0, 0.0])), [3.0, 0.0], "another C_a");
}

/// Eq. 2, squared: 4 C ρ⁴ (1/d − 1/2ρ)² / d². At d = ρ it is C = 4, at ρ/2: 4 · 4² · 1.5² = 144, at 4ρ/3:
/// 4 · (3/4)² · (3/4 − 1/2)² · 4 = 0.5625, at 2ρ nothing.
#[test]
fn the_push_by_distance() {
    for rho in [0.4, 1.0, 3.0] {
        for (share, expected) in [(0.5, 144.0), (1.0, 4.0), (4.0 / 3.0, 0.5625), (2.0, 0.0), (2.5, 0.0)] {
            let found = mu(4.0, share * rho, rho);
            assert!((found - expected).abs() < 1e-9, "{share} ρ: {found}");
        }
        assert_eq!(mu(2.0, rho, rho), 2.0);
        assert!(mu(4.0, 0.0, rho).is_finite());
    }
}

/// The classical form, C ρ² (2ρ/d − 1) / d², is C at ρ as well: at ρ/2 4 · 4 · 3 = 48, at 4ρ/3 4 · 9/16 · 1/2 = 1.125. The cut-off
/// at ρ halves every length.
#[test]
fn the_other_readings_of_eq_2() {
    let classical = Params { bracket_power: 1, ..preset(Preset::Fixed) };
    for (share, expected) in [(0.5, 48.0), (1.0, 4.0), (4.0 / 3.0, 1.125), (2.0, 0.0), (2.5, 0.0)] {
        let found = classical.push(share * 0.4, 0.4);
        assert!((found - expected).abs() < 1e-9, "{share} ρ: {found}");
    }
    let cut = Params { reach: 1.0, obstacle_rule: Rule::HalfPlane, ..preset(Preset::Fixed) };
    let own = own(180.0, [-3.0, 0.0]);
    for (d, expected) in [(0.41, 0.0), (0.4 / 1.5, 0.5625), (0.2, 4.0), (0.1, 144.0)] {
        let force = obstacle(&cut, &own, Point2::new(d, 0.0), 0.4, 0.0, false);
        assert_near(world(&own, force), [-expected, 0.0], "cut off at ρ");
    }
    let text = preset(Preset::Text);
    assert_eq!((text.reach, text.bracket_power, text.k_o), (1.0, 1, 0.0));
    // 0.3 of 0.4: x = 2/3, 4 · 4/9 · 1/3; sideways as hard as back.
    let size = 16.0 / 27.0;
    let force = obstacle(&text, &super::own(30.0, [3.0, 0.0]), Point2::new(0.3, 0.0), 0.4, 0.0, false);
    assert_near(world(&super::own(30.0, [3.0, 0.0]), force), [-size, size], "the text");
}

/// ψ is positive for a thing to the right, β for a goal to the left of the line of sight; γ is the angle at the thing.
#[test]
fn how_a_thing_is_seen() {
    let seen = |heading_deg, goal, at: [f64; 2]| own(heading_deg, goal).sight(at.into(), 0.0);
    let sight = seen(30.0, [1.0, 0.0], [0.0, 2.0]);
    let degrees = [sight.theta, sight.psi, sight.beta].map(f64::to_degrees);
    for (found, expected) in degrees.into_iter().zip([90.0, -60.0, -90.0]) {
        assert!((found - expected).abs() < 1e-9, "{degrees:?}");
    }
    assert_eq!(sight.distance_m, 2.0);
    // Beyond the thing, beside it, before it.
    for (goal, gamma) in [([4.0, 0.0], PI), ([2.0, 2.0], FRAC_PI_2), ([2.0, -2.0], FRAC_PI_2), ([1.0, 0.0], 0.0)] {
        assert!((seen(0.0, goal, [2.0, 0.0]).gamma - gamma).abs() < 1e-9, "{goal:?}");
    }
    // Across the cut of the angle: a heading of 170° sees what is at -170° 20° to its left.
    let sight = seen(170.0, [1.0, 0.0], off([0.0, 0.0], 1.0, -170.0));
    assert!((sight.psi.to_degrees() + 20.0).abs() < 1e-9);
    // Centres that coincide are seen under the bearing that is given.
    assert_eq!(own(0.0, [1.0, 0.0]).sight(Point2::origin(), 1.0).theta, 1.0);
}

/// Eq. 3: the side of the heading, and nearly dead ahead (|ψ| < φ) that of the goal. T = sgn(β ψ) is the same.
#[test]
fn side_by_heading_and_by_goal() {
    let side = |heading_deg: f64, goal: [f64; 2], sgn_zero| {
        let own = crate::amr_apf::field::Own { sgn_zero, ..own(heading_deg, goal) };
        own.side(&own.sight(Point2::new(1.0, 0.0), 0.0), 20f64.to_radians())
    };
    for (heading_deg, goal_y, expected) in [
        (30.0, 1.0, 1.0),
        (30.0, -1.0, 1.0),
        (-30.0, 1.0, -1.0),
        (-30.0, -1.0, -1.0),
        (19.0, 1.0, 1.0),
        (19.0, -1.0, -1.0),
        (-19.0, 1.0, 1.0),
        (-19.0, -1.0, -1.0),
        (21.0, -1.0, 1.0),
        (-21.0, 1.0, -1.0),
    ] {
        for sgn_zero in [false, true] {
            assert_eq!(side(heading_deg, [3.0, goal_y], sgn_zero), expected, "{heading_deg}°, {goal_y}");
        }
    }
    // Exactly ahead: left, and with the programs' sgn(0) = 0 neither.
    assert_eq!((side(0.0, [3.0, 0.0], false), side(0.0, [3.0, 0.0], true)), (1.0, 0.0));
    assert_eq!((side(10.0, [3.0, 0.0], false), side(10.0, [3.0, 0.0], true)), (1.0, 0.0));
}

/// Eqs. 2 to 4 with ρ = 0.4, the pillar on the x axis. μ at 0.64 (x = 5/8): 4 (5/8 · 1/4)² = 0.09765625, at 0.5 (x = 4/5):
/// 4 (4/5 · 3/5)² = 0.9216, at 0.32 (x = 5/4): 4 (5/4 · 3/2)² = 14.0625. Sideways comes k_o = 3 more.
#[test]
fn an_obstacle_pushes_back_and_aside() {
    let (far, near, inside) = (0.09765625, 0.9216, 14.0625);
    let beyond = [3.0, 0.0];
    for (what, d, heading_deg, goal, expected) in [
        ("far, it is to the right", 0.64, 30.0, beyond, [-far, far + 3.0]),
        ("far, it is to the left", 0.64, -30.0, beyond, [-far, -far - 3.0]),
        ("far, dead ahead, goal to the right", 0.64, 10.0, [3.0, -1.0], [-far, -far - 3.0]),
        ("far, dead ahead, goal to the left", 0.64, -10.0, [3.0, 1.0], [-far, far + 3.0]),
        ("far, 21° is not dead ahead", 0.64, 21.0, [3.0, -1.0], [-far, far + 3.0]),
        ("far, not facing it", 0.64, 91.0, beyond, [-far, 0.0]),
        ("far, just facing it", 0.64, 89.0, beyond, [-far, far + 3.0]),
        ("near, not facing it", 0.5, 100.0, beyond, [-near, near + 3.0]),
        ("near, turned to the left of it", 0.5, -100.0, beyond, [-near, -near - 3.0]),
        ("inside ρ only back", 0.32, 30.0, beyond, [-inside, 0.0]),
        ("γ of 46°", 0.5, 30.0, off([0.5, 0.0], 1.0, 134.0), [-near, near + 3.0]),
        ("γ of 44°", 0.5, 30.0, off([0.5, 0.0], 1.0, 136.0), [-near, 0.0]),
        ("the goal before it", 0.5, 30.0, [0.2, 0.0], [-near, 0.0]),
        ("out of reach", 0.8, 30.0, beyond, [0.0, 0.0]),
    ] {
        let own = own(heading_deg, goal);
        let force = |params: &Params| world(&own, obstacle(params, &own, Point2::new(d, 0.0), 0.4, 0.0, false));
        assert_near(force(&preset(Preset::P)), expected, what);
        assert_near(force(&preset(Preset::Fixed)), expected, what);
        assert_near(force(&preset(Preset::Fleet)), expected, what);
        // C1: the same with k_o = 2.
        let aside = expected[1] - expected[1].signum() * if expected[1] == 0.0 { 0.0 } else { 1.0 };
        assert_near(force(&preset(Preset::C1)), [expected[0], aside], what);
    }
}

/// The later program: aside wherever the thing is in the half-plane of the goal, whatever the distance and the heading.
#[test]
fn an_obstacle_by_half_planes() {
    let (near, inside) = (0.9216, 14.0625);
    for (what, d, heading_deg, goal, expected) in [
        ("inside ρ", 0.32, 30.0, [3.0, 0.0], [-inside, inside + 3.0]),
        ("not facing it", 0.5, -120.0, [3.0, 0.0], [-near, -near - 3.0]),
        ("dead ahead", 0.5, -19.0, [3.0, 1.0], [-near, near + 3.0]),
        ("β of 89°", 0.5, 30.0, off([0.0, 0.0], 3.0, 89.0), [-near, near + 3.0]),
        ("β of 91°", 0.5, 30.0, off([0.0, 0.0], 3.0, 91.0), [-near, 0.0]),
        ("out of reach", 0.81, 30.0, [3.0, 0.0], [0.0, 0.0]),
    ] {
        let own = own(heading_deg, goal);
        let force = obstacle(&preset(Preset::H), &own, Point2::new(d, 0.0), 0.4, 0.0, false);
        assert_near(world(&own, force), expected, what);
    }
    // Beyond 2ρ the reference leaves the constant of one kind of virtual obstacle.
    let own = own(30.0, [3.0, 0.0]);
    let force = obstacle(&preset(Preset::H), &own, Point2::new(0.9, 0.0), 0.4, 0.0, true);
    assert_near(world(&own, force), [0.0, 3.0], "uncut");
}
