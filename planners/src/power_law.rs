//! A force that looks ahead: the push depends on the time to a collision, not on the distance.
//!
//! I. Karamouzas, B. Skinner, S. J. Guy, "Universal Power Law Governing Pedestrian Interactions",
//! Physical Review Letters 113, 238701, 2014.
//!
//! Two discs that go on as they are touch after the time τ, if they do. The energy of a pair is E(τ) = k τ⁻² exp(−τ/τ₀), and
//! the force on each is its negative gradient by the position of that disc. With n the outward normal where the two will
//! touch, and c the speed at which they close along n, ∇τ = n/c, so that
//!
//! F = k τ⁻² (2/τ + 1/τ₀) exp(−τ/τ₀) n/c.
//!
//! The goal adds (v_pref − v)/ξ.
//!
//! | paper  | here           | unit | default | pedestrian | larger means                              |
//! |--------|----------------|------|---------|------------|-------------------------------------------|
//! | k      | `k`            | r²   | 24      | 1.5 m²     | gives way more strongly                   |
//! | τ₀     | `tau_0`        | r/v  | 15.6    | 3 s        | gives way earlier                         |
//! | ξ      | `xi`           | r/v  | 2.8     | 0.54 s     | takes longer to come back to its velocity |
//! |        | `accel_max`    | v²/r | 3.0     | 20 m/s²    | sharper evasions                          |
//! |        | `heading_gain` | 1/s  | 3.0     |            | a unicycle turns sharper                  |
//!
//! The paper's values are those of pedestrians. A robot of another size or speed is a pedestrian seen at another scale: r is
//! its radius and v its greatest speed, lengths are counted in r and times in r/v. The defaults are the published values for
//! r = 0.25 m and v = 1.3 m/s; the limit of 20 m/s² is that of the authors' example program.
//!
//! Differs from the paper:
//! - v_pref leads along the shortest way on the known map ([`way`](crate::way)), and straight to the goal without a map. Near
//!   the goal it is the distance over 2 ξ, so that the body comes to rest there.
//! - An obstacle pushes once, by the piece of it that would be touched first: a disc, or a segment with round ends.
//! - What another robot does is taken from its own word, as [`orca`](crate::orca) does. The range of the radio stands for
//!   the 10 m within which the authors' program looks for neighbours.
//! - Bodies that overlap are pushed straight apart with the greatest acceleration. The authors' program shrinks their radii
//!   instead.
//! - Each push is limited to the greatest acceleration, as is the sum: E grows without limit as τ goes to zero, and ∇τ does
//!   for collisions that only graze.
//! - A unicycle cannot go sideways, so its own velocity does not show what the pushes of the last ticks came to. It
//!   remembers how far they have led from its preferred velocity, which fades with ξ, and plans with the sum of both as its
//!   velocity.
//!
//! Known limits: a force does not rule out a contact. Bodies touch in dense crowds, above all where a tick is not short
//! against r/v, and two that meet exactly head on stop each other.

use crate::guide::{Guide, Heading};
use crate::method::{Identity, Method, Symmetry, any_speed};
use crate::params::ParamError;
use crate::planner::{Neighbor, Obstacle, Plan, PlanInput, Planner, nearest_by_id};
use crate::steering::steer_to_goal;
use geometry::Capsule;
use model::{BodyKind, Drive, ParamValues, PlanState};
use nalgebra::{Point2, Vector2};

/// Registry entry.
pub static METHOD: Method = Method {
    name: "power-law",
    summary: "a force that looks ahead: pushes by the time to a collision",
    source: "Karamouzas, Skinner, Guy 2014, Physical Review Letters 113, 238701",
    // Ways round discs have corners in fixed directions.
    symmetry: Symmetry { rotation: false, ..Symmetry::FULL },
    kinds: BodyKind::MOBILE,
    params: Params::specs,
    speed_mps: any_speed,
    lengths: &[],
    wants_filter: false,
    follows_ways: true,
    build,
};

