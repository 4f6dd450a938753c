//! Arms: their keys, how they stand at the start, and which places their tips can be at.

use crate::ground::{Ground, Solid, Surfaces};
use crate::layers::Layered;
use crate::node::{Given, Node};
use crate::obstacles::{contains, show};
use crate::problems::{Origin, Report};
use crate::table::{Arm, PlacedArm, Robot as RobotKeys};
use crate::types::Joints;
use geometry::{ArmGeometry, Capsule, Elbow, wrap};
use model::key::{Key, Named};
use model::{ArmSetup, BodyKind, Robot};
use nalgebra::Point2;
use std::f64::consts::PI;

/// What is said where an arm cannot be.
const ONE_BY_ONE: &str = "arms stand one by one, as [[robot]] with base_m and links_m";

/// Reports a layout of arms: whether it is none.
pub(crate) fn check_layout(node: &Node, kind: BodyKind, report: &mut Report) -> bool {
    if kind == BodyKind::TwoLinkArm {
        report.add_hint(node.origin, &node.path, "a layout cannot place arms, and [defaults] makes arms", ONE_BY_ONE);
    }
    kind != BodyKind::TwoLinkArm
}

/// Reports the wish to add an arm to a running fleet.
pub(crate) fn check_added(kind: BodyKind, report: &mut Report) {
    if kind == BodyKind::TwoLinkArm {
        let message = "an arm cannot be added to a running fleet";
        report.add_hint(Origin::Whole, "kind", message, "arms are built in with the scenario; others can be added");
    }
}

/// Makes a robot the arm that its node and its kind describe, standing as they say. What is wrong is reported; the robot
/// is nowhere then.
pub(crate) fn stand(robot: &mut Robot, node: &Node, of_kind: Option<&Node>, around: &Surfaces, report: &mut Report) {
    let nowhere = Point2::new(f64::NAN, f64::NAN);
    let start = std::mem::replace(&mut robot.start, nowhere);
    let Some(geometry) = geometry(node, of_kind, report) else { return };
    let Some(start_joints_rad) = start_joints(&geometry, start, node, around, &robot.id, report) else { return };
    let setup = ArmSetup { geometry, start_joints_rad };
    robot.radius_m = geometry.link_radius_m;
    robot.start = setup.start().tip();
    robot.start_yaw_rad = wrap(start_joints_rad[0] + start_joints_rad[1]);
    robot.arm = Some(setup);
}

fn geometry(node: &Node, of_kind: Option<&Node>, report: &mut Report) -> Option<ArmGeometry> {
    let body = Layered([Some(node), of_kind].into_iter().flatten().collect());
    let mut complete = true;
    let needed = [
        (PlacedArm::base_m.any(), node.has(PlacedArm::base_m), "where it is fixed, [x, y]"),
        (Arm::links_m.any(), body.layer(Arm::links_m).is_some(), "the lengths of its links, [first, second]"),
    ];
    for (key, _, what) in needed.into_iter().filter(|(_, given, _)| !given) {
        let key = key.name();
        report.add_hint(node.origin, &node.path, format!("an arm needs `{key}`"), format!("{key}: {what}"));
        complete = false;
    }
    // What is wrong has been reported.
    let joints = |key: Key<Joints>| {
        let given = body.layer(key).map_or(Given::Absent, |layer| layer.given(key));
        given.or(key.default()).map(|Joints(joints)| joints)
    };
    let (joint_min_rad, joint_max_rad) = (joints(Arm::joint_min_rad)?, joints(Arm::joint_max_rad)?);
    for joint in 0..2 {
        let (min, max) = (joint_min_rad[joint], joint_max_rad[joint]);
        let problem = if min >= max {
            format!("joint {}: its lower limit, {min} rad, is above its upper limit, {max} rad", joint + 1)
        } else if joint == 1 && (min < -PI || max > PI) {
            format!("joint 2 turns from {min} to {max} rad, more than half a turn to one side")
        } else {
            continue;
        };
        let keys = [Arm::joint_max_rad, Arm::joint_min_rad];
        let at = keys.into_iter().find_map(|key| Some((body.layer(key)?, key)));
        let (layer, key) = at.unwrap_or((node, Arm::joint_max_rad));
        let hint = "joint_min_rad is below joint_max_rad, and joint 2 within ±3.14159";
        report.add_hint(layer.at(key), &layer.key(key), problem, hint);
        complete = false;
    }
    let geometry = ArmGeometry {
        base: node.get(PlacedArm::base_m)?,
        links_m: body.get(Arm::links_m)?.0,
        link_radius_m: body.get(Arm::link_radius_m),
        joint_min_rad,
        joint_max_rad,
    };
    complete.then_some(geometry)
}

