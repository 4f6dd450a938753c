//! Whether a robot that has not arrived still gets on.
//!
//! A robot makes progress when its shortest free way to its goal becomes shorter, or when it really gets from one place
//! to another, as on a long way round. The path that it drives says neither: robots that push each other drive all the
//! time, and a slow one may be nearly there. So both are looked at over a window before the end of the run:
//!
//! - *standing*: over the last [`STANDING_S`], less than 5 % of what its greatest speed allows was driven;
//! - *no progress*: over the same window (of a robot that drives: over the last [`DRIVING_S`], because whoever wanders to and
//!   fro takes longer to come back), no goal was reached, the remaining way fell by less than 5 % of the path driven and
//!   less than a body's radius (or what 5 % of the greatest speed allows, if that is less), and less than half of the path
//!   driven was net displacement.
//!
//! Standing without progress is a deadlock. Driving without progress is an oscillation when the direction of driving is
//! reversed at least once in [`REVERSAL_S`], else a livelock. A robot whose planner is still looking for a way is neither
//! (`World::planned`).
//!
//! *Reversals* are counted on the path, not in time: a step ends at the first end of a tick at which the robot is at least
//! [`STEP_SHARE`] of its body's radius away from where the step began, and a step that leads back (more than 90 degrees from
//! the step before it) is a reversal. So robots of all sizes compare, a tremble that goes nowhere is none, and a robot that
//! turns round on a curve has not reversed.

use model::Stall;
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// The window for robots that stand, s.
const STANDING_S: f64 = 10.0;
/// The window for robots that drive, s.
const DRIVING_S: f64 = 30.0;
/// A robot that reverses more often than once in this time oscillates, s.
const REVERSAL_S: f64 = 2.0;
/// Time between two marks, s, or a tick if that is longer.
const STEP_S: f64 = 0.25;
/// Less than this share of the greatest speed, or of the path driven, is nothing.
const SHARE: f64 = 0.05;
/// The length of the steps whose directions are compared, as a share of the radius of the body.
const STEP_SHARE: f64 = 0.01;

/// Where a robot was and what it had done at one tick.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Mark {
    tick: u64,
    position: Point2<f64>,
    path_m: f64,
    goals_done: u32,
    reversals: u32,
}

/// What the robot can do, and how large it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    /// Its greatest speed, m/s.
    pub(crate) speed_mps: f64,
    /// Radius of its body, or the tolerance of its goal if that is more, m.
    pub(crate) size_m: f64,
}

/// The last [`DRIVING_S`] of a robot, some marks a second.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Trail {
    dt_s: f64,
    every_ticks: u64,
    capacity: usize,
    marks: VecDeque<Mark>,
    /// The least length of a step, m.
    step_m: f64,
    /// Where the step that is under way began; `None` before the robot has driven.
    begun_at: Option<Point2<f64>>,
    /// The last step, m.
    heading: Vector2<f64>,
    reversals: u32,
}

impl Trail {
    /// Of a robot with a body of this radius that has not moved yet.
    pub(crate) fn new(dt_s: f64, radius_m: f64) -> Trail {
        let every_ticks = (STEP_S / dt_s).round().max(1.0);
        let capacity = (DRIVING_S / (every_ticks * dt_s)).ceil() as usize + 1;
        let marks = VecDeque::with_capacity(capacity);
        Trail {
            dt_s,
            every_ticks: every_ticks as u64,
            capacity,
            marks,
            step_m: STEP_SHARE * radius_m,
            begun_at: None,
            heading: Vector2::zeros(),
            reversals: 0,
        }
    }

    /// It drove for a tick, from one place to the other.
    pub(crate) fn drove(&mut self, [from, to]: [Point2<f64>; 2]) {
        let step = to - *self.begun_at.get_or_insert(from);
        let length_m = step.norm();
        if length_m > 0.0 && length_m >= self.step_m {
            self.reversals += u32::from(step.dot(&self.heading) < 0.0);
            (self.heading, self.begun_at) = (step, Some(to));
        }
    }

    /// How often it has reversed its direction so far.
    pub(crate) fn reversals(&self) -> u32 {
        self.reversals
    }

