//! How obstacles and goals move: functions of time alone, evaluated at the ticks in order. The world and the papers' own
//! runs (`reproduce`) both move things by it.

use crate::random::Stream;
use crate::scenario::{AtEnd, Bounds, Motion};
use nalgebra::{Point2, Vector2};

/// A point in motion.
#[derive(Clone)]
pub struct Mover {
    /// Where the point is in the scenario.
    start: Point2<f64>,
    course: Course,
}

#[derive(Clone)]
enum Course {
    Orbit { center: Point2<f64>, radius_m: f64, omega_radps: f64, phase_rad: f64 },
    Bounce { velocity: Vector2<f64>, within: Bounds },
    Walk(Box<Walk>),
    Waypoints(Waypoints),
}

/// A random walk is a bounce whose velocity is drawn anew at every turn.
#[derive(Clone)]
struct Walk {
    stream: Stream,
    speed_mps: f64,
    turn_every_s: f64,
    within: Bounds,
    leg: u64,
    from: Point2<f64>,
    velocity: Vector2<f64>,
}

#[derive(Clone)]
struct Waypoints {
    points: Vec<Point2<f64>>,
    speed_mps: f64,
    then: AtEnd,
    length_m: f64,
}

impl Mover {
    /// A point that starts at `start`. `stream` is drawn from by random walks only.
    pub fn new(motion: &Motion, start: Point2<f64>, stream: impl FnOnce() -> Stream) -> Mover {
        let course = match motion.clone() {
            Motion::Orbit { center, radius_m, omega_radps, phase_rad } => {
                Course::Orbit { center, radius_m, omega_radps, phase_rad }
            }
            Motion::Bounce { velocity_mps, within } => Course::Bounce { velocity: velocity_mps.into(), within },
            Motion::RandomWalk { speed_mps, turn_every_s, within } => {
                let mut walk = Walk {
                    stream: stream(),
                    speed_mps,
                    // Turns without time between them would never end.
                    turn_every_s: turn_every_s.max(1e-3),
                    within,
                    leg: 0,
                    from: start,
                    velocity: Vector2::zeros(),
                };
                walk.turn();
                Course::Walk(Box::new(walk))
            }
            Motion::Waypoints { mut points, speed_mps, then } => {
                if points.is_empty() {
                    points.push(start);
                }
                if then == AtEnd::Loop {
                    points.push(points[0]);
                }
                let length_m = points.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
                Course::Waypoints(Waypoints { points, speed_mps, then, length_m })
            }
        };
        Mover { start, course }
    }

    /// Position, m, and velocity, m/s, at `t_s`; times must not fall from call to call.
    ///
    /// The velocity is that of the motion at this instant (analytic, not a difference of positions), so what is
    /// reported just after a reflection points the way that the body will go.
    pub fn at(&mut self, t_s: f64) -> (Point2<f64>, Vector2<f64>) {
        match &mut self.course {
            Course::Orbit { center, radius_m, omega_radps, phase_rad } => {
                let (sin, cos) = (*omega_radps * t_s + *phase_rad).sin_cos();
                let speed = *radius_m * *omega_radps;
                (*center + Vector2::new(cos, sin) * *radius_m, Vector2::new(-sin, cos) * speed)
            }
            Course::Bounce { velocity, within } => bounce(self.start, *velocity, within, t_s),
            Course::Walk(walk) => walk.at(t_s),
            Course::Waypoints(waypoints) => waypoints.at(t_s),
        }
    }
}

impl Walk {
    fn at(&mut self, t_s: f64) -> (Point2<f64>, Vector2<f64>) {
        while (self.leg + 1) as f64 * self.turn_every_s <= t_s {
            self.from = bounce(self.from, self.velocity, &self.within, self.turn_every_s).0;
            self.leg += 1;
            self.turn();
        }
        bounce(self.from, self.velocity, &self.within, t_s - self.leg as f64 * self.turn_every_s)
    }

    fn turn(&mut self) {
        let (sin, cos) = self.stream.between(0.0, std::f64::consts::TAU).sin_cos();
        self.velocity = Vector2::new(cos, sin) * self.speed_mps;
    }
}

impl Waypoints {
    fn at(&self, t_s: f64) -> (Point2<f64>, Vector2<f64>) {
        let driven = self.speed_mps * t_s;
        let (along, sign) = match self.then {
            AtEnd::Loop => (if self.length_m > 0.0 { driven.rem_euclid(self.length_m) } else { 0.0 }, 1.0),
            AtEnd::PingPong => fold(driven, [0.0, self.length_m]),
            AtEnd::Stop => (driven.min(self.length_m), if driven < self.length_m { 1.0 } else { 0.0 }),
        };
        let mut left = along;
        for leg in self.points.windows(2) {
            let offset = leg[1] - leg[0];
            let length = offset.norm();
            if left <= length && length > 0.0 {
                return (leg[0] + offset * (left / length), offset * (sign * self.speed_mps / length));
            }
            left -= length;
        }
        (self.points[self.points.len() - 1], Vector2::zeros())
    }
}

fn bounce(from: Point2<f64>, velocity: Vector2<f64>, within: &Bounds, t_s: f64) -> (Point2<f64>, Vector2<f64>) {
    let (x, x_sign) = fold(from.x + velocity.x * t_s, within.x_m);
    let (y, y_sign) = fold(from.y + velocity.y * t_s, within.y_m);
    (Point2::new(x, y), Vector2::new(velocity.x * x_sign, velocity.y * y_sign))
}

