//! Additional force B of AMR-APF, Eq. 10: a virtual obstacle around a crowd, so that a robot goes round it.

use super::field::{Own, wrap};
use super::{Circle, ClusterRule, Params, Which};
use nalgebra::{Point2, Vector2};
use std::f64::consts::{FRAC_PI_2, PI};

/// Another robot that may belong to a crowd.
#[derive(Clone, Copy, Debug)]
pub struct Member {
    /// Its position, m.
    pub position: Point2<f64>,
    /// It has arrived.
    pub arrived: bool,
}

/// What a crowd means to the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Crowd {
    /// A virtual obstacle.
    Around {
        /// Its centre, m.
        center: Point2<f64>,
        /// ρ_c, m.
        rho_m: f64,
    },
    /// The goal is inside: nothing to go round.
    HoldsGoal,
    /// The robot is inside: wait until it opens.
    HoldsRobot,
}

/// Buffers that are kept from tick to tick, so that planning does not allocate.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(crate) candidates: Vec<Member>,
    group: Vec<Member>,
    taken: Vec<bool>,
    inside: Vec<bool>,
    queue: Vec<usize>,
    hull: Vec<Point2<f64>>,
}

/// What all crowds together do to the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crowds {
    /// The additional force, body frame.
    pub force: Vector2<f64>,
    /// The robot is inside a crowd.
    pub stop: bool,
}

/// Steps 2 to 6 for the candidates in `scratch`, which are sorted by id. `settle` rounds the force of one crowd.
/// `near` says that a pillar or a robot is so near that it alone counts.
pub(crate) fn crowds(
    params: &Params,
    own: &Own,
    radius_m: f64,
    near: bool,
    scratch: &mut Scratch,
    settle: impl Fn(Vector2<f64>) -> Vector2<f64>,
) -> Crowds {
    let Scratch { candidates, group, taken, inside, queue, hull } = scratch;
    let mut answer = Crowds { force: Vector2::zeros(), stop: false };
    let mut best: Option<(f64, Point2<f64>, f64)> = None;
    taken.clear();
    taken.resize(candidates.len(), false);
    for seed in 0..candidates.len() {
        if taken[seed] {
            continue;
        }
        gather(params, radius_m, candidates, seed, taken, inside, queue);
        group.clear();
        group.extend(candidates.iter().zip(inside.iter()).filter(|(_, inside)| **inside).map(|(member, _)| *member));
        if group.len() < 2 {
            continue;
        }
        match judge(params, own, radius_m, group, hull) {
            Crowd::HoldsGoal => {}
            Crowd::HoldsRobot => answer.stop = true,
            Crowd::Around { center, rho_m } => match params.clusters {
                Which::All => answer.force += settle(force(params, own, center, rho_m, near)),
                Which::Largest | Which::Fullest => {
                    let weight = if params.clusters == Which::Largest { rho_m } else { group.len() as f64 };
                    if best.is_none_or(|(most, ..)| weight > most) {
                        best = Some((weight, center, rho_m));
                    }
                }
                Which::Off => {}
            },
        }
    }
    if let Some((_, center, rho_m)) = best {
        answer.force = settle(force(params, own, center, rho_m, near));
    }
    answer
}

/// Marks in `inside` the group of `seed`, and in `taken` whom it leaves for no other group.
fn gather(
    params: &Params,
    radius_m: f64,
    all: &[Member],
    seed: usize,
    taken: &mut [bool],
    inside: &mut Vec<bool>,
    queue: &mut Vec<usize>,
) {
    let reach = params.c_adj * (2.0 * radius_m + params.safety_m);
    let linked = |a: &Member, b: &Member| {
        (a.position - b.position).norm() < reach && !(!params.link_arrived && a.arrived && b.arrived)
    };
    inside.clear();
    inside.resize(all.len(), false);
    inside[seed] = true;
    taken[seed] = true;
    if params.exact && params.circle == Circle::Rectangle {
        // The reference: everybody lists itself and the later ones it is linked with, and one pass over the lists
        // joins those that meet what was joined so far.
        let later = |i: usize| (i + 1..all.len()).filter(move |j| linked(&all[i], &all[*j]));
        later(seed).for_each(|j| inside[j] = true);
        for i in seed + 1..all.len() {
            if !taken[i] && (inside[i] || later(i).any(|j| inside[j])) {
                taken[i] = true;
                inside[i] = true;
                later(i).for_each(|j| inside[j] = true);
            }
        }
        return;
    }
    // A connected component.
    queue.clear();
    queue.push(seed);
    while let Some(i) = queue.pop() {
        for j in 0..all.len() {
            if !taken[j] && linked(&all[i], &all[j]) {
                taken[j] = true;
                inside[j] = true;
                queue.push(j);
            }
        }
    }
}

