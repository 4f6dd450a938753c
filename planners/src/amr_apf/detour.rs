//! The way out of a standstill, which the paper lacks: a robot that comes no nearer to its goal drives aside for a while.
//!
//! During a detour the pull of the goal is turned, and all else only pushes away: no sides, no virtual obstacles, no
//! waiting. Angle, side and length are random, so that robots that hold each other up do not do the same for ever; a
//! trap that several detours did not lead out of gets longer ones.

use super::{Params, ROUNDING_S};
use crate::method::Identity;
use crate::planner::PlanInput;
use model::Limits;
use model::random::Stream;
use std::f64::consts::PI;

/// By how much the pull is turned, to the left or to the right, °.
const ASIDE_DEG: [f64; 2] = [60.0, 120.0];
/// Shares of `detour_s` that a first detour takes.
const LENGTH: [f64; 2] = [0.5, 1.5];
/// By how much of that every further detour is longer, and how often it still grows.
const GROWTH: f64 = 0.5;
const GROWTHS_MAX: u32 = 6;
/// Shares of `patience_s` that a robot waits after its first detour.
const PATIENCE: [f64; 2] = [1.0, 2.0];
/// Coming nearer counts from this share of what a robot drives at full speed in `patience_s`.
const PROGRESS: f64 = 0.1;

/// Whether a robot comes nearer to its goal, and what it does if it does not.
pub(crate) struct Detour {
    stream: Stream,
    /// The least distance to the goal since the last detour, and ever, m.
    best_m: f64,
    best_ever_m: f64,
    /// How long it has been no less, s, and for how many times `patience_s` that is put up with.
    stalled_s: f64,
    patience: f64,
    /// How long the detour still takes, s, and by how much the pull is turned during it, rad.
    left_s: f64,
    aside_rad: f64,
    /// Detours since the robot was nearer to its goal than ever before.
    tries: u32,
}

impl Detour {
    pub(crate) fn new(identity: Identity) -> Detour {
        Detour {
            stream: Stream::new(identity.seed, identity.robot, identity.incarnation, "amr-apf detour"),
            best_m: f64::INFINITY,
            best_ever_m: f64::INFINITY,
            stalled_s: 0.0,
            patience: PATIENCE[0],
            left_s: 0.0,
            aside_rad: 0.0,
            tries: 0,
        }
    }

    /// There is another goal.
    pub(crate) fn another_goal(&mut self) {
        (self.best_m, self.best_ever_m, self.stalled_s, self.left_s, self.tries) =
            (f64::INFINITY, f64::INFINITY, 0.0, 0.0, 0);
    }