    /// Mean speed over the last [`STANDING_S`], or since it joined, m/s; `None` in the tick in which it did. It has driven
    /// `path_m` so far.
    pub(crate) fn speed_mps(&self, tick: u64, path_m: f64) -> Option<f64> {
        let from = self.since(tick, STANDING_S)?;
        Some((path_m - from.path_m) / ((tick - from.tick) as f64 * self.dt_s))
    }

    /// The first mark that is at most this old.
    fn since(&self, tick: u64, window_s: f64) -> Option<&Mark> {
        let age_s = |mark: &Mark| tick.saturating_sub(mark.tick) as f64 * self.dt_s;
        // Half a tick of room: the beginning of the window itself is in it.
        self.marks.iter().find(|mark| age_s(mark) <= window_s + 0.5 * self.dt_s).filter(|mark| mark.tick < tick)
    }

    /// Time goes on: where the robot is at this tick, what it has driven, and how many goals it has reached.
    pub(crate) fn pass(&mut self, tick: u64, position: Point2<f64>, path_m: f64, goals_done: u32) {
        if self.marks.is_empty() || tick.is_multiple_of(self.every_ticks) {
            if self.marks.len() == self.capacity {
                self.marks.pop_front();
            }
            self.marks.push_back(Mark { tick, position, path_m, goals_done, reversals: self.reversals });
        }
    }