/// Steps 3 and 4: the circle around one group of at least two, and what it means.
pub fn crowd(params: &Params, own: &Own, radius_m: f64, group: &[Member]) -> Crowd {
    judge(params, own, radius_m, group, &mut Vec::new())
}

fn judge(params: &Params, own: &Own, radius_m: f64, group: &[Member], hull: &mut Vec<Point2<f64>>) -> Crowd {
    let s = params.safety_m;
    // Arrived robots do not close a crowd; without one the hull stays empty.
    let counts = |member: &&Member| params.circle == Circle::Mean || !member.arrived;
    hull.clear();
    if group.iter().filter(counts).count() >= 3 {
        hull.extend(group.iter().filter(counts).map(|member| member.position));
        convex_hull(hull);
    }
    let robot_inside = hull_contains(hull, own.position);
    let (center, r_c) = match params.circle {
        Circle::Rectangle if hull.len() < 3 => triangle(own, group),
        Circle::Rectangle => {
            let (center, shorter) = smallest_rectangle(hull, params.rectangle_tie);
            (center, (params.c_rad * shorter / 2.0).max(2.0 * (2.0 * radius_m + s)))
        }
        Circle::Mean if hull.len() < 3 => {
            let (a, b) = ends(group);
            (nalgebra::center(&a, &b), (b - a).norm() / 2.0 + radius_m)
        }
        Circle::Mean => {
            // The reference closes the ring, so the lowest corner counts twice; it goes round clockwise.
            let lowest = hull[0].coords;
            let sum = hull[1..].iter().rev().fold(lowest, |sum, p| sum + p.coords) + lowest;
            let center = Point2::from(sum / (hull.len() + 1) as f64);
            (center, hull.iter().map(|p| (p - center).norm()).fold(0.0, f64::max) + radius_m)
        }
        Circle::Enclosing => {
            if hull.len() < 3 {
                hull.clear();
                hull.extend(group.iter().map(|member| member.position));
                convex_hull(hull);
            }
            let (center, radius) = enclosing_circle(hull);
            (center, radius + radius_m)
        }
    };
    let goal_in_circle = (own.goal - center).norm() < r_c;
    // The rectangle's version asks first whether the robot is inside, the other one whether the goal is.
    let held = match params.circle {
        Circle::Mean => robot_inside && !goal_in_circle,
        _ => robot_inside && !hull_contains(hull, own.goal),
    };
    if held {
        Crowd::HoldsRobot
    } else if goal_in_circle {
        Crowd::HoldsGoal
    } else {
        Crowd::Around { center, rho_m: r_c + radius_m + s }
    }
}

