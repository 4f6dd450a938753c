//! The specification's equations of the programs of 2023, written down a second time: section 3 as it stands there, and
//! nothing of `planners`. It answers one question: what should a robot do that sees this?
//!
//! Around three robots up to three rectangles are equally small, and which of them counts is rounding; so is on which side
//! of a limit a force lies that equals it. So an answer is a list: one command for every choice.

use geometry::wrap;
use nalgebra::{Point2, Vector2};
use planners::PlanInput;
use planners::dapf::Variant;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, SQRT_2};

/// Attraction.
const C_A: f64 = 4.0;
const SPEED_MPS_MAX: f64 = 0.2;
const TURN_RADPS_MAX: f64 = 1.0;
const CREEP_MPS: f64 = 0.05;
const R_ROBOT_M: f64 = 0.22;
const SAFETY_M: f64 = 0.07;
/// Precaution radii of pillars and of robots, m.
const RHO_O_M: f64 = 0.40;
const RHO_R_M: f64 = 0.51;
/// Two robots are linked below this distance, m.
const LINK_M: f64 = 2.2 * RHO_R_M;
/// A force that is nearer than this to a limit lies on both sides of it.
const EDGE: f64 = 1e-10;
/// Areas of rectangles that differ by less than this share are equal but for rounding.
const TIE: f64 = 1e-9;

/// A program of 2023.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program {
    /// The first experiment's, May 2023.
    C1,
    /// The paper's equations, June 2023.
    P,
    /// The baseline with one of its attractions.
    Dapf(Variant),
}

/// What a robot should do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// Forward speed, m/s, and yaw rate, rad/s: one pair for every choice among equally small rectangles.
    pub commands: Vec<[f64; 2]>,
    /// It says that it stands, in one of the choices.
    pub stops: bool,
    /// It says that it drives, in one of the choices.
    pub drives: bool,
}

/// What is seen of another robot, or of a virtual one.
#[derive(Clone, Copy)]
struct Other {
    position: Point2<f64>,
    heading_rad: f64,
    arrived: bool,
    parked: bool,
    right_of_way: bool,
    rho_m: f64,
}

/// A thing from the robot's place: distance, bearing, heading and goal relative to it, and the angle at the thing between
/// robot and goal. m, rad.
struct Sight {
    d: f64,
    theta: f64,
    psi: f64,
    beta: f64,
    gamma: f64,
}

struct Own<'a> {
    input: &'a PlanInput<'a>,
    to_goal: Vector2<f64>,
    theta_g: f64,
}

impl Program {
    /// The commands for this input.
    pub fn answer(self, input: &PlanInput<'_>) -> Answer {
        let to_goal = input.goal - input.position;
        let own = Own { input, to_goal, theta_g: bearing(to_goal) };
        match self {
            Program::Dapf(variant) => baseline(&own, variant),
            Program::C1 | Program::P => proposed(&own, self),
        }
    }
}

fn bearing(v: Vector2<f64>) -> f64 {
    v.y.atan2(v.x)
}

/// To three decimals: every force, then their sums.
fn rounded(force: Vector2<f64>) -> Vector2<f64> {
    force.map(|x| (x * 1000.0).round_ties_even() / 1000.0)
}

/// 0 at 0.
fn sgn(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

fn polar(size: f64, angle_rad: f64) -> Vector2<f64> {
    size * Vector2::new(angle_rad.cos(), angle_rad.sin())
}

fn mu(d: f64, rho: f64) -> f64 {
    4.0 * C_A * rho.powi(4) * (1.0 / d - 0.5 / rho).powi(2) / (d * d)
}

/// The side rule S in the code's form.
fn side(psi: f64, beta: f64, phi: f64) -> f64 {
    let t = if psi.abs() < phi { sgn(beta * psi) } else { 1.0 };
    sgn(psi) * t
}

impl Own<'_> {
    fn sight(&self, at: Point2<f64>) -> Sight {
        let there = at - self.input.position;
        let theta = bearing(there);
        Sight {
            d: there.norm(),
            theta,
            psi: wrap(self.input.yaw_rad - theta),
            beta: wrap(self.theta_g - theta),
            gamma: wrap(bearing(self.input.goal - at) - (theta - PI)).abs(),
        }
    }

    fn d_g(&self) -> f64 {
        self.to_goal.norm()
    }

    /// A force in the body frame, forward and left, as the program rounds it.
    fn settled(&self, force: Vector2<f64>) -> Vector2<f64> {
        let (sin, cos) = self.input.yaw_rad.sin_cos();
        rounded(Vector2::new(force.x * cos + force.y * sin, force.y * cos - force.x * sin))
    }

    fn pillars(&self) -> impl Iterator<Item = Point2<f64>> {
        self.input.obstacles.iter().map(|obstacle| obstacle.shape.a)
    }

    fn others(&self, program: Program) -> Vec<Other> {
        let d_g = self.d_g();
        let other = |it: &planners::Neighbor| Other {
            position: it.position,
            heading_rad: it.yaw_rad,
            arrived: it.arrived,
            parked: it.arrived || it.stopped,
            right_of_way: it.remaining_m > d_g && !it.arrived && !(program == Program::P && it.stopped),
            rho_m: RHO_R_M,
        };
        self.input.neighbors.iter().map(other).collect()
    }
}

