//! Eqs. 6 to 8: what another robot does, and when the robot waits for it.

use super::{assert_near, off, own, preset, world};
use crate::amr_apf::field::{Meeting, Other, Own, robot};
use crate::amr_apf::params::{Params, Preset};

const RHO_M: f64 = 0.5;
/// μ at 0.8 (x = 5/8), 0.625 (x = 4/5) and 0.4 m (x = 5/4), as for obstacles.
const FAR: f64 = 0.09765625;
const NEAR: f64 = 0.9216;
const INSIDE: f64 = 14.0625;
const BEYOND: [f64; 2] = [4.0, 0.0];

/// A robot on the x axis on its way. With a heading of 180° - a it sees us at an angle a, positive to its left.
fn other(d: f64, heading_deg: f64) -> Other {
    Other {
        position: [d, 0.0].into(),
        heading_rad: heading_deg.to_radians(),
        parked: false,
        right_of_way: false,
        rho_m: RHO_M,
        apart_rad: 0.0,
    }
}

/// The same parameters with the numbers of the programs for zones and gains.
fn with_rings(params: Params) -> Params {
    Params { reach: 2.0, bracket_power: 2, k_r_far: 2.0, k_r_near: 4.0, ..params }
}

fn meet(params: &Params, own: &Own, other: &Other) -> ([f64; 2], bool, bool) {
    let Meeting { force, front_stop, yields } = robot(params, own, other);
    (world(own, force).into(), front_stop, yields)
}

fn check(what: &str, params: &Params, own: &Own, other: &Other, expected: [f64; 2]) {
    assert_near(meet(params, own, other).0.into(), expected, what);
}

/// Eq. 6, both see the other on the same hand: both turn away from it, with and without right of way.
#[test]
fn the_same_hand_is_a_normal_pass() {
    let params = preset(Preset::P);
    for right_of_way in [false, true] {
        let it = |heading_deg| Other { right_of_way, ..other(0.8, heading_deg) };
        check("both on the left", &params, &own(-10.0, BEYOND), &it(170.0), [-FAR, -FAR - 2.0]);
        check("both on the right", &params, &own(10.0, BEYOND), &it(190.0), [-FAR, FAR + 2.0]);
        // Now the heading offsets would say otherwise: they do not count.
        check("both on the left", &params, &own(-40.0, BEYOND), &it(170.0), [-FAR, -FAR - 2.0]);
    }
}

/// Eq. 6, T = sgn(a_ij a_ji (P_i - P_j)) when the hands differ: the robot without right of way changes sides.
#[test]
fn the_right_of_way_chooses_the_side() {
    for params in [preset(Preset::P), preset(Preset::Fixed), preset(Preset::Text)].map(with_rings) {
        // It is on our left, we are on its right; and the mirror image.
        for (heading_deg, its_deg, its_side) in [(-10.0, 190.0, 1.0), (10.0, 170.0, -1.0)] {
            for (right_of_way, side) in [(false, its_side), (true, -its_side)] {
                let it = Other { right_of_way, ..other(0.8, its_deg) };
                check("far", &params, &own(heading_deg, BEYOND), &it, [-FAR, side * (FAR + 2.0)]);
                let it = Other { right_of_way, ..other(0.625, its_deg) };
                check("near", &params, &own(heading_deg, BEYOND), &it, [-NEAR, side * (NEAR + 4.0)]);
            }
        }
    }
}

/// The program of May 2023: who is farther off the line of sight.
#[test]
fn the_heading_offsets_choose_the_side() {
    for params in [preset(Preset::C1), preset(Preset::Fleet)] {
        for right_of_way in [false, true] {
            let it = Other { right_of_way, ..other(0.8, 190.0) };
            check("ours is larger", &params, &own(-20.0, BEYOND), &it, [-FAR, -FAR - 2.0]);
            check("theirs is larger", &params, &own(-5.0, BEYOND), &it, [-FAR, FAR + 2.0]);
        }
    }
}