crate::params! {
    /// Parameters that a scenario can set.
    pub struct Params {
        /// Size k of the interaction energy, in squares of the radius. Larger: gives way more strongly.
        k: f64 = 24.0, "", 0.0..=10000.0;
        /// Time τ₀ beyond which collisions hardly count, in units of radius by speed. Larger: gives way earlier.
        tau_0: f64 = 15.6, "", 0.1..=1000.0;
        /// Time ξ in which the preferred velocity is taken up again, in units of radius by speed. Larger: slower, smoother.
        xi: f64 = 2.8, "", 0.1..=1000.0;
        /// Greatest acceleration, in units of the square of the speed by the radius. Larger: sharper evasions.
        accel_max: f64 = 3.0, "", 0.01..=1000.0;
        /// Turn rate of a unicycle per radian of heading error. Larger: turns sharper.
        heading_gain: f64 = 3.0, "1/s", 0.0..=100.0;
    }
}

/// Radius and speed of a body are at least this, so that its units are finite, m and m/s.
const BODY_MIN: f64 = 1e-6;

/// The method at work for one robot.
pub struct PowerLaw {
    params: Params,
    guide: Guide,
    /// What pushes have added to the preferred velocity of a unicycle, m/s, until after which tick.
    pushed: Option<(u64, Vector2<f64>)>,
    /// Own slot: settles who goes where when centres coincide.
    robot: u32,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    Ok(Box::new(PowerLaw::new(Params::from_values(values)?, identity)))
}

impl Planner for PowerLaw {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let law = self.law(input);
        let (wish, state) = self.preferred(input, law.xi_s);
        let speed = input.limits.speed_mps_max;
        let velocity = match input.kind {
            BodyKind::Point | BodyKind::TwoLinkArm => input.velocity,
            BodyKind::Unicycle | BodyKind::DiffDrive => {
                let pushed =
                    self.pushed.filter(|(tick, _)| tick + 1 == input.tick).map_or(Vector2::zeros(), |(_, by)| by);
                (wish + pushed).cap_magnitude(speed)
            }
        };
        // A tick longer than ξ does not overshoot.
        let attractive = (wish - velocity) / law.xi_s.max(input.dt_s);
        let me = Mover { position: input.position, velocity, radius_m: input.radius_m };
        let obstacles = (input.obstacles.chunk_by(|a, b| a.id == b.id))
            .filter_map(|pieces| me.meets_obstacle(pieces))
            .map(|meeting| law.push(&meeting));
        let robots = (input.neighbors.iter())
            .filter_map(|neighbor| me.meets_robot(neighbor, input.dt_s, self.robot))
            .map(|meeting| law.push(&meeting));
        let repulsive: Vector2<f64> = obstacles.chain(robots).sum();
        let acceleration = (attractive + repulsive).cap_magnitude(law.accel_mps2_max);
        let velocity = (velocity + acceleration * input.dt_s).cap_magnitude(speed);
        self.pushed = Some((input.tick, velocity - wish));
        let drive = match input.kind {
            BodyKind::Point => Drive::Velocity(velocity),
            BodyKind::Unicycle | BodyKind::DiffDrive => steer_to_goal(velocity, self.params.heading_gain, input),
            BodyKind::TwoLinkArm => Drive::stop(input.kind),
        };
        Plan { attractive, repulsive, state, ..Plan::only(drive) }
    }
}

impl PowerLaw {
    /// The method with these parameters, for this robot.
    pub fn new(params: Params, identity: Identity) -> PowerLaw {
        PowerLaw { params, guide: Guide::default(), pushed: None, robot: identity.robot }
    }

    /// The law in metres and seconds for this body.
    fn law(&self, input: &PlanInput<'_>) -> Law {
        let Params { k, tau_0, xi, accel_max, .. } = self.params;
        let (r, v) = (input.radius_m.max(BODY_MIN), input.limits.speed_mps_max.max(BODY_MIN));
        Law { k_m2: k * r * r, tau_0_s: tau_0 * r / v, xi_s: xi * r / v, accel_mps2_max: accel_max * v * v / r }
    }