/// Section 3.10.
fn baseline(own: &Own<'_>, variant: Variant) -> Answer {
    let d_g = own.d_g();
    let pull = match variant {
        Variant::Lin => d_g.max(1.0),
        Variant::Const => 4.0,
        Variant::Max3 => d_g.max(3.0),
        Variant::Max4 => d_g.max(4.0),
        Variant::H => d_g + 0.5,
    };
    let pillars = own.pillars().map(|at| (at, RHO_O_M));
    let robots = own.input.neighbors.iter().map(|robot| (robot.position, RHO_R_M));
    let push = |(at, rho): (Point2<f64>, f64)| {
        let Sight { d, theta, .. } = own.sight(at);
        own.settled(if d < 2.0 * rho { polar(mu(d, rho), theta + PI) } else { Vector2::zeros() })
    };
    let pull = own.settled(polar(pull, own.theta_g));
    let [f_r, f_t]: [f64; 2] = (pull + rounded(pillars.map(push).sum()) + rounded(robots.map(push).sum())).into();
    let commands = edges([f_r, f_t]).map(|force| baseline_speeds(variant, force)).collect();
    Answer { commands, stops: false, drives: true }
}

/// A force and those beside it.
fn edges([f_r, f_t]: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    let beside = [[0.0, 0.0], [-EDGE, 0.0], [EDGE, 0.0], [0.0, -EDGE], [0.0, EDGE]];
    beside.into_iter().map(move |[r, t]| [f_r + r, f_t + t])
}

/// Section 3.8, the baselines.
fn baseline_speeds(variant: Variant, [f_r, f_t]: [f64; 2]) -> [f64; 2] {
    let quarter = f_r / 4.0;
    let mut v = match variant {
        Variant::Lin | Variant::Const => SPEED_MPS_MAX * (quarter * quarter + f_r / 16.0) + CREEP_MPS,
        _ => SPEED_MPS_MAX * quarter * quarter + CREEP_MPS,
    };
    v = if f_r < 0.0 { 0.0 } else { v };
    let mut w = f_t / 4.0
        * match variant {
            Variant::Lin => 2.0,
            Variant::Const => 1.0,
            Variant::Max3 | Variant::Max4 => 3.0,
            Variant::H => 5.0,
        };
    match variant {
        Variant::Const => {}
        Variant::H if v == 0.0 && w.abs() < 0.05 => w = sgn(w),
        Variant::H => {}
        _ if f_r < -1.0 && w.abs() < 0.05 => w = sgn(w),
        _ => {}
    }
    if w.abs() < 0.03 {
        match variant {
            Variant::Const if v == 0.0 => v = 0.2,
            Variant::H if v == 0.0 => v = CREEP_MPS,
            Variant::Lin | Variant::Max3 | Variant::Max4 if v <= 0.1 => v = 0.1,
            _ => {}
        }
    }
    clipped(v, w)
}

fn clipped(v: f64, w: f64) -> [f64; 2] {
    [v.clamp(0.0, SPEED_MPS_MAX), w.clamp(-TURN_RADPS_MAX, TURN_RADPS_MAX)]
}