/// Aside only between ρ and 2ρ, with the goal beyond (γ > 60°), and while both face each other.
#[test]
fn when_a_moving_robot_pushes_aside() {
    let params = preset(Preset::P);
    for (what, d, heading_deg, its_deg, goal, aside) in [
        ("facing", 0.8, -10.0, 170.0, BEYOND, true),
        ("γ of 61°", 0.8, -10.0, 170.0, off([0.8, 0.0], 1.0, 119.0), true),
        ("γ of 59°", 0.8, -10.0, 170.0, off([0.8, 0.0], 1.0, 121.0), false),
        ("89° off", 0.8, -89.0, 170.0, BEYOND, true),
        ("91° off", 0.8, -91.0, 170.0, BEYOND, false),
        ("it is 89° off", 0.8, -10.0, 91.0, BEYOND, true),
        ("it is 91° off", 0.8, -10.0, 89.0, BEYOND, false),
    ] {
        let expected = if aside { [-FAR, -FAR - 2.0] } else { [-FAR, 0.0] };
        check(what, &params, &own(heading_deg, goal), &other(d, its_deg), expected);
    }
    check("the near ring", &params, &own(-10.0, BEYOND), &other(0.625, 170.0), [-NEAR, -NEAR - 4.0]);
    check("near, 91° off", &params, &own(-91.0, BEYOND), &other(0.625, 170.0), [-NEAR, 0.0]);
    check("inside ρ", &params, &own(-10.0, BEYOND), &other(0.4, 170.0), [-INSIDE, 0.0]);
    check("out of reach", &params, &own(-10.0, BEYOND), &other(1.0, 170.0), [0.0, 0.0]);
    check("cut off at ρ", &Params { reach: 1.0, ..params }, &own(-10.0, BEYOND), &other(0.55, 170.0), [0.0, 0.0]);
}

/// A parked robot is passed like an obstacle, with φ_r = 10° and γ > 60°; in the near ring whatever the heading.
#[test]
fn a_parked_robot_is_passed_like_an_obstacle() {
    let params = preset(Preset::P);
    for (what, d, heading_deg, goal, aside) in [
        ("to the right", 0.8, 15.0, [4.0, -1.0], 1.0),
        ("to the left", 0.8, -15.0, [4.0, 1.0], -1.0),
        ("dead ahead", 0.8, 9.0, [4.0, -1.0], -1.0),
        ("11° is not dead ahead", 0.8, 11.0, [4.0, -1.0], 1.0),
        ("far, 91° off", 0.8, 91.0, BEYOND, 0.0),
        ("near, 91° off", 0.625, 91.0, BEYOND, 1.0),
        ("γ of 59°", 0.625, 15.0, off([0.625, 0.0], 1.0, 121.0), 0.0),
        ("γ of 61°", 0.625, 15.0, off([0.625, 0.0], 1.0, 119.0), 1.0),
        ("inside ρ", 0.4, 15.0, BEYOND, 0.0),
    ] {
        let (size, k) = if d == 0.8 { (FAR, 2.0) } else { (if d == 0.4 { INSIDE } else { NEAR }, 4.0) };
        // Where it faces and its right of way do not matter.
        for (its_deg, right_of_way) in [(170.0, false), (0.0, true)] {
            let it = Other { parked: true, right_of_way, ..other(d, its_deg) };
            check(what, &params, &own(heading_deg, goal), &it, [-size, aside * (size + k)]);
        }
    }
}

/// A robot nearer than ρ right ahead, moving or parked: P within 45°, C1 within 90°.
#[test]
fn front_stop() {
    for (which, within) in [(Preset::P, 45.0), (Preset::Fixed, 45.0), (Preset::Fleet, 45.0), (Preset::C1, 90.0)] {
        let params = preset(which);
        for (d, heading_deg, stops) in
            [(0.49, within - 1.0, true), (0.49, 1.0 - within, true), (0.49, within + 1.0, false), (0.51, 0.0, false)]
        {
            for parked in [false, true] {
                let it = Other { parked, ..other(d, 170.0) };
                let found = meet(&params, &own(heading_deg, BEYOND), &it).1;
                assert_eq!(found, stops, "{which:?}, {d} m, {heading_deg}°, parked {parked}");
            }
        }
    }
}

/// A moving robot nearer than ρ that leaves in front of us goes first; in C1 it does not push while it does.
#[test]
fn yield_to_who_leaves() {
    for (what, d, heading_deg, its_deg, parked, yields) in [
        ("it leaves", 0.49, 80.0, 0.0, false, true),
        ("it stands", 0.49, 80.0, 0.0, true, false),
        ("it is behind", 0.49, 100.0, 0.0, false, false),
        ("it comes", 0.49, 80.0, 170.0, false, false),
        ("it crosses, just coming", 0.49, 80.0, 91.0, false, false),
        ("it crosses, just leaving", 0.49, 80.0, 89.0, false, true),
        ("it is too far", 0.51, 80.0, 0.0, false, false),
    ] {
        let it = Other { parked, ..other(d, its_deg) };
        let own = own(heading_deg, [0.0, 4.0]);
        for which in [Preset::P, Preset::C1, Preset::Fleet] {
            let (force, _, found) = meet(&preset(which), &own, &it);
            assert_eq!(found, yields, "{what}, {which:?}");
            let silent = force == [0.0, 0.0];
            assert_eq!(silent, yields && which == Preset::C1, "{what}, {which:?}: {force:?}");
        }
    }
}