    /// Whether the robot, which has not arrived, gets nowhere; `remaining_m` says how long the shortest way from a place to
    /// its goal is. Before it was in the world for a whole window, what there is counts.
    pub(crate) fn stall(
        &self,
        tick: u64,
        position: Point2<f64>,
        path_m: f64,
        goals_done: u32,
        scale: Scale,
        remaining_m: &mut dyn FnMut(Point2<f64>) -> f64,
    ) -> Option<Stall> {
        let since = |window_s: f64| self.since(tick, window_s);
        let could_m = |from: &Mark| SHARE * scale.speed_mps * (tick - from.tick) as f64 * self.dt_s;
        let recent = since(STANDING_S)?;
        let stands = path_m - recent.path_m < could_m(recent);
        let from = if stands { recent } else { since(DRIVING_S)? };
        let (driven_m, moved_m) = (path_m - from.path_m, (position - from.position).norm());
        if goals_done > from.goals_done || !stands && moved_m >= 0.5 * driven_m {
            return None;
        }
        let gained_m = remaining_m(from.position) - remaining_m(position);
        // A robot without speed gains nothing, and that is no progress.
        if gained_m > 0.0 && gained_m >= scale.size_m.min(could_m(from)).max(SHARE * driven_m) {
            return None;
        }
        let reversals_max = ((tick - from.tick) as f64 * self.dt_s / REVERSAL_S).max(2.0);
        Some(match stands {
            true => Stall::Deadlocked,
            false if f64::from(self.reversals - from.reversals) >= reversals_max => Stall::Oscillating,
            false => Stall::Livelocked,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: Scale = Scale { speed_mps: 1.0, size_m: 0.25 };
    const GOAL: f64 = 50.0;

    /// What is said of a robot whose goal is 50 m up the x axis when it drives at these velocities, by time, at 20 Hz.
    fn judged(duration_s: f64, scale: Scale, velocity: impl Fn(f64) -> [f64; 2]) -> Option<Stall> {
        let dt_s = 0.05;
        let (mut trail, mut position, mut path_m) = (Trail::new(dt_s, scale.size_m), Point2::origin(), 0.0);
        let ticks = (duration_s / dt_s).round() as u64;
        trail.pass(0, position, 0.0, 0);
        for tick in 1..=ticks {
            let v = Vector2::from(velocity(tick as f64 * dt_s));
            let from = position;
            position += v * dt_s;
            path_m += v.norm() * dt_s;
            trail.drove([from, position]);
            trail.pass(tick, position, path_m, 0);
        }
        let goal = Point2::new(GOAL, 0.0);
        trail.stall(ticks, position, path_m, 0, scale, &mut |p| (goal - p).norm())
    }

    #[test]
    fn who_gets_on_is_not_stalled() {
        assert_eq!(judged(20.0, SCALE, |_| [1.0, 0.0]), None);
        // Slowly, as its planner wants it, although the body could go much faster.
        assert_eq!(judged(20.0, Scale { speed_mps: 25.0, ..SCALE }, |_| [1.0, 0.0]), None);
        // A slow body at its greatest speed.
        assert_eq!(judged(20.0, Scale { speed_mps: 0.01, ..SCALE }, |_| [0.01, 0.0]), None);
        // Away from the goal, but far: the long way round.
        assert_eq!(judged(40.0, SCALE, |_| [-1.0, 0.3]), None);
        // A zigzag that gets on.
        assert_eq!(judged(40.0, SCALE, |t| [0.3, if (t as u64).is_multiple_of(2) { 0.9 } else { -0.9 }]), None);
        // Nothing is known of a robot that has just come.
        assert_eq!(judged(0.0, SCALE, |_| [0.0, 0.0]), None);
    }

    #[test]
    fn standing_is_a_deadlock() {
        assert_eq!(judged(20.0, SCALE, |t| [if t < 10.0 { 1.0 } else { 0.0 }, 0.0]), Some(Stall::Deadlocked));
        assert_eq!(judged(3.0, SCALE, |_| [0.0, 0.0]), Some(Stall::Deadlocked));
        // Creeping and trembling are standing.
        assert_eq!(judged(20.0, SCALE, |_| [0.001, 0.0]), Some(Stall::Deadlocked));
        let tremble = |t: f64| [0.0, if ((t * 20.0) as u64).is_multiple_of(2) { 0.04 } else { -0.04 }];
        assert_eq!(judged(20.0, SCALE, tremble), Some(Stall::Deadlocked));
        assert_eq!(judged(20.0, Scale { speed_mps: 0.0, size_m: 0.0 }, |_| [0.0, 0.0]), None, "it could not do more");
    }

    #[test]
    fn driving_without_progress_is_a_livelock() {
        // Round and round, to and fro in long legs, and a long way that comes back.
        assert_eq!(judged(60.0, SCALE, |t| [t.cos(), t.sin()]), Some(Stall::Livelocked));
        for end_s in [40.0, 43.0, 47.0, 51.0, 55.0] {
            let legs = |t: f64| [0.0, if (t as u64 / 5).is_multiple_of(2) { 1.0 } else { -1.0 }];
            assert_eq!(judged(end_s, SCALE, legs), Some(Stall::Livelocked), "{end_s} s");
        }
    }

    #[test]
    fn reversing_all_the_time_is_an_oscillation() {
        for reversals_a_tick in [1.0, 3.0, 20.0] {
            let jitter =
                |t: f64| [if ((t * 20.0 / reversals_a_tick) as u64).is_multiple_of(2) { 0.8 } else { -0.8 }, 0.1];
            let slow = |t: f64| [jitter(t)[0], 0.0];
            assert_eq!(judged(40.0, SCALE, slow), Some(Stall::Oscillating), "every {reversals_a_tick} ticks");
        }
    }

    /// Reversals of a robot with a body of this radius that goes straight from place to place, so far in a tick.
    fn reversals(radius_m: f64, tick_m: f64, places: &[[f64; 2]]) -> u32 {
        let mut trail = Trail::new(0.1, radius_m);
        for ends in places.windows(2) {
            let [from, to] = [Point2::from(ends[0]), Point2::from(ends[1])];
            let ticks = ((to - from).norm() / tick_m).round().max(1.0) as u32;
            let at = |tick: u32| from + (to - from) * (f64::from(tick) / f64::from(ticks));
            (0..ticks).for_each(|tick| trail.drove([at(tick), at(tick + 1)]));
        }
        trail.reversals()
    }

    #[test]
    fn reversals_are_counted_on_the_path() {
        let legs = [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 0.0]];
        for tick_m in [0.001, 0.004, 0.02, 0.1, 1.0] {
            assert_eq!(reversals(0.25, tick_m, &legs), 3, "ticks of {tick_m} m");
            assert_eq!(
                reversals(2.5, 10.0 * tick_m, &legs.map(|at| at.map(|x| 10.0 * x))),
                3,
                "a body ten times as large"
            );
        }
        // A pause on the way back is none, nor is one before.
        assert_eq!(
            reversals(0.25, 0.1, &[legs[0], legs[0], legs[1], legs[1], legs[1], [0.5, 0.0], [0.5, 0.0], legs[2]]),
            1
        );
        // Corners of up to 90 degrees are none, sharper ones are.
        let corner = |x: f64| reversals(0.25, 0.1, &[[0.0, 0.0], [1.0, 0.0], [1.0 + x, 1.0]]);
        assert_eq!([0.5, 0.0, -0.1].map(corner), [0, 0, 1]);
        // Nor is a turn round on a curve.
        let circle: Vec<[f64; 2]> = (0..200).map(|i| 0.1 * f64::from(i)).map(|a| [a.cos(), a.sin()]).collect();
        assert_eq!(reversals(0.25, 0.1, &circle), 0);
        assert_eq!(reversals(0.25, 0.1, &[[3.0, 3.0]]), 0);
    }

    #[test]
    fn a_tremble_is_no_reversal() {
        let tremble = |radius_m: f64, by_m: f64| {
            let places: Vec<[f64; 2]> = (0..=100).map(|i| [if i % 2 == 0 { 0.0 } else { by_m }, 0.0]).collect();
            reversals(radius_m, 1.0, &places)
        };
        // A hundredth of the radius is the least that counts.
        assert_eq!([0.0024, 0.0025, 0.003, 0.3].map(|by_m| tremble(0.25, by_m)), [0, 99, 99, 99]);
        assert_eq!([0.0024, 0.0025].map(|by_m| tremble(0.5, by_m)), [0, 0]);
        assert_eq!(tremble(0.0, 0.0), 0);
    }

    /// A step that takes several ticks is under way when the checkpoint is made.
    #[test]
    fn a_trail_goes_on_from_a_checkpoint_in_the_middle_of_a_step() {
        let run = |saved_every: usize| {
            let mut trail = Trail::new(0.1, 0.25);
            // 1.5 mm a tick, 6 mm there and back.
            let x = |tick: usize| 0.0015 * [0, 1, 2, 3, 4, 3, 2, 1][tick % 8] as f64;
            for tick in 0..80 {
                trail.drove([Point2::new(x(tick), 0.0), Point2::new(x(tick + 1), 0.0)]);
                trail.pass(tick as u64, Point2::new(x(tick + 1), 0.0), 0.0015 * tick as f64, 0);
                if tick % saved_every == 0 {
                    trail = protocol::codec::decode(&protocol::codec::encode(&trail).unwrap()).unwrap();
                }
            }
            (trail.reversals(), trail.speed_mps(79, 0.12))
        };
        let whole = run(100);
        assert!(whole.0 >= 18, "{whole:?}");
        assert_eq!([1, 2, 3, 5].map(run), [whole; 4]);
    }

    #[test]
    fn the_speed_at_the_end_is_that_of_ten_seconds_or_of_what_there_is() {
        let speed = |ticks: u64, driven_until: u64| {
            let (mut trail, mut x) = (Trail::new(0.05, 0.25), 0.0);
            for tick in 0..=ticks {
                x += if tick > 0 && tick <= driven_until { 0.05 } else { 0.0 };
                trail.pass(tick, Point2::new(x, 0.0), x, 0);
            }
            trail.speed_mps(ticks, x).map(|speed| (1e9 * speed).round() / 1e9)
        };
        // 20 ticks are a second, and a driven one is 5 cm: 15 s of driving, then a rest.
        assert_eq!(
            [300, 400, 494, 500, 600].map(|ticks| speed(ticks, 300)),
            [
                Some(1.0),
                Some(0.5),
                Some(0.025_125_628), // since the first of the marks, four a second, that is within ten seconds: 0.25 m in 9.95 s
                Some(0.0),
                Some(0.0)
            ]
        );
        assert_eq!([0, 1, 40].map(|ticks| speed(ticks, 20)), [None, Some(1.0), Some(0.5)]);
    }

    #[test]
    fn a_goal_reached_in_the_window_is_progress() {
        let mut trail = Trail::new(0.1, 0.25);
        for tick in 0..=100 {
            trail.pass(tick, Point2::origin(), 0.0, u32::from(tick > 50));
        }
        assert_eq!(trail.stall(100, Point2::origin(), 0.0, 1, SCALE, &mut |_| 5.0), None);
    }
}