/// Sections 3.1 to 3.9.
fn proposed(own: &Own<'_>, program: Program) -> Answer {
    let robots = own.others(program);
    let mut answer = Answer::default();
    let attraction = if own.d_g() < 0.5 { 2.0 * C_A } else { C_A };
    let attraction = own.settled(polar(attraction, own.theta_g));
    let obstacles = rounded(own.pillars().map(|at| own.settled(pillar(own, program, at))).sum());
    let mut pushed = Vector2::zeros();
    let (mut front, mut yields) = (false, false);
    for it in robots.iter().copied().chain(traps(own, &robots)) {
        let (push, stops) = robot(own, program, &it);
        pushed += own.settled(push);
        front |= stops.0;
        yields |= stops.1;
    }
    for crowds in circles(own, program, &robots) {
        let Some(crowds) = crowds else {
            // Within a crowd.
            answer.commands.push([0.0, 0.0]);
            answer.stops = true;
            continue;
        };
        let crowds: Vector2<f64> = crowds.iter().map(|crowd| own.settled(around(own, program, *crowd))).sum();
        for force in edges((attraction + obstacles + rounded(pushed) + crowds).into()) {
            let [v, w] = speeds(program, force);
            let creeps = front && !yields && w.abs() < 2f64.to_radians();
            let v = match (front || yields, creeps) {
                (false, _) => v,
                (true, true) => CREEP_MPS,
                (true, false) => 0.0,
            };
            answer.commands.push([v, w]);
        }
        answer.stops |= yields;
        answer.drives |= !yields;
    }
    answer
}

/// Section 3.8.
fn speeds(program: Program, [f_r, f_t]: [f64; 2]) -> [f64; 2] {
    let quarter = f_r / 4.0;
    let (v, mut w) = match program {
        Program::C1 => (SPEED_MPS_MAX * (quarter * quarter + f_r / 16.0) + CREEP_MPS, 3.0 * f_t / 4.0),
        _ => (SPEED_MPS_MAX * quarter * quarter, 5.0 * f_t / 4.0),
    };
    let mut v = if f_r < 0.0 { 0.0 } else { v };
    if f_r < -1.0 && w.abs() < 0.05 {
        w = sgn(w);
    }
    if v == 0.0 && w.abs() < 0.03 {
        v = CREEP_MPS;
    }
    clipped(v, w)
}

/// Section 3.2.
fn pillar(own: &Own<'_>, program: Program, at: Point2<f64>) -> Vector2<f64> {
    let Sight { d, theta, psi, beta, gamma } = own.sight(at);
    if d >= 2.0 * RHO_O_M {
        return Vector2::zeros();
    }
    let mu = mu(d, RHO_O_M);
    let k_o = if program == Program::C1 { 2.0 } else { 3.0 };
    let ring = RHO_O_M < d && d < 1.5 * RHO_O_M || d > 1.5 * RHO_O_M && psi.abs() < FRAC_PI_2;
    let mut force = polar(mu, theta + PI);
    if gamma > FRAC_PI_4 && ring {
        force += polar(mu + k_o, theta + FRAC_PI_2 * side(psi, beta, 20f64.to_radians()));
    }
    force
}

/// Sections 3.4 and 3.7: the force, and whether it is a reason for a front stop, for a yield or follow stop.
fn robot(own: &Own<'_>, program: Program, it: &Other) -> (Vector2<f64>, (bool, bool)) {
    let Sight { d, theta, psi, beta, gamma } = own.sight(it.position);
    let rho = it.rho_m;
    if d >= 2.0 * rho {
        return (Vector2::zeros(), (false, false));
    }
    let (a_ij, a_ji) = (-psi, wrap(theta - PI - it.heading_rad));
    let cone = if program == Program::C1 { FRAC_PI_2 } else { FRAC_PI_4 };
    let front = d < rho && psi.abs() < cone;
    let leaves = !it.parked && d < RHO_R_M && psi.abs() < FRAC_PI_2 && a_ji.abs() > FRAC_PI_2;
    let yields = leaves || program == Program::P && follows(own, it);
    if leaves && program == Program::C1 {
        return (Vector2::zeros(), (front, yields));
    }
    let mu = mu(d, rho);
    let mut force = polar(mu, theta + PI);
    let k = match d {
        d if 1.5 * rho < d => Some(2.0),
        d if rho < d && d < 1.5 * rho => Some(4.0),
        _ => None,
    };
    if let Some(k) = k.filter(|_| gamma > PI / 3.0) {
        if it.parked {
            if k == 4.0 || psi.abs() < FRAC_PI_2 {
                force += polar(mu + k, theta + FRAC_PI_2 * side(psi, beta, 10f64.to_radians()));
            }
        } else if psi.abs() < FRAC_PI_2 && a_ji.abs() < FRAC_PI_2 {
            let tie = if program == Program::C1 { a_ij.abs() > a_ji.abs() } else { it.right_of_way };
            let s = if a_ij * a_ji < 0.0 && tie { -1.0 } else { 1.0 };
            force += polar(mu + k, theta - FRAC_PI_2 * sgn(s * a_ji));
        }
    }
    (force, (front, yields))
}

