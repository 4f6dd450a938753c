//! DAPF, the baseline of AMR-APF: a goal that pulls, obstacles and robots that push straight away.
//!
//! F. Matoui, B. Boussaid, M. N. Abdelkrim, "Distributed path planning of a multi-robot system based on the neighborhood
//! artificial potential field approach", Simulation 95(7), 2019, as the authors of [`amr_apf`](crate::amr_apf)
//! implemented it for their comparison; the original could not be consulted.
//!
//! | symbol | here           | unit | default | larger means                       |
//! |--------|----------------|------|---------|------------------------------------|
//! |        | `variant`      |      | lin     |                                    |
//! | s      | `safety_m`     | m    | 0.07    | wider around everything            |
//! |        | `margin_m`     | m    | 0       | wider around robots                |
//! |        | `turn_gain`    | rad/s | 2      | turns sharper                      |
//! |        | `right_of_way` |      | off     |                                    |
//!
//! The attraction differs from experiment to experiment: max(d, 1) in `lin`, constant in `const`, max(d, 4) in `max4`,
//! max(d, 3) in `max3`, d + 0.5 in `h`. It matters: with `lin` the robot slows down as it nears its goal.
//!
//! The rule that lets a robot wait for one with right of way never acted in the authors' program because of an
//! oversight, so it is off by default; `right_of_way = true` makes it work.
//!
//! What differs from the program in general (radii, speeds, other kinds of bodies) is as in
//! [`amr_apf`](crate::amr_apf), except that others are taken to be where they last said. Known limits: local minima;
//! standstill of opposed robots.

use crate::amr_apf::field::{Own, mu};
use crate::amr_apf::speed::{Body, Pivot, SpeedLaw, Twist};
use crate::amr_apf::{rounded, unicycle};
use crate::method::{Identity, Length, Method, Symmetry, any_speed};
use crate::params::ParamError;
use crate::planner::{Neighbor, Plan, PlanInput, Planner, nearest_by_id};
use model::{BodyKind, Drive, ParamValues, PlanState};
use nalgebra::{Point2, Rotation2, Vector2};
use std::f64::consts::{FRAC_PI_2, PI};

/// The size of the pull to which speeds and pushes refer: C_a of AMR-APF.
const C_A: f64 = 4.0;

/// Registry entry.
pub static METHOD: Method = Method {
    name: "dapf",
    summary: "the baseline of amr-apf: pull and straight pushes of obstacles and robots",
    source: "Matoui et al. 2019, Simulation 95(7), as in the AMR-APF paper",
    kinds: BodyKind::MOBILE,
    symmetry: Symmetry::FULL,
    params: Params::specs,
    speed_mps: any_speed,
    lengths: &[Length::of("safety_m", 1)],
    wants_filter: false,
    follows_ways: false,
    build,
};

crate::choice! {
    /// Which of the authors' experiments.
    pub enum Variant {
        /// Attraction max(d, 1): the second series of case 1.
        Lin = "lin",
        /// Constant attraction: the first series of case 1.
        Const = "const",
        /// Attraction max(d, 4): the demonstrations.
        Max4 = "max4",
        /// Attraction max(d, 3): case 2, as inferred.
        Max3 = "max3",
        /// Attraction d + 0.5: the later program.
        H = "h",
    }
}

crate::params! {
    /// Parameters that a scenario can set. Values that are not given are those of the variant; the table shows `lin`.
    pub struct Params {
        /// Variant of the paper: sets the attraction and all values that are not given.
        variant: Variant = Variant::Lin, "";
        /// Safety distance s, part of every ρ. Larger: wider around everything.
        safety_m: f64 = 0.07, "m", 0.0..=10.0;
        /// Added to the radius of every robot, own and others, for bodies that are not round. Larger: wider around
        /// robots than around obstacles.
        margin_m: f64 = 0.0, "m", 0.0..=10.0;
        /// Turn rate at 0.2 m/s per sideways force of 4; grows with the speed limit. Larger: turns sharper.
        turn_gain: f64 = 2.0, "rad/s", 0.0..=100.0;
        /// Stand still while a robot with right of way is nearer than ρ_r (`const`: and in front).
        right_of_way: bool = false, "";
        /// Forces to three decimals as in the program: for comparing step counts.
        exact: bool = false, "";
        /// sgn(0) = 0 as in the program: a robot that must turn in place does not turn if its heading error is exactly zero.
        sgn_zero: bool = false, "";
    }
}