    /// By how much the pull of the goal is turned in this tick, rad, if the robot makes a detour.
    pub(crate) fn step(&mut self, params: &Params, input: &PlanInput<'_>) -> Option<f64> {
        let Params { patience_s, detour_s, .. } = *params;
        if patience_s == 0.0 {
            return None;
        }
        let remaining_m = (input.goal - input.position).norm();
        let step_m = PROGRESS * input.limits.speed_mps_max * patience_s;
        if self.left_s > ROUNDING_S {
            self.left_s -= input.dt_s;
            (self.best_m, self.stalled_s) = (remaining_m, 0.0);
            return Some(self.aside_rad);
        }
        if remaining_m < self.best_ever_m - step_m {
            (self.best_ever_m, self.tries) = (remaining_m, 0);
        }
        if remaining_m < self.best_m - step_m {
            (self.best_m, self.stalled_s) = (remaining_m, 0.0);
        } else {
            self.stalled_s += input.dt_s;
        }
        // A robot that turns slowly comes no nearer while it turns.
        let Limits { turn_radps_max, turn_accel_radps2_max, .. } = input.limits;
        let half_turn_s = PI / turn_radps_max + 2.0 * (PI / turn_accel_radps2_max).sqrt();
        if self.stalled_s > half_turn_s.max(patience_s * self.patience) + ROUNDING_S {
            let mut between = |[low, high]: [f64; 2]| self.stream.between(low, high);
            self.patience = between(PATIENCE);
            self.left_s = detour_s * between(LENGTH) * (1.0 + GROWTH * f64::from(self.tries.min(GROWTHS_MAX)));
            let side = if between([0.0, 1.0]) < 0.5 { -1.0 } else { 1.0 };
            self.aside_rad = side * between(ASIDE_DEG).to_radians();
            self.tries += 1;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::amr_apf::Preset;
    use crate::testing::{self, LIMITS};
    use nalgebra::Point2;

    /// A robot this far from its goal, ticks of 0.5 s.
    fn input(remaining_m: f64) -> PlanInput<'static> {
        PlanInput { dt_s: 0.5, goal: Point2::new(remaining_m, 0.0), ..testing::input() }
    }

    fn detour(robot: u32) -> Detour {
        Detour::new(Identity { seed: 1, robot, incarnation: 0 })
    }

    fn params() -> Params {
        Params::of(Preset::Fleet)
    }

    /// The ticks until a detour, its ticks, and its angle.
    fn next(detour: &mut Detour, remaining_m: f64) -> (usize, usize, f64) {
        let mut step = || detour.step(&params(), &input(remaining_m));
        let mut waited = 1;
        let aside_rad = loop {
            match step() {
                Some(aside_rad) => break aside_rad,
                None => waited += 1,
            }
            assert!(waited < 100);
        };
        let mut took = 1;
        while step().is_some() {
            took += 1;
        }
        (waited - 1, took, aside_rad.to_degrees())
    }

    /// 4 s without coming nearer: one tick of progress from nothing, eight in which nothing changes, and one more.
    #[test]
    fn after_the_patience() {
        let mut robot = detour(0);
        let (waited, took, aside_deg) = next(&mut robot, 3.0);
        assert_eq!(waited, 10);
        // 2 s, half as long up to half as long again.
        assert!((2..=6).contains(&took), "{took}");
        assert!((60.0..=120.0).contains(&aside_deg.abs()), "{aside_deg}");
        // From then on the patience is 4 to 8 s; the tick that ended the detour is one of it.
        for _ in 0..20 {
            let (waited, _, aside_deg) = next(&mut robot, 3.0);
            assert!((8..=16).contains(&waited), "{waited}");
            assert!((60.0..=120.0).contains(&aside_deg.abs()), "{aside_deg}");
        }
        assert!((0..100).all(|_| detour(0).step(&Params { patience_s: 0.0, ..params() }, &input(3.0)).is_none()));
    }

    /// Half a turn takes 2π s at 0.5 rad/s, and 2 √(π / 0.5) = 5.01 s more if the rate grows by 0.5 rad/s².
    #[test]
    fn who_turns_slowly_waits() {
        for (turn_accel_radps2_max, waits) in [(f64::INFINITY, 14), (0.5, 24)] {
            let limits = Limits { turn_radps_max: 0.5, turn_accel_radps2_max, ..LIMITS };
            let mut robot = detour(0);
            let step = |robot: &mut Detour| robot.step(&params(), &PlanInput { limits, ..input(3.0) });
            assert_eq!((0..100).take_while(|_| step(&mut robot).is_none()).count(), waits);
        }
    }

    /// A tenth of 0.2 m/s for 4 s is progress: 0.08 m.
    #[test]
    fn who_comes_nearer_needs_none() {
        for (nearer_m, stalls) in [(0.09, false), (0.004, true)] {
            let mut robot = detour(0);
            let stalled = (0..40).any(|k| robot.step(&params(), &input(9.0 - nearer_m * f64::from(k))).is_some());
            assert_eq!(stalled, stalls, "{nearer_m} m a tick");
        }
    }

    /// Further detours grow by half of the first one each, up to four times as long, until the robot is nearer than ever.
    #[test]
    fn they_grow() {
        let mut robot = detour(0);
        let mean = |robot: &mut Detour, remaining_m: f64, tries: u32| {
            let mut sum = 0;
            for _ in 0..400 {
                robot.tries = tries;
                sum += next(robot, remaining_m).1;
            }
            f64::from(u32::try_from(sum).expect("few")) / 400.0
        };
        for (tries, ticks) in [(0, 4.0), (1, 6.0), (6, 16.0), (60, 16.0)] {
            let found = mean(&mut robot, 3.0, tries);
            // A part of a tick counts as a whole one.
            assert!((found - ticks - 0.5).abs() < 0.06 * ticks, "{tries}: {found}");
        }
        robot.tries = 0;
        for tries in 1..5 {
            next(&mut robot, 3.0);
            assert_eq!(robot.tries, tries);
        }
        robot.step(&params(), &input(2.95));
        assert_eq!(robot.tries, 4);
        robot.step(&params(), &input(2.9));
        assert_eq!(robot.tries, 0);
        next(&mut robot, 3.0);
        assert_eq!(robot.tries, 1);
        robot.another_goal();
        assert_eq!(robot.tries, 0);
        assert!(next(&mut robot, 9.0).0 >= 9);
    }

    /// Both sides, and robots of a fleet differ.
    #[test]
    fn nobody_does_the_same() {
        let aside = |robot: u32| -> Vec<f64> { (0..20).map(|_| next(&mut detour(robot), 3.0).2).collect() };
        let of_one = |robot: u32| {
            let mut detour = detour(robot);
            (0..20).map(|_| next(&mut detour, 3.0).2).collect::<Vec<f64>>()
        };
        assert!(aside(0).windows(2).all(|pair| pair[0] == pair[1]), "a run can be repeated");
        let [first, second] = [of_one(0), of_one(1)];
        assert!(first.iter().zip(&second).all(|(a, b)| a != b));
        for sides in [first, second] {
            let left = sides.iter().filter(|aside_deg| **aside_deg > 0.0).count();
            assert!((4..=16).contains(&left), "{left} of 20 to the left");
        }
    }
}
