//! The worked examples of section 5, and what follows from the equations in closed form.

use super::PRINTED;
use crate::row::{Item, Rows};
use crate::scene::disc_at;
use crate::stepper::tidy;
use geometry::spline::{Spline, length};
use geometry::{ArmGeometry, Elbow};
use nalgebra::{Point2, Vector2};
use planners::Obstacle;
use planners::pso_via_points::Params;
use planners::pso_via_points::field::{Bodies, Field, Variant};
use planners::pso_via_points::swarm::velocity;

/// Half of the fourth digit after the point.
const PRINTED_4: f64 = 0.5e-4;

pub(super) fn rows(rows: &mut Rows<'_>) {
    rows.about(
        "paper, equations (1) to (24); specification, section 5, checks 1 to 8",
        "the functions of planner pso-via-points, and of the arm and the spline, for the inputs of the check",
        "all digits that the specification prints",
    );
    field(rows);
    lengths(rows);
    arm(rows);
    swarm(rows);
    splines(rows);
    bias(rows);
}

fn gains(k_rep: f64, goal_power: u32) -> Field {
    let params = Params { k_rep, goal_power, ..Params::default() };
    params.recipe(0.1).field
}

fn around(obstacles: &[Obstacle]) -> Bodies<'_> {
    Bodies { obstacles, ring: None, radius_m: 0.0 }
}

/// The negative gradient of a potential, by central differences.
fn downhill(potential: impl Fn(Point2<f64>) -> f64, q: Point2<f64>) -> Vector2<f64> {
    const STEP: f64 = 1e-5;
    let slope = |axis: Vector2<f64>| (potential(q - STEP * axis) - potential(q + STEP * axis)) / (2.0 * STEP);
    Vector2::new(slope(Vector2::x()), slope(Vector2::y()))
}

fn pair(v: Vector2<f64>) -> [f64; 2] {
    [tidy(v.x), tidy(v.y)]
}

fn field(rows: &mut Rows<'_>) {
    let plain = gains(0.5, 0);
    let (q, goal) = (Point2::new(2.0, 3.0), Point2::new(5.0, 7.0));
    rows.vector(
        Item::new("check 1: attraction, equation (2)"),
        [3.0, 4.0],
        pair(plain.attraction(q, goal)),
        PRINTED,
        "",
    );
    let potential = tidy(plain.attractive_potential(q, goal));
    rows.number(Item::new("check 1: attractive potential, equation (1)"), 12.5, potential, PRINTED, "");

    let disc = [disc_at(0, Point2::new(1.0, 0.0), 0.5)];
    let (bodies, goal) = (around(&disc), Point2::new(5.0, 0.0));
    let q = Point2::new(2.0, 0.0);
    let repulsion = pair(plain.repulsion(q, goal, &bodies));
    rows.vector(Item::new("check 2: repulsion, n = 0"), [2.0, 0.0], repulsion, PRINTED, "");
    let total = pair(plain.force(Variant::Plain, q, goal, &bodies));
    rows.vector(Item::new("check 2: total force"), [5.0, 0.0], total, PRINTED, "");

    let q = Point2::new(2.0, 0.3);
    for (n, oracle) in [(1, [4.263623, 1.209189]), (2, [13.381514, 3.592975])] {
        let field = gains(0.5, n);
        let force = field.repulsion(q, goal, &bodies);
        rows.vector(Item::new(format!("check 3: repulsion, n = {n}")), oracle, pair(force), PRINTED, "");
        let numeric = downhill(|q| field.repulsive_potential(q, goal, &bodies), q);
        let item = Item::new(format!("check 3: repulsion against the numeric gradient of (4), n = {n}"));
        let why = "ours: what central differences with a step of 1e-5 m resolve";
        rows.vector(item.why(why), pair(numeric), pair(force), 1e-6, "");
    }
    for (name, variant, oracle) in [
        ("plain", Variant::Plain, [4.356196, 0.106859]),
        ("(15), (16)", Variant::Right, [4.763054, -1.249337]),
        ("(17), (18)", Variant::Left, [3.949337, 1.463054]),
        ("literal bias", Variant::LiteralBias, [3.606196, 0.606859]),
    ] {
        let force = pair(plain.force(variant, q, goal, &bodies));
        rows.vector(Item::new(format!("check 4: force with attraction, {name}")), oracle, force, PRINTED, "");
    }
}

fn lengths(rows: &mut Rows<'_>) {
    let straight = [[0.0, 0.0], [3.0, 4.0], [3.0, 10.0]].map(Point2::from);
    let bent = [[0.0, 0.0], [3.0, 4.0], [6.0, 0.0]].map(Point2::from);
    rows.number(Item::new("check 5: length of (0,0), (3,4), (3,10)"), 11.0, tidy(length(&straight)), PRINTED, "");
    let item = Item::new("check 5: length of (0,0), (3,4), (6,0)");
    let note =
        "equation (24) as printed lacks the squares: it would give 5.0952 for the first, and nothing real for this one";
    rows.number(item.note(note), 10.0, tidy(length(&bent)), PRINTED, "");
}