/// The method at work for one robot.
#[derive(Clone, Debug)]
pub struct Dapf {
    params: Params,
    /// Own slot: settles ties of right of way, and who goes where when centres coincide.
    robot: u32,
    /// Heading of the unicycle that a point robot drives as, rad.
    heading_rad: Option<f64>,
}

fn build(values: &ParamValues, identity: Identity) -> Result<Box<dyn Planner>, ParamError> {
    Params::from_values(values)?;
    Ok(Box::new(Dapf::new(Params::of_values(values), identity)))
}

impl Params {
    /// The variant named in `values`, with the other values on top.
    pub fn of_values(values: &ParamValues) -> Params {
        Params::of(Params::variant.given(values).unwrap_or(Variant::Lin)).with(values)
    }

    /// The values of a variant.
    pub fn of(variant: Variant) -> Params {
        let (turn_gain, safety_m) = match variant {
            Variant::Lin => (2.0, 0.07),
            Variant::Const => (1.0, 0.07),
            Variant::Max4 | Variant::Max3 => (3.0, 0.07),
            Variant::H => (5.0, 0.1),
        };
        Params { variant, safety_m, turn_gain, ..Params::default() }
    }

    /// Size of the pull at this distance from the goal, m.
    pub fn attraction(&self, d: f64) -> f64 {
        match self.variant {
            Variant::Lin => d.max(1.0),
            Variant::Const => C_A,
            Variant::Max4 => d.max(4.0),
            Variant::Max3 => d.max(3.0),
            Variant::H => d + 0.5,
        }
    }

    /// From force to command.
    pub fn speed_law(&self) -> SpeedLaw {
        let linear = if matches!(self.variant, Variant::Lin | Variant::Const) { 0.25 } else { 0.0 };
        let (pivot, creep_below, creep) = match self.variant {
            Variant::Const => (Pivot::Never, 0.0, 1.0),
            Variant::H => (Pivot::Standing, 0.0, 0.25),
            _ => (Pivot::Backwards, 0.5, 0.5),
        };
        SpeedLaw { linear, floor: 0.25, turn_gain: self.turn_gain, pivot, creep_below, creep, guarded: false }
    }
}

impl Planner for Dapf {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        if input.arrived {
            return Plan { stopped: true, ..Plan::only(Drive::stop(input.kind)) };
        }
        let own = unicycle::own(input, self.heading_rad, self.params.sgn_zero);
        let exact = self.params.exact;
        let radius_m = input.radius_m + self.params.margin_m;
        // The later program rounds only the pull.
        let all_exact = exact && self.params.variant != Variant::H;
        let to_goal = own.goal - own.position;
        let distance = to_goal.norm();
        let direction = if distance > 0.0 { to_goal.y.atan2(to_goal.x) } else { own.heading_rad };
        let attraction = rounded(own.along(self.params.attraction(distance), direction), exact);
        let mut obstacles = Vector2::zeros();
        for obstacle in nearest_by_id(input.obstacles, own.position) {
            let rho = radius_m + obstacle.shape.radius + self.params.safety_m;
            let at = obstacle.shape.nearest_core(own.position);
            obstacles += rounded(push(&own, at, rho, own.heading_rad), all_exact);
        }
        let mut robots = Vector2::zeros();
        let mut yields = false;
        for neighbor in input.neighbors {
            let rho = radius_m + neighbor.radius_m + self.params.margin_m + self.params.safety_m;
            // Two robots with one centre must not be pushed the same way, so the lower slot goes back.
            let apart = if self.robot < neighbor.id { 0.0 } else { PI };
            robots += rounded(push(&own, neighbor.position, rho, apart), all_exact);
            yields |= self.params.right_of_way && self.waits_for(&own, neighbor, rho);
        }
        let force = attraction + obstacles + robots;
        let twist = if yields {
            Twist { speed_mps: 0.0, turn_radps: 0.0 }
        } else {
            let speed_mps_max = input.limits.speed_mps_max;
            let body =
                Body { c_a: C_A, speed_mps_max, dt_s: input.dt_s, blocked: false, sgn_zero: self.params.sgn_zero };
            self.params.speed_law().twist(force, &body)
        };
        let heading = Rotation2::new(own.heading_rad);
        Plan {
            drive: unicycle::drive(twist, &own, input, &mut self.heading_rad),
            attractive: heading * attraction,
            repulsive: heading * (force - attraction),
            stopped: yields,
            state: PlanState::Ready,
            intent: None,
        }
    }
}