/// Section 3.7, follow stop.
fn follows(own: &Own<'_>, it: &Other) -> bool {
    let goal = own.input.goal - it.position;
    let off = |a: f64, b: f64| wrap(a - b).abs();
    it.right_of_way
        && off(bearing(goal), own.theta_g) < 30f64.to_radians()
        && goal.norm() < own.d_g()
        && off(own.input.yaw_rad, own.theta_g) < 40f64.to_radians()
        && off(own.input.yaw_rad, it.heading_rad) < FRAC_PI_2
}

/// Section 3.5: virtual parked robots between parked ones and pillars.
fn traps(own: &Own<'_>, robots: &[Other]) -> Vec<Other> {
    let mut found = Vec::new();
    // Fixed things close a trap: a robot that only waits is not one.
    let near = |it: &&Other| it.arrived && (it.position - own.input.position).norm() < 2.0 * RHO_R_M;
    for it in robots.iter().filter(near) {
        for at in own.pillars().filter(|at| ((at - it.position).norm() - RHO_R_M).abs() < RHO_O_M) {
            found.push(Other {
                position: nalgebra::center(&at, &it.position),
                parked: true,
                rho_m: RHO_R_M / 1.5,
                ..*it
            });
        }
    }
    found
}

/// A circle around a crowd: centre and ρ, m.
type Circle = (Point2<f64>, f64);

/// Section 3.6, steps 1 to 5: the circles that act, for every choice among equally small rectangles; `None` is a stop
/// within a crowd.
fn circles(own: &Own<'_>, program: Program, robots: &[Other]) -> Vec<Option<Vec<Circle>>> {
    let c_r = if program == Program::C1 { 3.0 } else { 2.5 };
    let reach_m = c_r * 2.0 * RHO_R_M;
    if own.d_g() < reach_m {
        return vec![Some(Vec::new())];
    }
    let near = |it: &&Other| {
        let d = (it.position - own.input.position).norm();
        d < if it.arrived { 2.0 * RHO_R_M } else { reach_m }
    };
    let candidates: Vec<Other> = robots.iter().filter(near).copied().collect();
    let mut choices: Vec<Option<Vec<Circle>>> = vec![Some(Vec::new())];
    for group in groups(program, &candidates) {
        let moving: Vec<Point2<f64>> = group.iter().filter(|it| !it.arrived).map(|it| it.position).collect();
        let (centers, r_c): (Vec<Point2<f64>>, Vec<f64>) = if moving.len() < 3 {
            let (center, r_c) = triangle(own, &group);
            (vec![center], vec![r_c])
        } else {
            let hull = hull(&moving);
            if within(&hull, own.input.position) && !within(&hull, own.input.goal) {
                return vec![None];
            }
            rectangles(&hull).into_iter().unzip()
        };
        let mut more = Vec::new();
        for (center, r_c) in centers.into_iter().zip(r_c) {
            let acts = (own.input.goal - center).norm() >= r_c;
            for choice in choices.iter().flatten() {
                let mut choice = choice.clone();
                choice.extend(acts.then_some((center, r_c + R_ROBOT_M + SAFETY_M)));
                more.push(Some(choice));
            }
        }
        choices = more;
    }
    if program == Program::P {
        for choice in choices.iter_mut().flatten() {
            let largest = choice.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a });
            *choice = largest.into_iter().collect();
        }
    }
    choices
}

