//! The two-link arm: kinematics and free space.

use model::random::Stream;
use nalgebra::Point2;
use shoal_geometry::arm::{Found, FreeSpace, GridSearch, Room, Through, shortest_grid_path};
use shoal_geometry::{ArmGeometry, Capsule, Elbow};
use std::f64::consts::{PI, TAU};

fn geometry(base: [f64; 2], links_m: [f64; 2], low: [f64; 2], high: [f64; 2]) -> ArmGeometry {
    ArmGeometry { base: base.into(), links_m, link_radius_m: 0.05, joint_min_rad: low, joint_max_rad: high }
}

/// The paper's arm.
fn papers() -> ArmGeometry {
    ArmGeometry { link_radius_m: 0.0, ..geometry([0.0, 0.0], [3.5, 3.5], [0.0, -PI / 2.0], [TAU, PI / 2.0]) }
}

#[test]
fn inverse_undoes_forward() {
    let mut stream = Stream::new(1, 0, 0, "arm");
    for _ in 0..2000 {
        let base = [stream.between(-5.0, 5.0), stream.between(-5.0, 5.0)];
        let links = [stream.between(0.2, 3.0), stream.between(0.2, 3.0)];
        let geometry = geometry(base, links, [-PI, -PI], [PI, PI]);
        let joints = [stream.between(-3.1, 3.1), stream.between(-3.1, 3.1)];
        let tip = geometry.tip(joints);
        let back = geometry.inverse(tip, Elbow::of(joints)).expect("it was there");
        assert!((back[0] - joints[0]).abs() < 1e-6 && (back[1] - joints[1]).abs() < 1e-6, "{joints:?} {back:?}");
        let other = geometry.inverse(tip, if Elbow::of(joints) == Elbow::Up { Elbow::Down } else { Elbow::Up });
        let other = other.expect("the mirrored pose exists too");
        assert!((geometry.tip(other) - tip).norm() < 1e-9 && (other[1] + joints[1]).abs() < 1e-6);
    }
}

/// The elbow of the sheet "up" lies counter-clockwise of the line from base to tip.
#[test]
fn sheets_are_named_by_the_side_of_the_elbow() {
    let geometry = papers();
    for (elbow, side) in [(Elbow::Up, 1.0), (Elbow::Down, -1.0)] {
        let tip = Point2::new(-2.0, 5.0);
        let joints = geometry.inverse(tip, elbow).expect("in reach");
        assert_eq!(Elbow::of(joints), elbow);
        assert!(side * tip.coords.perp(&geometry.elbow(joints).coords) > 0.0);
    }
}

/// The quick answer agrees with the long one: inverse kinematics, limits, distances.
#[test]
fn free_is_what_the_pose_says() {
    let mut stream = Stream::new(2, 0, 0, "arm");
    let (mut free, mut limited) = (0, 0);
    for i in 0..3000 {
        let range = if i % 2 == 0 { ([0.0, -PI / 2.0], [TAU, PI / 2.0]) } else { ([-1.0, -2.0], [2.5, 1.0]) };
        let geometry = geometry([0.5, -0.5], [1.5, 1.0], range.0, range.1);
        let tip = Point2::new(stream.between(-3.0, 3.0), stream.between(-3.0, 3.0));
        let wall_end = Point2::new(stream.between(0.0, 3.0), 1.5);
        let obstacles = [Capsule::disc([1.0, 1.0].into(), 0.3), Capsule::segment([-1.0, 1.5].into(), wall_end)];
        let room = Room { joint2_rad: 0.02, clearance_m: 0.1 };
        for elbow in Elbow::BOTH {
            let pose = geometry.inverse(tip, elbow);
            limited += usize::from(pose.is_some_and(|pose| !geometry.within_limits(pose, 0.02)));
            let slow = pose.is_some_and(|pose| {
                geometry.within_limits(pose, 0.02)
                    && pose[1].abs() >= 0.02
                    && geometry.clearance(pose, obstacles) >= 0.1
            });
            free += usize::from(slow);
            assert_eq!(geometry.is_free(tip, elbow, obstacles, room), slow, "{tip} {elbow:?} {pose:?}");
            assert_eq!(geometry.free_pose(tip, elbow, obstacles, room).is_some(), slow);
        }
    }
    assert!(free > 300 && limited > 300, "{free} free, {limited} beyond the limits");
}