/// Step 6: the force of the virtual obstacle around a crowd.
pub fn force(params: &Params, own: &Own, center: Point2<f64>, rho: f64, near: bool) -> Vector2<f64> {
    let rho = params.zone(rho);
    let sight = own.sight(center, own.heading_rad);
    let (d, theta) = (sight.distance_m, sight.theta);
    match params.cluster_rule {
        ClusterRule::Tangent => {
            if near || d > 2.0 * rho || sight.beta.abs() > FRAC_PI_2 {
                return Vector2::zeros();
            }
            let turned = theta + own.side(&sight, params.phi_r_deg.to_radians()) * FRAC_PI_2;
            own.along(params.push(d, rho) + 3.0, turned)
        }
        ClusterRule::Oblique | ClusterRule::ObliqueUncut => {
            let cut = params.cluster_rule == ClusterRule::Oblique;
            if cut && d >= 2.0 * rho {
                return Vector2::zeros();
            }
            let size = params.push_uncut(d, rho);
            let inner = if cut { 0.8 * rho } else { rho };
            if sight.gamma <= 36f64.to_radians() || d <= inner {
                return own.along(size + 2.0, theta + PI);
            }
            let by_goal = sight.gamma < 160f64.to_radians() || sight.psi.abs() < 20f64.to_radians();
            let tau = if by_goal { own.sgn(sight.beta * sight.psi) } else { 1.0 };
            own.along(size + 4.0, theta + 112.5f64.to_radians() * own.sgn(sight.psi) * tau)
        }
    }
}

/// The two members farthest left and right as the robot sees them, and the circle of the equilateral triangle on
/// their connection, on the side away from the robot.
fn triangle(own: &Own, group: &[Member]) -> (Point2<f64>, f64) {
    let psi = |member: &Member| {
        let along = member.position - own.position;
        wrap(own.heading_rad - along.y.atan2(along.x))
    };
    let mut ends = (group[0].position, group[0].position);
    let mut extremes = (psi(&group[0]), psi(&group[0]));
    for member in &group[1..] {
        let psi = psi(member);
        if psi < extremes.0 {
            (extremes.0, ends.0) = (psi, member.position);
        }
        if psi > extremes.1 {
            (extremes.1, ends.1) = (psi, member.position);
        }
    }
    let (a, b) = ends;
    let along = b - a;
    let middle = a + along / 2.0;
    let normal = Vector2::new(-along.y, along.x) / (2.0 * 3f64.sqrt());
    let away = if normal.dot(&(middle - own.position)) < 0.0 { -normal } else { normal };
    (middle + away, along.norm() / 2f64.sqrt())
}

/// The two members farthest apart.
fn ends(group: &[Member]) -> (Point2<f64>, Point2<f64>) {
    let mut ends = (group[0].position, group[group.len() - 1].position);
    let mut farthest = (ends.1 - ends.0).norm_squared();
    for (i, a) in group.iter().enumerate() {
        for b in &group[i + 1..] {
            let apart = (b.position - a.position).norm_squared();
            if apart > farthest {
                (farthest, ends) = (apart, (a.position, b.position));
            }
        }
    }
    ends
}

/// Replaces points by the corners of their convex hull, counter-clockwise from the lowest (then leftmost) one.
pub(crate) fn convex_hull(points: &mut Vec<Point2<f64>>) {
    points.sort_unstable_by(|a, b| a.y.total_cmp(&b.y).then(a.x.total_cmp(&b.x)));
    points.dedup();
    if points.len() < 3 {
        return;
    }
    let n = points.len();
    // Both chains are built behind the points; what is left of the input is removed at the end.
    let turns_right = |a: Point2<f64>, b: Point2<f64>, c: Point2<f64>| (b - a).perp(&(c - b)) <= 0.0;
    for pass in 0..2 {
        let base = points.len() - usize::from(pass == 1);
        for i in 0..n {
            let p = points[if pass == 0 { i } else { n - 1 - i }];
            if pass == 1 && i == 0 {
                continue;
            }
            while points.len() >= base + 2 && turns_right(points[points.len() - 2], points[points.len() - 1], p) {
                points.pop();
            }
            points.push(p);
        }
    }
    points.drain(..n);
    points.pop();
}

fn hull_contains(hull: &[Point2<f64>], p: Point2<f64>) -> bool {
    hull.len() >= 3 && (0..hull.len()).all(|i| (hull[(i + 1) % hull.len()] - hull[i]).perp(&(p - hull[i])) > 0.0)
}