fn start_joints(
    geometry: &ArmGeometry,
    start: Point2<f64>,
    node: &Node,
    around: &Surfaces,
    id: &str,
    report: &mut Report,
) -> Option<[f64; 2]> {
    let elbow = match node.given(PlacedArm::elbow) {
        Given::Value(elbow) => Some(elbow),
        Given::Wrong => return None,
        Given::Absent => None,
    };
    let key = PlacedArm::start_joints_rad;
    if node.has(key) {
        let others = [RobotKeys::start_m.any(), PlacedArm::elbow.any()];
        for other in others.into_iter().filter(|other| node.has(*other)) {
            let message = format!("does not go with {}", key.name());
            report.add_hint(node.at(other), &node.key(other), message, "the joints say where the tip is");
        }
        let Joints(joints_rad) = node.get(key)?;
        if !geometry.within_limits(joints_rad, 0.0) {
            let message = format!("the start of `{id}`, {joints_rad:?}, is beyond the limits of its joints");
            report.add_hint(node.at(key), &node.key(key), message, limits(geometry));
            return None;
        }
        return Some(joints_rad);
    }
    if !start.coords.iter().all(|x| x.is_finite()) {
        return None; // missing or wrong, and reported
    }
    let poses = |elbow: Elbow| geometry.inverse(start, elbow).filter(|joints| geometry.within_limits(*joints, 0.0));
    let free = |joints: &[f64; 2]| around.overlap_of(&geometry.bodies(*joints), true).is_none();
    let sheets = || Elbow::BOTH.into_iter().filter(|sheet| elbow.is_none_or(|elbow| elbow == *sheet));
    let pose = sheets().filter_map(poses).find(free).or_else(|| sheets().find_map(poses));
    if pose.is_none() {
        let what = format!("the start of `{id}`, {}", show(start));
        let side = elbow.map(|elbow| if elbow == Elbow::Up { " with its elbow up" } else { " with its elbow down" });
        unreachable(
            geometry,
            start,
            &what,
            side.unwrap_or(""),
            &node.key(RobotKeys::start_m),
            node.at(RobotKeys::start_m),
            report,
        );
    }
    pose
}

/// Checks how an arm stands at the start.
pub(crate) fn check_start(
    ground: &Ground<'_>,
    robot: &Robot,
    arm: &ArmSetup,
    late: bool,
    place: (&str, Origin),
    report: &mut Report,
) {
    let (key, origin) = place;
    let id = &robot.id;
    let places = [("base", arm.geometry.base), ("tip", robot.start)];
    for (what, at) in places.into_iter().filter(|(_, at)| !contains(ground.world, *at)) {
        ground.outside(at, &format!("the {what} of `{id}` at the start"), key, origin, report);
    }
    let links = arm.geometry.bodies(arm.start_joints_rad);
    if let Some((obstacle, overlap_m)) = ground.surfaces.overlap_of(&links, !late) {
        let message = format!("a link of `{id}` overlaps {obstacle} by {overlap_m:.3} m at the start");
        report.add_hint(origin, key, message, "another elbow, start or base_m, or thinner links");
    }
}

/// Checks one place for the tip of an arm to be, whichever way its elbow bends.
pub(crate) fn check_goal(
    ground: &Ground<'_>,
    arm: &ArmSetup,
    p: Point2<f64>,
    what: &str,
    (key, origin): (&str, Origin),
    report: &mut Report,
) {
    if !p.coords.iter().all(|x| x.is_finite()) {
        return; // wrong, and reported
    }
    if !contains(ground.world, p) {
        ground.outside(p, what, key, origin, report);
    }
    let what = format!("{what}, {}", show(p));
    let geometry = &arm.geometry;
    let poses = Elbow::BOTH.into_iter().filter_map(|elbow| geometry.inverse(p, elbow));
    let mut poses = poses.filter(|joints| geometry.within_limits(*joints, 0.0)).peekable();
    if poses.peek().is_none() {
        return unreachable(geometry, p, &what, "", key, origin, report);
    }
    let overlaps: Option<Vec<(Solid, f64)>> =
        poses.map(|joints_rad| ground.surfaces.overlap_of(&geometry.bodies(joints_rad), false)).collect();
    if let Some((obstacle, overlap_m)) = overlaps.and_then(|overlaps| overlaps.first().copied()) {
        let message = format!("{what}: a link overlaps {obstacle} by {overlap_m:.3} m however the elbow bends");
        report.add_hint(origin, key, message, "choose a goal that the arm can hold without a contact");
    }
}

fn unreachable(
    geometry: &ArmGeometry,
    p: Point2<f64>,
    what: &str,
    side: &str,
    key: &str,
    origin: Origin,
    report: &mut Report,
) {
    let ((near, far), distance) = (geometry.reach(), nalgebra::distance(&p, &geometry.base));
    if distance < near || distance > far {
        let message = format!("{what}, is out of reach: {distance:.3} m from the base");
        report.add_hint(
            origin,
            key,
            message,
            format!("the tip reaches from {near:.3} m to {far:.3} m around the base"),
        );
    } else {
        report.add_hint(origin, key, format!("{what}, is beyond the limits of the joints{side}"), limits(geometry));
    }
}

fn limits(geometry: &ArmGeometry) -> String {
    let ArmGeometry { joint_min_rad: low, joint_max_rad: high, .. } = geometry;
    format!("joint 1 turns from {} to {} rad, joint 2 from {} to {} rad", low[0], high[0], low[1], high[1])
}

/// The body of a robot where it starts: a disc, or two links.
pub(crate) fn body_at_start(robot: &Robot) -> Vec<Capsule> {
    match &robot.arm {
        Some(ArmSetup { geometry, start_joints_rad }) => geometry.bodies(*start_joints_rad).to_vec(),
        None => vec![Capsule::disc(robot.start, robot.radius_m)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::ArmState;

    #[test]
    fn poses_at_the_edge_of_the_reach_hold_their_tips() {
        let geometry = ArmGeometry {
            base: Point2::new(1.0, -2.0),
            links_m: [1.5, 1.0],
            link_radius_m: 0.05,
            joint_min_rad: [0.0, -PI / 2.0],
            joint_max_rad: [2.0 * PI, PI / 2.0],
        };
        let (near, far) = geometry.reach();
        for distance in [near, 0.5 * (near + far), far] {
            let p = geometry.base + nalgebra::Vector2::new(0.0, distance);
            let joints_rad = geometry.inverse(p, Elbow::Up).unwrap();
            assert!(geometry.within_limits(joints_rad, 0.0), "{distance}: {joints_rad:?}");
            assert!((ArmState { geometry, joints_rad }.tip() - p).norm() < 1e-9, "{distance}");
        }
    }
}