impl Dapf {
    /// The method with these parameters (not only the variant's), for this robot.
    pub fn new(params: Params, identity: Identity) -> Dapf {
        Dapf { params, robot: identity.robot, heading_rad: None }
    }

    fn waits_for(&self, own: &Own, neighbor: &Neighbor, rho: f64) -> bool {
        let distance = (own.goal - own.position).norm();
        let longer = neighbor.remaining_m > distance || (neighbor.remaining_m == distance && neighbor.id < self.robot);
        let counts = self.params.variant != Variant::Const
            || own.sight(neighbor.position, own.heading_rad).psi.abs() < FRAC_PI_2;
        longer && !neighbor.arrived && counts && (neighbor.position - own.position).norm() < rho
    }
}

/// μ straight away from a thing.
fn push(own: &Own, at: Point2<f64>, rho: f64, apart_rad: f64) -> Vector2<f64> {
    if (at - own.position).norm_squared() >= (2.0 * rho).powi(2) {
        return Vector2::zeros();
    }
    let sight = own.sight(at, apart_rad);
    -own.along(mu(C_A, sight.distance_m, rho), sight.theta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::Obstacle;
    use geometry::Capsule;

    fn own(heading_rad: f64) -> Own {
        Own { position: Point2::origin(), heading_rad, goal: Point2::new(3.0, 0.0), sgn_zero: false }
    }

    /// The pull of each experiment: max(d, 1), 4, max(d, 4), max(d, 3), d + 0.5.
    #[test]
    fn the_pull() {
        for (d, expected) in [
            (0.5, [1.0, 4.0, 4.0, 3.0, 1.0]),
            (2.0, [2.0, 4.0, 4.0, 3.0, 2.5]),
            (3.5, [3.5, 4.0, 4.0, 3.5, 4.0]),
            (5.0, [5.0, 4.0, 5.0, 5.0, 5.5]),
        ] {
            let variants = [Variant::Lin, Variant::Const, Variant::Max4, Variant::Max3, Variant::H];
            assert_eq!(variants.map(|variant| Params::of(variant).attraction(d)), expected, "{d} m");
        }
        let safety =
            [Variant::Lin, Variant::Const, Variant::Max4, Variant::Max3, Variant::H].map(|v| Params::of(v).safety_m);
        assert_eq!(safety, [0.07, 0.07, 0.07, 0.07, 0.1]);
    }

    /// μ of AMR-APF with C_a = 4, straight away, within 2ρ: 4 at ρ, 0.5625 at 4ρ/3.
    #[test]
    fn the_push() {
        for (at, expected) in [
            ([0.4, 0.0], [-4.0, 0.0]),
            ([0.0, 0.4], [0.0, -4.0]),
            ([-1.6 / 3.0, 0.0], [0.5625, 0.0]),
            ([0.8, 0.0], [0.0, 0.0]),
            ([0.9, 0.0], [0.0, 0.0]),
        ] {
            let found = push(&own(0.0), at.into(), 0.4, 0.0);
            assert!((found - Vector2::from(expected)).norm() < 1e-9, "{at:?}: {found:?}");
        }
        // The body frame: what is to the right pushes to the left.
        let found = push(&own(FRAC_PI_2), Point2::new(0.4, 0.0), 0.4, 0.0);
        assert!((found - Vector2::new(0.0, 4.0)).norm() < 1e-9, "{found:?}");
    }

    /// Pull, pillars with ρ_o = 0.22 + 0.11 + 0.07 and robots with ρ_r = 2 · 0.22 + 0.07 add up.
    #[test]
    fn they_add_up() {
        let discs = [[0.5, 0.2], [0.5, -0.3]].map(|at| Obstacle {
            id: u32::from(at[1] > 0.0),
            shape: Capsule::disc(at.into(), 0.11),
            velocity: Vector2::zeros(),
        });
        let robots = [[0.0, 0.7], [-0.8, 0.0]].map(|at| Neighbor {
            id: if at[1] > 0.0 { 1 } else { 2 },
            position: at.into(),
            yaw_rad: 0.0,
            // Others are taken to be where they last said.
            velocity: Vector2::new(1.0, 0.0),
            radius_m: 0.22,
            age_s: 0.1,
            remaining_m: 9.0,
            arrived: false,
            stopped: false,
            next: None,
            intent: None,
        });
        let input = PlanInput {
            yaw_rad: 0.4,
            radius_m: 0.22,
            goal: Point2::new(3.0, 4.0),
            goal_tolerance_m: 0.07,
            obstacles: &discs,
            neighbors: &robots,
            map: &discs,
            walls: None,
            ..crate::testing::input()
        };
        let plan = Dapf::new(Params::of(Variant::Lin), Identity { seed: 1, robot: 0, incarnation: 0 }).plan(&input);
        let away = |at: [f64; 2], rho: f64| {
            let d = Vector2::from(at).norm();
            -Vector2::from(at) / d * (16.0 * rho.powi(4) * (1.0 / d - 0.5 / rho).powi(2) / (d * d))
        };
        let expected =
            away([0.5, 0.2], 0.4) + away([0.5, -0.3], 0.4) + away([0.0, 0.7], 0.51) + away([-0.8, 0.0], 0.51);
        assert!((plan.attractive - Vector2::new(3.0, 4.0)).norm() < 1e-9, "{:?}", plan.attractive);
        assert!((plan.repulsive - expected).norm() < 1e-9, "{:?} instead of {expected:?}", plan.repulsive);
        assert!(!plan.stopped);
    }

    /// A robot with right of way nearer than ρ_r makes us wait; in `const` only one in front.
    #[test]
    fn who_is_waited_for() {
        let robot = |at: [f64; 2], remaining_m: f64, arrived: bool| Neighbor {
            id: 1,
            position: at.into(),
            yaw_rad: 0.0,
            velocity: Vector2::zeros(),
            radius_m: 0.2,
            age_s: 0.0,
            remaining_m,
            arrived,
            stopped: false,
            next: None,
            intent: None,
        };
        for (it, slot, lin, constant) in [
            (robot([0.49, 0.0], 3.1, false), 0, true, true),
            (robot([-0.49, 0.0], 3.1, false), 0, true, false),
            (robot([0.0, -0.49], 3.1, false), 0, true, false),
            (robot([0.1, 0.48], 3.1, false), 0, true, true),
            (robot([0.51, 0.0], 3.1, false), 0, false, false),
            (robot([0.49, 0.0], 2.9, false), 0, false, false),
            (robot([0.49, 0.0], 3.1, true), 0, false, false),
            (robot([0.49, 0.0], 3.0, false), 0, false, false),
            (robot([0.49, 0.0], 3.0, false), 2, true, true),
        ] {
            for (variant, waits) in [(Variant::Lin, lin), (Variant::Max3, lin), (Variant::Const, constant)] {
                let dapf = Dapf::new(Params::of(variant), Identity { seed: 1, robot: slot, incarnation: 0 });
                assert_eq!(dapf.waits_for(&own(0.0), &it, 0.5), waits, "{variant:?}, slot {slot}: {it:?}");
            }
        }
    }
}