#[test]
fn the_base_itself_and_places_out_of_reach_are_not_free() {
    let arm = geometry([0.0, 0.0], [1.0, 1.0], [-PI, -PI], [PI, PI]);
    for tip in [[0.0, 0.0], [2.1, 0.0], [f64::NAN, 0.0]] {
        assert!(!arm.is_free(tip.into(), Elbow::Up, [], Room::default()), "{tip:?}");
    }
}

#[test]
fn joint_1_takes_the_turn_that_is_nearest_and_allowed() {
    let arm = papers();
    for (angle, near, expected) in [(0.1, 6.2, 0.1), (6.2, 0.1, 6.2), (0.0, 6.2, TAU), (TAU, 0.1, 0.0), (3.0, 3.1, 3.0)]
    {
        let found = arm.nearest_in_range([angle, 0.5], near);
        assert!((found[0] - expected).abs() < 1e-9, "{angle} near {near}: {found:?}");
        assert_eq!(found[1], 0.5);
    }
}

#[test]
fn links_are_bodies() {
    let arm = geometry([1.0, 0.0], [1.0, 2.0], [-PI, -PI], [PI, PI]);
    let [first, second] = arm.bodies([PI / 2.0, -PI / 2.0]);
    assert!((first.b - Point2::new(1.0, 1.0)).norm() < 1e-12 && first.b == second.a);
    assert!((second.b - Point2::new(3.0, 1.0)).norm() < 1e-12);
    // Between the elbow and the tip, half a metre above the second link.
    let disc = Capsule::disc([2.0, 1.5].into(), 0.1);
    assert!((arm.clearance([PI / 2.0, -PI / 2.0], [disc]) - 0.35).abs() < 1e-12);
    assert_eq!(arm.clearance([0.0, 0.0], []), f64::INFINITY);
}

/// Free space and search in pieces give what they give at once.
#[test]
fn pieces_make_the_whole() {
    let arm = papers();
    let obstacles = [Capsule::disc([4.8, 3.9].into(), 0.4), Capsule::disc([-0.5, 6.2].into(), 0.4)];
    let whole = FreeSpace::of(&arm, &obstacles, 0.2, Room::default());
    let mut space = FreeSpace::default();
    space.begin(&arm, 0.2);
    let mut pieces = 0;
    while !space.advance(&arm, &obstacles, Room::default(), 100) {
        pieces += 1;
    }
    assert_eq!(pieces, whole.len() / 100);
    assert_eq!(space.counts(), whole.counts());
    let (start, goal, through) = ([6.0, 0.4].into(), [-3.4, 5.0].into(), Through::Sheet(Elbow::Up));
    let mut search = GridSearch::default();
    assert_eq!(search.begin(&space, start, goal, through), Found::NotYet);
    while search.advance(&space, through, 50) == Found::NotYet {}
    let mut path = Vec::new();
    search.path(&space, &mut path);
    let length: f64 = path.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    assert!((length - search.length_m(&space)).abs() < 1e-9);
    assert_eq!(shortest_grid_path(&whole, start, goal, through), Some(search.length_m(&space)));
    assert!((path[0] - start).norm() < 0.1 && (path[path.len() - 1] - goal).norm() < 0.1);
    assert_eq!(shortest_grid_path(&whole, start, [0.0, 0.0].into(), through), None);
    assert_eq!(shortest_grid_path(&whole, [99.0, 0.0].into(), goal, through), None);
}

/// A large arm gets a coarser grid, not a larger one.
#[test]
fn grids_are_bounded() {
    let arm = geometry([0.0, 0.0], [350.0, 350.0], [0.0, -PI / 2.0], [TAU, PI / 2.0]);
    let space = FreeSpace::of(&arm, &[], 0.1, Room::default());
    assert!(space.len() <= 401 * 401);
    let path = shortest_grid_path(&space, [600.0, 0.0].into(), [0.0, 600.0].into(), Through::Sheet(Elbow::Up));
    assert!(path.is_some_and(|length_m| length_m > 900.0 && length_m < 1100.0));
}