/// Centre and shorter side of the smallest rectangle around a hull; one of its sides lies along an edge. Around an
/// acute triangle all three are equally small: rounding decides (`tie` 0), or the first one counted from edge `tie`.
fn smallest_rectangle(hull: &[Point2<f64>], tie: u32) -> (Point2<f64>, f64) {
    let mut best = (f64::INFINITY, hull[0], 0.0);
    let (first, margin) = if tie == 0 { (0, 0.0) } else { (tie as usize - 1, 1e-9) };
    for i in (first..first + hull.len()).map(|i| i % hull.len()) {
        let along = (hull[(i + 1) % hull.len()] - hull[i]).normalize();
        let across = Vector2::new(-along.y, along.x);
        let span = |axis: Vector2<f64>| {
            let mut span = (f64::INFINITY, f64::NEG_INFINITY);
            for p in hull {
                let t = p.coords.dot(&axis);
                span = (span.0.min(t), span.1.max(t));
            }
            span
        };
        let (u, v) = (span(along), span(across));
        let area = (u.1 - u.0) * (v.1 - v.0);
        if area < best.0 * (1.0 - margin) {
            let center = along * ((u.0 + u.1) / 2.0) + across * ((v.0 + v.1) / 2.0);
            best = (area, Point2::from(center), (u.1 - u.0).min(v.1 - v.0));
        }
    }
    (best.1, best.2)
}

/// Centre and radius of the smallest circle around the points: it is grown until nobody is outside.
fn enclosing_circle(points: &[Point2<f64>]) -> (Point2<f64>, f64) {
    let outside = |circle: (Point2<f64>, f64), p: Point2<f64>| (p - circle.0).norm() > circle.1 * (1.0 + 1e-12);
    let of_two = |a: Point2<f64>, b: Point2<f64>| (nalgebra::center(&a, &b), (b - a).norm() / 2.0);
    let mut circle = (points[0], 0.0);
    for (i, a) in points.iter().enumerate() {
        if !outside(circle, *a) {
            continue;
        }
        circle = (*a, 0.0);
        for (j, b) in points[..i].iter().enumerate() {
            if !outside(circle, *b) {
                continue;
            }
            circle = of_two(*a, *b);
            for c in &points[..j] {
                if outside(circle, *c) {
                    circle = circumscribed(*a, *b, *c).unwrap_or(circle);
                }
            }
        }
    }
    circle
}

fn circumscribed(a: Point2<f64>, b: Point2<f64>, c: Point2<f64>) -> Option<(Point2<f64>, f64)> {
    let (b, c) = (b - a, c - a);
    let twice = 2.0 * b.perp(&c);
    let offset =
        Vector2::new(c.y * b.norm_squared() - b.y * c.norm_squared(), b.x * c.norm_squared() - c.x * b.norm_squared())
            / twice;
    offset.iter().all(|x| x.is_finite()).then(|| (a + offset, offset.norm()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hull_and_circle() {
        let mut hull: Vec<Point2<f64>> =
            [[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 2.0], [0.0, 2.0], [1.0, 0.0], [2.0, 2.0]]
                .map(Point2::from)
                .into();
        convex_hull(&mut hull);
        assert_eq!(hull, [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(Point2::from));
        let (center, radius) = enclosing_circle(&hull);
        assert!((center - Point2::new(1.0, 1.0)).norm() < 1e-12 && (radius - 2f64.sqrt()).abs() < 1e-12);
        assert!(hull_contains(&hull, Point2::new(1.0, 1.9)) && !hull_contains(&hull, Point2::new(2.0, 1.0)));
        let (center, shorter) = smallest_rectangle(&hull, 0);
        assert!((center - Point2::new(1.0, 1.0)).norm() < 1e-12 && (shorter - 2.0).abs() < 1e-12);
    }

    #[test]
    fn points_on_a_line_have_two_ends() {
        let mut hull: Vec<Point2<f64>> = [[0.0, 0.0], [1.0, 1.0], [3.0, 3.0], [2.0, 2.0]].map(Point2::from).into();
        convex_hull(&mut hull);
        assert_eq!(hull, [[0.0, 0.0], [3.0, 3.0]].map(Point2::from));
        let (_, radius) = enclosing_circle(&hull);
        assert!((radius - 4.5f64.sqrt()).abs() < 1e-12);
    }
}