/// Step 2: in one pass, each candidate listing itself and the later ones that it is linked with.
fn groups(program: Program, candidates: &[Other]) -> Vec<Vec<Other>> {
    let linked = |a: &Other, b: &Other| {
        (a.position - b.position).norm() < LINK_M && !(program == Program::C1 && a.arrived && b.arrived)
    };
    let n = candidates.len();
    let list =
        |i: usize| -> Vec<bool> { (0..n).map(|j| j == i || j > i && linked(&candidates[i], &candidates[j])).collect() };
    let mut free = vec![true; n];
    let mut found = Vec::new();
    for first in 0..n {
        if !std::mem::take(&mut free[first]) {
            continue;
        }
        let mut union = list(first);
        for (later, free) in free.iter_mut().enumerate().skip(first + 1) {
            let its = list(later);
            if *free && its.iter().zip(&union).any(|(a, b)| *a && *b) {
                union.iter_mut().zip(its).for_each(|(all, one)| *all |= one);
                *free = false;
            }
        }
        let group: Vec<Other> = (0..n).filter(|i| union[*i]).map(|i| candidates[i]).collect();
        if group.len() > 1 {
            found.push(group);
        }
    }
    found
}

/// Step 3, few members: the equilateral triangle beyond the two that are seen at the outermost.
fn triangle(own: &Own<'_>, group: &[Other]) -> Circle {
    let psi = |it: &&Other| own.sight(it.position).psi;
    let by_psi = |a: &&Other, b: &&Other| psi(a).total_cmp(&psi(b));
    let (a, b) = (group.iter().min_by(by_psi), group.iter().max_by(by_psi));
    let [a, b] = [a, b].map(|it| it.expect("a group has members").position);
    let (along, middle) = (b - a, nalgebra::center(&a, &b));
    let mut aside = Vector2::new(-along.y, along.x).normalize();
    if aside.dot(&(own.input.position - middle)) > 0.0 {
        aside = -aside;
    }
    let length = along.norm();
    (middle + aside * (length / 12f64.sqrt()), length / SQRT_2)
}

/// Step 3, more members: centre and r_c of the smallest rectangle that lies flush with a side of the hull, or of all that
/// are as small.
fn rectangles(hull: &[Point2<f64>]) -> Vec<Circle> {
    let mut found: Vec<(f64, Circle)> = Vec::new();
    for (i, from) in hull.iter().enumerate() {
        let along = (hull[(i + 1) % hull.len()] - from).normalize();
        let across = Vector2::new(-along.y, along.x);
        let extent = |axis: Vector2<f64>| {
            let at = hull.iter().map(|p| p.coords.dot(&axis));
            at.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        };
        let ([x0, x1], [y0, y1]) = (extent(along), extent(across));
        let center = Point2::from(along * (0.5 * (x0 + x1)) + across * (0.5 * (y0 + y1)));
        let r_c = (2.5 * 0.5 * (x1 - x0).min(y1 - y0)).max(2.0 * RHO_R_M);
        found.push(((x1 - x0) * (y1 - y0), (center, r_c)));
    }
    let least = found.iter().map(|(area, _)| *area).fold(f64::INFINITY, f64::min);
    found.into_iter().filter(|(area, _)| *area <= least + TIE * (1.0 + least)).map(|(_, circle)| circle).collect()
}

/// The convex hull, counter-clockwise.
fn hull(points: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = Point2<f64>>| {
        let mut chain: Vec<Point2<f64>> = Vec::new();
        for p in points {
            while chain.len() > 1 && left_of(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0.0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut lower = half(&mut sorted.iter().copied());
    lower.extend(half(&mut sorted.iter().rev().copied()));
    lower
}

fn left_of(a: Point2<f64>, b: Point2<f64>, p: Point2<f64>) -> f64 {
    (b - a).perp(&(p - a))
}

/// Strictly within.
fn within(hull: &[Point2<f64>], p: Point2<f64>) -> bool {
    (0..hull.len()).all(|i| left_of(hull[i], hull[(i + 1) % hull.len()], p) > 0.0)
}

/// Section 3.6, step 6.
fn around(own: &Own<'_>, program: Program, (center, rho): Circle) -> Vector2<f64> {
    let Sight { d, theta, psi, beta, gamma } = own.sight(center);
    if program == Program::P && d > 2.0 * rho {
        return Vector2::zeros();
    }
    let (mu, from) = (mu(d, rho), if program == Program::P { 0.8 * rho } else { rho });
    if gamma > 36f64.to_radians() && d > from {
        let goal_side = gamma < 160f64.to_radians() || psi.abs() < 20f64.to_radians();
        let tau = if goal_side { sgn(beta * psi) } else { 1.0 };
        polar(mu + 4.0, theta + 112.5f64.to_radians() * sgn(psi) * tau)
    } else {
        polar(mu + 2.0, theta + PI)
    }
}