    /// v_pref: at full speed along the way. Near the goal the body and its goal are a spring, damped by ξ so that it swings
    /// by less than half a radius.
    fn preferred(&mut self, input: &PlanInput<'_>, xi_s: f64) -> (Vector2<f64>, PlanState) {
        let speed = input.limits.speed_mps_max;
        let ahead = match self.guide.follow(input) {
            Heading::To(ahead) => ahead,
            Heading::Searching => return (Vector2::zeros(), PlanState::Planning),
            Heading::Nowhere => return (Vector2::zeros(), PlanState::GaveUp),
        };
        let offset = ahead.at - input.position;
        let wish = if ahead.is_goal {
            (offset / (2.0 * xi_s).max(input.dt_s)).cap_magnitude(speed)
        } else {
            offset.try_normalize(0.0).map_or(Vector2::zeros(), |toward| toward * speed)
        };
        (wish, PlanState::Ready)
    }
}

/// The law at the scale of one body.
#[derive(Clone, Copy, Debug)]
struct Law {
    k_m2: f64,
    tau_0_s: f64,
    xi_s: f64,
    accel_mps2_max: f64,
}

impl Law {
    /// −∇E of a meeting, limited, per unit of mass, m/s².
    fn push(&self, meeting: &Meeting) -> Vector2<f64> {
        let Meeting { tau_s, away, closing_mps } = *meeting;
        if tau_s <= 0.0 {
            return away * self.accel_mps2_max;
        }
        let slope = self.k_m2 * tau_s.powi(-2) * (2.0 / tau_s + 1.0 / self.tau_0_s) * (-tau_s / self.tau_0_s).exp();
        away * (slope / closing_mps).min(self.accel_mps2_max)
    }
}

/// Two bodies that touch, or will if both go on as they do.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    /// Time until then, s; zero if they touch now.
    tau_s: f64,
    /// The direction away from the other body where they touch.
    away: Vector2<f64>,
    /// How fast they close along it, m/s.
    closing_mps: f64,
}

/// A disc that moves.
#[derive(Clone, Copy, Debug)]
struct Mover {
    position: Point2<f64>,
    velocity: Vector2<f64>,
    radius_m: f64,
}

impl Mover {
    fn meets_robot(&self, neighbor: &Neighbor, dt_s: f64, robot: u32) -> Option<Meeting> {
        let (position, velocity, _) = neighbor.now(dt_s);
        // Two robots with one centre must not be pushed the same way, so the lower slot goes back.
        let apart = if robot < neighbor.id { -Vector2::x() } else { Vector2::x() };
        let shape = Capsule::disc(position, neighbor.radius_m);
        self.touches(&shape, apart).or_else(|| self.will_touch(&shape, velocity))
    }

    /// The piece that is or will be touched first stands for all of them.
    fn meets_obstacle(&self, pieces: &[Obstacle]) -> Option<Meeting> {
        let nearest = nearest_by_id(pieces, self.position).next()?;
        self.touches(&nearest.shape, Vector2::x()).or_else(|| {
            let meetings = pieces.iter().filter_map(|piece| self.will_touch(&piece.shape, piece.velocity));
            meetings.min_by(|a, b| a.tau_s.total_cmp(&b.tau_s))
        })
    }

    /// The meeting with a body that touches this one now; `apart` is the way out if it has none.
    fn touches(&self, shape: &Capsule, apart: Vector2<f64>) -> Option<Meeting> {
        let offset = self.position - shape.nearest_core(self.position);
        let touches = offset.norm() <= self.radius_m + shape.radius;
        touches.then(|| Meeting { tau_s: 0.0, away: offset.try_normalize(0.0).unwrap_or(apart), closing_mps: 0.0 })
    }

    /// The meeting with a body that does not touch this one yet, if there will be one.
    fn will_touch(&self, shape: &Capsule, velocity: Vector2<f64>) -> Option<Meeting> {
        let (relative, reach_m) = (self.velocity - velocity, self.radius_m + shape.radius);
        let end = |end: Point2<f64>| meets_disc(self.position - end, relative, reach_m);
        if shape.a == shape.b {
            return end(shape.a);
        }
        let all = [end(shape.a), end(shape.b), meets_side(self.position, relative, shape, reach_m)];
        all.into_iter().flatten().min_by(|a, b| a.tau_s.total_cmp(&b.tau_s))
    }
}