/// A number line folded to and fro between two values: the place on it, and whether one runs up (1) or down (-1).
fn fold(x: f64, [low, high]: [f64; 2]) -> (f64, f64) {
    let width = high - low;
    if width <= 0.0 {
        return (low, 0.0);
    }
    let phase = (x - low).rem_euclid(2.0 * width);
    if phase < width { (low + phase, 1.0) } else { ((high - (phase - width)).max(low), -1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 0.02;

    fn mover(motion: Motion) -> Mover {
        Mover::new(&motion, Point2::new(0.5, 0.25), || Stream::new(7, 0, 0, "obstacle-walk"))
    }

    /// Every reported velocity must be what the positions show, away from the kinks.
    fn check_velocity(motion: Motion, kinks: usize) {
        let mut mover = mover(motion);
        let (mut wrong, mut before) = (0, mover.at(0.0));
        for tick in 1..2000 {
            let now = mover.at(f64::from(tick) * DT_S);
            let mean = (now.0 - before.0) / DT_S;
            wrong += usize::from((mean - 0.5 * (now.1 + before.1)).norm() > 1e-3);
            before = now;
        }
        assert!(wrong <= kinks, "{wrong} of 2000 ticks, {kinks} kinks");
    }

    #[test]
    fn an_orbit_has_its_period_and_radius() {
        let center = Point2::new(1.0, 2.0);
        let motion = || Motion::Orbit { center, radius_m: 3.0, omega_radps: 0.5, phase_rad: 1.0 };
        let mut orbit = mover(motion());
        let (start, _) = orbit.at(0.0);
        assert!((start - (center + Vector2::new(1f64.cos(), 1f64.sin()) * 3.0)).norm() < 1e-12);
        let (later, _) = orbit.at(std::f64::consts::TAU / 0.5);
        assert!((later - start).norm() < 1e-9);
        check_velocity(motion(), 0);
    }

    #[test]
    fn a_bounce_and_a_walk_stay_inside_and_keep_their_speed() {
        let within = Bounds { x_m: [0.0, 2.0], y_m: [-1.0, 1.0] };
        let bounce = || Motion::Bounce { velocity_mps: [0.7, -1.1], within };
        let walk = || Motion::RandomWalk { speed_mps: 0.9, turn_every_s: 0.5, within };
        for (motion, speed) in [(bounce(), 0.7f64.hypot(1.1)), (walk(), 0.9)] {
            let mut mover = mover(motion);
            for tick in 0..5000 {
                let (p, v) = mover.at(f64::from(tick) * DT_S);
                assert!((0.0..=2.0).contains(&p.x) && (-1.0..=1.0).contains(&p.y), "{p}");
                assert!((v.norm() - speed).abs() < 1e-12);
            }
        }
        check_velocity(bounce(), 120);
        check_velocity(walk(), 200);
    }

    #[test]
    fn a_bounce_comes_back_after_its_period() {
        let within = Bounds { x_m: [0.0, 2.0], y_m: [0.0, 1.0] };
        let mut bounce = mover(Motion::Bounce { velocity_mps: [1.0, 0.5], within });
        assert_eq!(bounce.at(1.5).0.x, 2.0, "at the edge");
        assert_eq!(bounce.at(2.5).0.x, 1.0, "on the way back");
        let (p, v) = bounce.at(4.0);
        assert!((p - Point2::new(0.5, 0.25)).norm() < 1e-12 && v == Vector2::new(1.0, 0.5));
    }

    #[test]
    fn a_walk_depends_on_its_stream_and_on_nothing_else() {
        let within = Bounds { x_m: [0.0, 9.0], y_m: [0.0, 9.0] };
        let motion = Motion::RandomWalk { speed_mps: 1.0, turn_every_s: 0.3, within };
        let mut every_tick = mover(motion.clone());
        (0..1000).for_each(|tick| _ = every_tick.at(f64::from(tick) * DT_S));
        assert_eq!(every_tick.at(20.0), mover(motion.clone()).at(20.0), "however often it was asked");
        let mut other = Mover::new(&motion, Point2::new(0.5, 0.25), || Stream::new(7, 1, 0, "obstacle-walk"));
        assert_ne!(every_tick.at(20.0), other.at(20.0));
    }

    #[test]
    fn waypoints_end_as_they_are_told() {
        let points = vec![Point2::new(0.0, 0.0), Point2::new(2.0, 0.0), Point2::new(2.0, 1.0)];
        let at = |then, t| mover(Motion::Waypoints { points: points.clone(), speed_mps: 1.0, then }).at(t);
        for then in [AtEnd::Loop, AtEnd::PingPong, AtEnd::Stop] {
            assert_eq!(at(then, 0.0), (Point2::new(0.0, 0.0), Vector2::new(1.0, 0.0)));
            assert_eq!(at(then, 2.5), (Point2::new(2.0, 0.5), Vector2::new(0.0, 1.0)));
        }
        assert_eq!(at(AtEnd::Stop, 9.0), (Point2::new(2.0, 1.0), Vector2::zeros()));
        assert_eq!(at(AtEnd::PingPong, 4.0), (Point2::new(1.0 + 1.0, 0.0), Vector2::new(-1.0, 0.0)));
        assert_eq!(at(AtEnd::PingPong, 7.0).0, Point2::new(1.0, 0.0));
        let (p, _) = at(AtEnd::Loop, 3.0 + 5f64.sqrt() + 0.5);
        assert!((p - Point2::new(0.5, 0.0)).norm() < 1e-12);
    }
}