fn arm(rows: &mut Rows<'_>) {
    let degrees = |range: [f64; 2]| range.map(f64::to_radians);
    let geometry = ArmGeometry {
        base: Point2::origin(),
        links_m: [3.5, 3.5],
        link_radius_m: 0.0,
        joint_min_rad: degrees([0.0, -90.0]),
        joint_max_rad: degrees([360.0, 90.0]),
    };
    let mut back: f64 = 0.0;
    for (tip, elbow, oracle) in [
        ([4.0, 4.0], Elbow::Up, [81.0871, -72.1743]),
        ([4.0, 4.0], Elbow::Down, [8.9129, 72.1743]),
        ([6.0, 0.5], Elbow::Up, [35.4343, -61.3413]),
        ([6.0, 0.5], Elbow::Down, [334.0930, 61.3413]),
        ([0.0, 7.0], Elbow::Up, [90.0, 0.0]),
        ([0.0, 7.0], Elbow::Down, [90.0, 0.0]),
    ] {
        let item = Item::new(format!("check 6: joints of tip ({}, {}), elbow {elbow:?}", tip[0], tip[1]));
        let tip = Point2::from(tip);
        let joints = geometry.inverse(tip, elbow).unwrap_or([f64::NAN; 2]);
        back = back.max((geometry.tip(joints) - tip).norm());
        rows.vector(item, oracle, joints.map(|joint| tidy(joint.to_degrees()) + 0.0), PRINTED_4, "degrees");
    }
    for (elbow, sign) in [(Elbow::Up, -1.0), (Elbow::Down, 1.0)] {
        let joints = geometry.inverse(Point2::new(3.0, 3.0), elbow).unwrap_or([f64::NAN; 2]);
        let item = Item::new(format!("check 6: joint 2 of tip (3, 3), elbow {elbow:?}"));
        rows.number(item, sign * 105.3851, tidy(joints[1].to_degrees()), PRINTED_4, "degrees");
        let item = Item::new(format!("check 6: tip (3, 3) within the limits, elbow {elbow:?}"));
        rows.exact(item, false, geometry.within_limits(joints, 0.0));
    }
    let reached = Elbow::BOTH.iter().any(|elbow| geometry.inverse(Point2::new(5.0, 5.0), *elbow).is_some());
    rows.exact(Item::new("check 6: tip (5, 5) within reach"), false, reached);
    rows.number(Item::new("check 6: forward kinematics of the inverse, largest error"), 0.0, back, 1e-9, "m");
    let (inner, outer) = geometry.reach();
    rows.number(Item::new("inner radius of the ring"), 4.950, tidy(inner), 0.5e-3, "m");
    rows.number(Item::new("outer radius of the ring"), 7.0, tidy(outer), PRINTED, "m");
}

fn swarm(rows: &mut Rows<'_>) {
    let x = 0.4;
    let v = velocity(0.7298, 1.4962, 1.4962, 0.2, x, 1.0, 0.7, 0.5, 0.25);
    rows.number(Item::new("check 7: velocity of one coordinate, equation (21)"), 0.707035, tidy(v), PRINTED, "");
    rows.number(Item::new("check 7: the coordinate after it, equation (22)"), 1.107035, tidy(x + v), PRINTED, "");
}

fn splines(rows: &mut Rows<'_>) {
    let three = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]].map(Point2::from).to_vec();
    let four = [[0.0, 0.0], [1.0, 2.0], [3.0, 3.0], [4.0, 1.0]].map(Point2::from).to_vec();
    for (points, half, quarter, long) in
        [(three, [1.0, 1.0], [0.5, 0.6875], 2.9145), (four, [2.0, 2.8], [0.640625, 1.521875], 6.9051)]
    {
        let spline = Spline::through(&points);
        let at = |part: f64| pair(spline.at(part * spline.end()).coords);
        let name = format!("check 8: spline through {} points", points.len());
        rows.vector(Item::new(format!("{name}, half")), half, at(0.5), PRINTED, "");
        rows.vector(Item::new(format!("{name}, quarter")), quarter, at(0.25), PRINTED, "");
        let mut samples = Vec::new();
        spline.sample(2000, &mut samples);
        rows.number(Item::new(format!("{name}, length")), long, tidy(length(&samples)), PRINTED_4, "");
    }
}

fn bias(rows: &mut Rows<'_>) {
    for (k_att, oracle) in [(1.0, 0.901), (5.0, 0.180)] {
        let params = Params { k_att, ..Params::default() };
        let (field, goal) = (params.recipe(0.1).field, Point2::new(3.0, 4.0));
        let rest = goal + field.bias / k_att;
        let force = field.force(Variant::LiteralBias, rest, goal, &around(&[]));
        let item = Item::new(format!("where the literal bias vanishes, from the goal, K_a = {k_att}"));
        rows.number(item, oracle, tidy((rest - goal).norm()), 0.5e-3, "m");
        let item = Item::new(format!("force there, K_a = {k_att}")).why("ours: rounding");
        rows.number(item, 0.0, tidy(force.norm()), 1e-12, "");
    }
}