/// A point at this place, which moves, meets a disc round the origin: |x + v τ| = R.
fn meets_disc(x: Vector2<f64>, v: Vector2<f64>, reach_m: f64) -> Option<Meeting> {
    let (a, b, c) = (v.norm_squared(), -x.dot(&v), x.norm_squared() - reach_m * reach_m);
    let discriminant = b * b - a * c;
    if b <= 0.0 || c <= 0.0 || discriminant <= 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let tau_s = c / (b + root);
    let there = x + v * tau_s;
    Some(Meeting { tau_s, away: there.try_normalize(0.0)?, closing_mps: root / there.norm() })
}

/// A point that moves meets one of the straight sides of a capsule of this radius.
fn meets_side(x: Point2<f64>, v: Vector2<f64>, core: &Capsule, reach_m: f64) -> Option<Meeting> {
    let length = (core.b - core.a).norm();
    let along = (core.b - core.a).try_normalize(0.0)?;
    let offset = x - core.a;
    let beside = along.perp(&offset);
    let away = Vector2::new(-along.y, along.x) * beside.signum();
    let (gap_m, closing_mps) = (beside.abs() - reach_m, -v.dot(&away));
    if gap_m <= 0.0 || closing_mps <= 0.0 {
        return None;
    }
    let tau_s = gap_m / closing_mps;
    let at = (offset + v * tau_s).dot(&along);
    (0.0..=length).contains(&at).then_some(Meeting { tau_s, away, closing_mps })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{LIMITS, input};
    use geometry::Polygon;
    use model::Limits;
    use proptest::prelude::*;

    /// The law of a robot of 0.2 m and 1 m/s.
    const LAW: Law = Law { k_m2: 0.96, tau_0_s: 3.12, xi_s: 0.56, accel_mps2_max: 15.0 };
    const FAST: Limits = Limits { speed_mps_max: 1.0, ..LIMITS };

    fn planner(robot: u32) -> PowerLaw {
        PowerLaw::new(Params::default(), Identity { seed: 1, robot, incarnation: 0 })
    }

    fn mover(at: [f64; 2], velocity: [f64; 2]) -> Mover {
        Mover { position: at.into(), velocity: velocity.into(), radius_m: 0.2 }
    }

    fn neighbor(id: u32, body: &Mover) -> Neighbor {
        let Mover { velocity, radius_m, .. } = *body;
        Neighbor { velocity, radius_m, ..crate::testing::neighbor(id, body.position.into()) }
    }

    fn plan(robot: u32, me: &Mover, neighbors: &[Neighbor], obstacles: &[Obstacle]) -> Plan {
        planner(robot).plan(&PlanInput {
            kind: BodyKind::Point,
            limits: FAST,
            position: me.position,
            velocity: me.velocity,
            radius_m: me.radius_m,
            neighbors,
            obstacles,
            ..input()
        })
    }

    fn standing(id: u32, shape: Capsule) -> Obstacle {
        Obstacle { id, shape, velocity: Vector2::zeros() }
    }

    /// Without a limit, as the paper has it.
    fn unlimited(law: Law) -> Law {
        Law { accel_mps2_max: f64::INFINITY, ..law }
    }

    fn energy(tau_s: f64) -> f64 {
        LAW.k_m2 * (-tau_s / LAW.tau_0_s).exp() / (tau_s * tau_s)
    }

    proptest! {
        /// The push is the slope of the energy, by central differences: of discs, and of capsules that move.
        #[test]
        fn the_push_is_the_negative_gradient_of_the_energy(
            from in 0.0..6.3f64, far in 1.0..4.0f64, aim in -0.9..0.9f64, speed in 0.3..2.0f64,
            side in (-1.5..1.5f64, -1.5..1.5f64), is_disc: bool, drift in (-1.0..1.0f64, -1.0..1.0f64),
        ) {
            const STEP_M: f64 = 1e-6;
            let end = Point2::new(side.0, side.1);
            let shape = Capsule { a: Point2::origin(), b: if is_disc { Point2::origin() } else { end }, radius: 0.3 };
            let drift = Vector2::new(drift.0, drift.1);
            // It heads for a place within the reach of the middle.
            let middle = nalgebra::center(&shape.a, &shape.b);
            let toward = -Vector2::new(from.cos(), from.sin());
            let aside = Vector2::new(-toward.y, toward.x) * (aim * 0.5);
            let position = middle - toward * far + aside;
            prop_assume!(shape.distance(position) > 0.25);
            let at = |offset: Vector2<f64>| {
                let me = Mover { position: position + offset, velocity: toward * speed + drift, radius_m: 0.2 };
                me.will_touch(&shape, drift)
            };
            let meeting = at(Vector2::zeros()).expect("it heads for it");
            // Where it only grazes, or meets the seam of side and end, the slope changes within the step.
            prop_assume!(meeting.closing_mps > 0.05 * speed);
            let slope = |axis: Vector2<f64>| {
                let energy_at = |offset: Vector2<f64>| at(offset).map(|meeting| energy(meeting.tau_s));
                Some((energy_at(axis * STEP_M)? - energy_at(axis * -STEP_M)?) / (2.0 * STEP_M))
            };
            let (Some(x), Some(y)) = (slope(Vector2::x()), slope(Vector2::y())) else {
                return Err(TestCaseError::fail("a step of a micrometre loses it"));
            };
            let push = unlimited(LAW).push(&meeting);
            prop_assert!((push + Vector2::new(x, y)).norm() <= 1e-4 * (1.0 + push.norm()), "{push} {x} {y} {meeting:?}");
        }

        /// Each pushes the other as it is pushed, also in overlap and with one centre.
        #[test]
        fn two_equal_robots_push_each_other_alike(
            offset in (-2.0..2.0f64, -2.0..2.0f64), v in (-1.0..1.0f64, -1.0..1.0f64), w in (-1.0..1.0f64, -1.0..1.0f64),
            one_place: bool,
        ) {
            let at = if one_place { [0.0, 0.0] } else { offset.into() };
            let (one, two) = (mover([0.0, 0.0], v.into()), mover(at, w.into()));
            let first = plan(0, &one, &[neighbor(1, &two)], &[]).repulsive;
            let second = plan(1, &two, &[neighbor(0, &one)], &[]).repulsive;
            prop_assert!((first + second).norm() <= 1e-9 * (1.0 + first.norm()), "{first} {second}");
            prop_assert!(!one_place || first.norm() > 1.0, "{first}");
        }

        /// A robot of another size and speed does the same at its own scale.
        #[test]
        fn robots_of_any_size_do_the_same(
            offset in (-2.0..2.0f64, -2.0..2.0f64), v in (-1.0..1.0f64, -1.0..1.0f64), length in 0.1..10.0f64,
            pace in 0.1..10.0f64,
        ) {
            prop_assume!(offset.0.hypot(offset.1) > 0.41);
            let scaled = |length: f64, pace: f64| {
                let body = |at: [f64; 2], v: [f64; 2]| Mover {
                    position: Point2::from(at) * length, velocity: Vector2::from(v) * pace, radius_m: 0.2 * length,
                };
                let (me, other) = (body([0.0, 0.0], v.into()), body(offset.into(), [-0.3, 0.2]));
                let plan = planner(0).plan(&PlanInput {
                    kind: BodyKind::Point,
                    limits: Limits { speed_mps_max: pace, ..FAST },
                    dt_s: 0.1 * length / pace,
                    velocity: me.velocity,
                    radius_m: me.radius_m,
                    goal: Point2::new(9.0, 1.0) * length,
                    neighbors: &[neighbor(1, &other)],
                    ..input()
                });
                let Drive::Velocity(velocity) = plan.drive else { panic!("a point has a velocity") };
                velocity / pace
            };
            let (one, other) = (scaled(1.0, 1.0), scaled(length, pace));
            prop_assert!((one - other).norm() < 1e-6, "{one} {other}");
        }
    }

    #[test]
    fn there_is_no_push_without_a_collision_ahead() {
        let me = mover([0.0, 0.0], [1.0, 0.0]);
        let wall = |from: [f64; 2], to: [f64; 2]| standing(0, Capsule::segment(from.into(), to.into()));
        for (what, other) in [
            ("it goes beside", mover([0.0, 0.5], [1.0, 0.0])),
            ("it goes ahead, as fast", mover([0.5, 0.0], [1.0, 0.0])),
            ("it goes away", mover([0.5, 0.0], [1.5, 0.0])),
            ("it is behind", mover([-0.5, 0.0], [0.0, 0.0])),
            ("it is passed at 1 cm", mover([2.0, 0.41], [0.0, 0.0])),
            ("it crosses later", mover([2.0, 3.0], [0.0, -0.3])),
        ] {
            assert_eq!(plan(0, &me, &[neighbor(1, &other)], &[]).repulsive, Vector2::zeros(), "{what}");
        }
        for (what, obstacle) in [
            ("along a wall", wall([-5.0, 0.21], [5.0, 0.21])),
            ("past its end", wall([1.0, 0.21], [1.0, 5.0])),
            ("away from it", wall([-0.5, -5.0], [-0.5, 5.0])),
        ] {
            assert_eq!(plan(0, &me, &[], &[obstacle]).repulsive, Vector2::zeros(), "{what}");
        }
        // And there is one a little further in.
        let near = mover([2.0, 0.39], [0.0, 0.0]);
        assert!(plan(0, &me, &[neighbor(1, &near)], &[]).repulsive.norm() > 0.1);
        assert!(plan(0, &me, &[], &[wall([1.0, 0.19], [1.0, 5.0])]).repulsive.norm() > 0.1);
    }

    /// τ = 1.6 m / 2 m/s = 0.8 s: 0.96 / 0.64 (2.5 + 0.3205) exp(−0.2564) / 2 = 1.637 m/s².
    #[test]
    fn head_on_both_brake() {
        let (one, two) = (mover([0.0, 0.0], [1.0, 0.0]), mover([2.0, 0.0], [-1.0, 0.0]));
        let plan = plan(0, &one, &[neighbor(1, &two)], &[]);
        assert!((plan.repulsive - Vector2::new(-1.637, 0.0)).norm() < 1e-3, "{}", plan.repulsive);
        let Drive::Velocity(velocity) = plan.drive else { panic!("a point has a velocity") };
        assert!((velocity - Vector2::new(1.0 - 0.1637, 0.0)).norm() < 1e-3, "{velocity}");
    }

    /// The gradient grows without limit, the push does not.
    #[test]
    fn the_push_is_limited() {
        let me = mover([0.0, 0.0], [1.0, 0.0]);
        for (what, other) in [
            ("about to touch", mover([0.4 + 1e-12, 0.0], [-1.0, 0.0])),
            ("about to touch at once", mover([0.4 + 1e-3, 0.0], [-1e6, 0.0])),
            ("grazing", mover([0.5, 0.4 - 1e-12], [0.0, 0.0])),
            ("touching", mover([0.4, 0.0], [0.0, 0.0])),
            ("overlapping", mover([0.1, 0.0], [0.0, 0.0])),
            ("overlapping and going away", mover([0.1, 0.0], [3.0, 0.0])),
        ] {
            let push = plan(0, &me, &[neighbor(1, &other)], &[]).repulsive;
            assert!((push.norm() - 15.0).abs() < 1e-6, "{what}: {push}");
            assert!(push.x < 0.0 || push.y < 0.0 && what == "grazing", "{what}: {push}");
        }
    }

    /// One push, straight away from what would be touched first, in whatever order the edges are seen.
    #[test]
    fn a_polygon_pushes_once() {
        let corners = [[1.0, -1.0], [3.0, -1.0], [3.0, 1.0], [1.0, 1.0]].map(Point2::from).to_vec();
        let mut edges: Vec<Obstacle> = Polygon { corners }.edges().map(|edge| standing(7, edge)).collect();
        let toward_corner = mover([0.0, 2.0], [0.7, -0.7]);
        let alone = plan(0, &toward_corner, &[], &[standing(7, Capsule::disc([1.0, 1.0].into(), 0.0))]).repulsive;
        for _ in 0..edges.len() {
            edges.rotate_left(1);
            let face = plan(0, &mover([0.0, 0.0], [1.0, 0.0]), &[], &edges).repulsive;
            // τ = 0.8 s at 1 m/s: twice the push of a head-on meeting at 2 m/s.
            assert!((face - Vector2::new(-3.274, 0.0)).norm() < 1e-3, "{face}");
            // At a corner two edges meet.
            let corner = plan(0, &toward_corner, &[], &edges).repulsive;
            assert!(corner.norm() > 0.1 && (corner - alone).norm() < 1e-9, "{corner} {alone}");
            // Inside, the way out.
            let out = plan(0, &mover([1.1, 0.0], [1.0, 0.0]), &[], &edges).repulsive;
            assert!((out - Vector2::new(-15.0, 0.0)).norm() < 1e-9, "{out}");
        }
    }

    #[test]
    fn what_moves_is_met_where_it_will_be() {
        let me = mover([0.0, 0.0], [0.0, 0.0]);
        let wall = Capsule::segment([1.0, -1.0].into(), [1.0, 1.0].into());
        let moving = Obstacle { velocity: Vector2::new(-1.0, 0.0), ..standing(0, wall) };
        let push = plan(0, &me, &[], &[moving]).repulsive;
        assert!((push - Vector2::new(-3.274, 0.0)).norm() < 1e-3, "{push}");
        assert_eq!(plan(0, &me, &[], &[standing(0, wall)]).repulsive, Vector2::zeros());
    }

    /// It swings past its goal by less than half a radius, and comes to rest there.
    #[test]
    fn it_stops_at_its_goal() {
        let (mut planner, mut x_m, mut speed, mut most) = (planner(0), 0.0, 0.0, 0.0f64);
        for tick in 0..1000 {
            let plan = planner.plan(&PlanInput {
                tick,
                dt_s: 0.02,
                kind: BodyKind::Point,
                limits: FAST,
                position: Point2::new(x_m, 0.0),
                velocity: Vector2::new(speed, 0.0),
                ..input()
            });
            let Drive::Velocity(velocity) = plan.drive else { panic!("a point has a velocity") };
            speed = velocity.x;
            x_m += speed * 0.02;
            most = most.max(x_m);
        }
        assert!((x_m - 9.0).abs() < 1e-4 && speed.abs() < 1e-4, "{x_m} {speed}");
        assert!(most > 9.0 && most < 9.1, "{most}");
    }

    /// What pushes come to is remembered from tick to tick, fades with ξ, and is forgotten after a pause.
    #[test]
    fn a_unicycle_remembers_its_pushes() {
        let mut planner = planner(0);
        let beside = neighbor(1, &mover([1.5, 0.1], [0.0, 0.0]));
        let mut aside = |tick: u64, neighbors: &[Neighbor]| {
            let velocity = Vector2::x();
            let plan = planner.plan(&PlanInput { tick, dt_s: 0.05, limits: FAST, velocity, neighbors, ..input() });
            // What is missing of the preferred velocity, (v_pref - v) / ξ.
            -plan.attractive.y * LAW.xi_s
        };
        let pushed = [0, 1, 2].map(|tick| aside(tick, &[beside]));
        assert!(pushed[0].abs() < 1e-12 && pushed[1] < -1e-3 && pushed[2] < 1.5 * pushed[1], "{pushed:?}");
        let faded = [3, 4].map(|tick| aside(tick, &[]));
        assert!(faded[0] < pushed[2] && (faded[1] / faded[0] - (1.0 - 0.05 / LAW.xi_s)).abs() < 0.01, "{faded:?}");
        assert!(aside(9, &[]).abs() < 1e-12);
    }
}