/// P only: wait behind a robot that drives ahead to where we want to go, and has right of way.
#[test]
fn follow_stop() {
    let ahead = Other { right_of_way: true, ..other(0.8, 10.0) };
    let at = |place: [f64; 2]| Other { position: place.into(), ..ahead };
    let goal = [1.2, 0.0];
    for (what, heading_deg, it, follows) in [
        ("it drives ahead", 0.0, ahead, true),
        ("it has no right of way", 0.0, Other { right_of_way: false, ..ahead }, false),
        ("it stands", 0.0, Other { parked: true, ..ahead }, false),
        ("the goal is 24° aside from there", 0.0, at([0.75, 0.2]), true),
        ("the goal is 34° aside from there", 0.0, at([0.75, 0.3]), false),
        ("it is behind", 0.0, at([-0.8, 0.0]), false),
        ("we turn 39° away", 39.0, ahead, true),
        ("we turn 41° away", 41.0, ahead, false),
        ("it turns 89° away", 0.0, Other { heading_rad: 89f64.to_radians(), ..ahead }, true),
        ("it turns 91° away", 0.0, Other { heading_rad: 91f64.to_radians(), ..ahead }, false),
        ("it is out of reach", 0.0, at([1.01, 0.0]), false),
    ] {
        let own = own(heading_deg, goal);
        for (which, can) in [(Preset::P, true), (Preset::Fixed, true), (Preset::C1, false), (Preset::Fleet, false)] {
            assert_eq!(meet(&preset(which), &own, &it).2, can && follows, "{what}, {which:?}");
        }
    }
}

/// The later program: aside in the half-plane of the goal, unless the other faces away; k_r = 3 in both rings.
#[test]
fn robots_by_half_planes() {
    let params = preset(Preset::H);
    for (what, d, heading_deg, its_deg, goal, expected) in [
        ("far", 0.8, 15.0, 170.0, BEYOND, [-FAR, FAR + 3.0]),
        ("inside ρ", 0.4, -15.0, 170.0, BEYOND, [-INSIDE, -INSIDE - 3.0]),
        ("dead ahead", 0.8, 9.0, 170.0, [4.0, -1.0], [-FAR, -FAR - 3.0]),
        ("not facing it", 0.8, 120.0, 170.0, BEYOND, [-FAR, FAR + 3.0]),
        ("β of 91°", 0.8, 15.0, 170.0, off([0.0, 0.0], 3.0, 91.0), [-FAR, 0.0]),
        ("it is 89° off", 0.8, 15.0, 91.0, BEYOND, [-FAR, FAR + 3.0]),
        ("it is 91° off", 0.8, 15.0, 89.0, BEYOND, [-FAR, 0.0]),
    ] {
        for parked in [false, true] {
            check(what, &params, &own(heading_deg, goal), &Other { parked, ..other(d, its_deg) }, expected);
        }
    }
}

/// The later program waits for a moving robot with right of way if the two would turn into each other (a_ij a_ji < 0);
/// as it is written, whenever the other sees it on its right.
#[test]
fn yields_by_half_planes() {
    let params = preset(Preset::H);
    for (what, heading_deg, its_deg, parked, right_of_way, meant, written) in [
        ("hands differ", -10.0, 190.0, false, true, true, true),
        ("hands differ, mirrored", 10.0, 170.0, false, true, true, false),
        ("both on the left", -10.0, 170.0, false, true, false, false),
        ("both on the right", 10.0, 190.0, false, true, false, true),
        ("no right of way", -10.0, 190.0, false, false, false, false),
        ("it stands", -10.0, 190.0, true, true, false, false),
    ] {
        let it = Other { parked, right_of_way, ..other(0.8, its_deg) };
        let own = own(heading_deg, BEYOND);
        assert_eq!(meet(&params, &own, &it).2, meant, "{what}");
        assert_eq!(meet(&params, &Own { sgn_zero: true, ..own }, &it).2, written, "{what}, as written");
    }
}
