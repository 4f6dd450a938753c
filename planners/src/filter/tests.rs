//! Robots that want to hit each other, in a small world of their own: whatever is lost, late or missed, no two of them touch.

use super::border::{WORDS_MAX, Word};
use super::*;
use geometry::{Capsule, swept_distance};
use model::random::Stream;
use proptest::prelude::*;

/// What is against them.
#[derive(Clone, Copy, Debug)]
struct Trouble {
    timing: Timing,
    /// Share of words that get lost.
    loss: f64,
    /// Ticks that a word takes at most, beyond the one that it always takes.
    delay_ticks: u64,
    /// Share of ticks in which a robot does not plan, or its command comes a tick late.
    missed: f64,
    sees: bool,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Point,
    SlowPoint,
    Unicycle,
    SlowUnicycle,
    Wheels,
}

/// Everything that a robot says in a tick.
#[derive(Clone)]
struct Said {
    told: Told,
    words: Vec<(u32, u32, Word)>,
}

struct Robot {
    filter: Filter,
    body: Body,
    pose: Pose,
    /// The command that acts, and the tick for which it was given.
    command: Option<(u64, Drive)>,
    /// One that came after the world had looked.
    late: Option<(u64, Drive)>,
    /// What is on its way to it: when it comes, from whom, what.
    coming: Vec<(u64, usize, Said)>,
    heard: Vec<Option<Said>>,
    goal: Point2<f64>,
    moved_m: f64,
}

struct Town {
    robots: Vec<Robot>,
    walls: Vec<Obstacle>,
    trouble: Trouble,
    draws: Stream,
    tick: u64,
    changed: usize,
}

const DT_S: f64 = 0.1;
const UNLIMITED: f64 = f64::INFINITY;

fn body(robot: u32, kind: Kind, radius_m: f64) -> Body {
    let free = Limits {
        speed_mps_max: 1.0,
        reverse_mps_max: 0.5,
        turning_radius_m_min: 0.0,
        turn_radps_max: 2.0,
        accel_mps2_max: UNLIMITED,
        turn_accel_radps2_max: UNLIMITED,
    };
    let slow = Limits { accel_mps2_max: 0.8, turn_accel_radps2_max: 3.0, ..free };
    let wheels = Wheels {
        radius_m: 0.05,
        track_m: 0.2,
        speed_radps_max: 16.0,
        accel_radps2_max: 24.0,
        torque_nm_max: UNLIMITED,
    };
    let (kind, limits, wheels) = match kind {
        Kind::Point => (BodyKind::Point, free, None),
        Kind::SlowPoint => (BodyKind::Point, slow, None),
        Kind::Unicycle => (BodyKind::Unicycle, free, None),
        Kind::SlowUnicycle => (BodyKind::Unicycle, slow, None),
        Kind::Wheels => (BodyKind::DiffDrive, wheels.limits(), Some(wheels)),
    };
    Body { robot, kind, limits, wheels, radius_m, dt_s: DT_S }
}

/// What is known of a robot that stands here and has said nothing.
fn told(body: &Body, tick: u64, at: Point2<f64>) -> Told {
    Told {
        robot: body.robot,
        incarnation: 0,
        is_heard: false,
        tick,
        at,
        next: None,
        seen: None,
        velocity: Vector2::zeros(),
        radius_m: body.radius_m,
        speed_mps_max: body.limits.speed_mps_max,
        brake_m: body.brake_m(),
        promise: None,
        word: None,
    }
}

impl Town {
    /// Robots of these kinds on a lattice, so that they have a little room, inside a square of walls.
    fn new(kinds: &[Kind], trouble: Trouble, seed: u64) -> Town {
        let mut draws = Stream::new(seed, 0, 0, "town");
        let columns = (kinds.len() as f64).sqrt().ceil() as usize;
        let spacing_m = draws.between(0.55, 1.2);
        let bodies: Vec<(Body, Point2<f64>)> = kinds
            .iter()
            .enumerate()
            .map(|(slot, kind)| {
                let at = Point2::new((slot % columns) as f64, (slot / columns) as f64) * spacing_m;
                (body(slot as u32, *kind, draws.between(0.1, 0.25)), at)
            })
            .collect();
        // At first everybody is seen where he stands.
        let heard: Vec<Option<Said>> =
            bodies.iter().map(|(body, at)| Some(Said { told: told(body, 0, *at), words: Vec::new() })).collect();
        let robots: Vec<Robot> = bodies
            .iter()
            .map(|(body, at)| Robot {
                filter: Filter::new(*body, trouble.timing),
                body: *body,
                pose: Pose::resting(*at, draws.between(-3.0, 3.0)),
                command: None,
                late: None,
                coming: Vec::new(),
                heard: heard.clone(),
                goal: *at,
                moved_m: 0.0,
            })
            .collect();
        let (low, high) = (-1.0, columns as f64 * spacing_m + 0.5);
        let corners = [[low, low], [high, low], [high, high], [low, high]].map(Point2::from);
        let walls = (0..4).map(|side| Obstacle {
            id: side as u32,
            shape: Capsule::segment(corners[side], corners[(side + 1) % 4]),
            velocity: Vector2::zeros(),
        });
        Town { robots, walls: walls.collect(), trouble, draws, tick: 0, changed: 0 }
    }

    fn told(&self, slot: usize) -> Vec<Told> {
        let me = &self.robots[slot];
        let heard = me.heard.iter().enumerate().filter(|(other, _)| *other != slot);
        heard
            .filter_map(|(other, said)| {
                let said = said.as_ref()?;
                let mut told = said.told;
                told.word = said.words.iter().find(|(to, _, _)| *to == slot as u32).map(|(_, _, word)| *word);
                if self.trouble.sees {
                    (told.seen, told.velocity) =
                        (Some(self.robots[other].pose.position), self.robots[other].pose.velocity);
                }
                Some(told)
            })
            .collect()
    }

    /// What a robot wants: mostly to hit the nearest one, sometimes a wall, sometimes anything.
    fn wants(&mut self, slot: usize) -> Drive {
        let at = self.robots[slot].pose.position;
        if self.draws.unit() < 0.05 {
            let [x, y] = [(); 2].map(|()| self.draws.between(-3.0, 6.0));
            self.robots[slot].goal = Point2::new(x, y);
        }
        let others = self.robots.iter().enumerate().filter(|(other, _)| *other != slot);
        let nearest =
            others.map(|(_, robot)| robot.pose.position).min_by(|p, q| (p - at).norm().total_cmp(&(q - at).norm()));
        let aim =
            if self.draws.unit() < 0.6 { nearest.unwrap_or(self.robots[slot].goal) } else { self.robots[slot].goal };
        let way = (aim - at).try_normalize(1e-9).unwrap_or(Vector2::x());
        let Robot { body, pose, .. } = &self.robots[slot];
        match body.kind {
            BodyKind::Point => Drive::Velocity(way * 1.0),
            _ => {
                let error = geometry::wrap(geometry::heading(way) - pose.yaw_rad);
                let back = self.draws.unit() < 0.1;
                Drive::Twist { speed_mps: if back { -0.5 } else { 1.0 }, turn_radps: 3.0 * error }.within(&body.limits)
            }
        }
    }

    fn step(&mut self) -> Result<(), TestCaseError> {
        let tick = self.tick;
        let count = self.robots.len();
        let mut spoken: Vec<(usize, Said)> = Vec::new();
        for slot in 0..count {
            let robot = &mut self.robots[slot];
            let mut place = 0;
            while place < robot.coming.len() {
                if robot.coming[place].0 > tick {
                    place += 1;
                    continue;
                }
                let (_, from, said) = robot.coming.swap_remove(place);
                if robot.heard[from]
                    .as_ref()
                    .is_none_or(|known| known.told.promise.is_none() || known.told.tick < said.told.tick)
                {
                    robot.heard[from] = Some(said);
                }
            }
            let is_loose = self.trouble.timing != Timing::Exact;
            if is_loose && self.draws.unit() < 0.5 * self.trouble.missed {
                continue;
            }
            let all_told = self.told(slot);
            let wanted = self.wants(slot);
            let is_late = is_loose && self.draws.unit() < 0.5 * self.trouble.missed;
            let walls = self.walls.clone();
            let bodies: Vec<Obstacle> = all_told
                .iter()
                .filter(|told| !told.is_heard)
                .filter_map(|told| {
                    let shape = Capsule::disc(told.seen?, told.radius_m);
                    Some(Obstacle { id: 1000 + told.robot, shape, velocity: told.velocity })
                })
                .collect();
            let robot = &mut self.robots[slot];
            let Robot { filter, body, pose, .. } = robot;
            filter.draw(tick, pose, &all_told, &walls, &bodies);
            let drive = filter.keep(tick, pose, wanted);
            self.changed += usize::from(filter.change(wanted, drive) > 0.0);
            let mut next = *pose;
            advance(body, &mut next, drive);
            let promise = filter.promise(tick, pose, &next);
            let words: Vec<_> = filter.words().collect();
            prop_assert!(words.len() <= WORDS_MAX);
            let told = Told {
                next: Some(next.position),
                velocity: pose.velocity,
                is_heard: true,
                promise: Some(promise),
                ..told(body, tick, pose.position)
            };
            spoken.push((slot, Said { told, words }));
            if is_late {
                robot.late = Some((tick, drive));
            } else {
                robot.command = Some((tick, drive));
            }
        }
        for (from, said) in spoken {
            for to in (0..count).filter(|to| *to != from) {
                if self.draws.unit() >= self.trouble.loss {
                    let delay = (self.draws.unit() * (self.trouble.delay_ticks + 1) as f64) as u64;
                    self.robots[to].coming.push((tick + 1 + delay, from, said.clone()));
                }
            }
        }
        let hold = u64::from(self.robots[0].filter.hold_ticks());
        let before: Vec<Pose> = self.robots.iter().map(|robot| robot.pose).collect();
        for robot in &mut self.robots {
            match robot.command.filter(|(given, _)| tick - given < hold) {
                Some((_, drive)) => advance(&robot.body, &mut robot.pose, drive),
                None => robot.pose.halt(),
            }
            robot.command = robot.late.take().or(robot.command);
        }
        for (robot, before) in self.robots.iter_mut().zip(&before) {
            robot.moved_m += (robot.pose.position - before.position).norm();
        }
        self.tick += 1;
        self.check(&before)
    }

    /// No robot touched anything at any instant of the tick.
    fn check(&self, before: &[Pose]) -> Result<(), TestCaseError> {
        const PARTS: u32 = 6;
        let along = |slot: usize, part: u32| {
            let after = &self.robots[slot].pose;
            if part == 0 {
                return before[slot].position;
            }
            if part == PARTS {
                return after.position;
            }
            // The velocities of a tick are those at its end.
            let mut pose = Pose { speed_mps: after.speed_mps, turn_radps: after.turn_radps, ..before[slot] };
            let free = Limits {
                speed_mps_max: UNLIMITED,
                reverse_mps_max: UNLIMITED,
                turning_radius_m_min: 0.0,
                turn_radps_max: UNLIMITED,
                accel_mps2_max: UNLIMITED,
                turn_accel_radps2_max: UNLIMITED,
            };
            let drive = match self.robots[slot].body.kind {
                BodyKind::Point => Drive::Velocity(after.velocity),
                _ => Drive::Twist { speed_mps: after.speed_mps, turn_radps: after.turn_radps },
            };
            pose.advance(drive, &free, DT_S * f64::from(part) / f64::from(PARTS));
            pose.position
        };
        let ways: Vec<Vec<Point2<f64>>> =
            (0..self.robots.len()).map(|slot| (0..=PARTS).map(|part| along(slot, part)).collect()).collect();
        for (slot, way) in ways.iter().enumerate() {
            let radius_m = self.robots[slot].body.radius_m;
            for (other, their_way) in ways.iter().enumerate().skip(slot + 1) {
                let least_m = radius_m + self.robots[other].body.radius_m;
                for (mine, theirs) in way.windows(2).zip(their_way.windows(2)) {
                    let closest_m = swept_distance(mine[0], mine[1], theirs[0], theirs[1]);
                    prop_assert!(
                        closest_m >= least_m - 1e-9,
                        "tick {}: {slot} and {other} overlap by {} m",
                        self.tick - 1,
                        least_m - closest_m
                    );
                }
            }
            for wall in &self.walls {
                for point in way {
                    let gap_m = wall.shape.distance(*point) - radius_m;
                    prop_assert!(gap_m >= -1e-9, "tick {}: {slot} is {} m in a wall", self.tick - 1, -gap_m);
                }
            }
        }
        Ok(())
    }
}

fn advance(body: &Body, pose: &mut Pose, drive: Drive) {
    match body.wheels {
        Some(wheels) => pose.advance_on(&wheels, drive, &body.limits, body.dt_s),
        None => pose.advance(drive, &body.limits, body.dt_s),
    }
}

fn kind() -> impl Strategy<Value = Kind> {
    prop_oneof![
        Just(Kind::Point),
        Just(Kind::SlowPoint),
        Just(Kind::Unicycle),
        Just(Kind::SlowUnicycle),
        Just(Kind::Wheels)
    ]
}

fn timing() -> impl Strategy<Value = Timing> {
    prop_oneof![Just(Timing::Exact), (1..4u32).prop_map(|hold_ticks| Timing::Loose { hold_ticks })]
}

/// How many towns: `SHOAL_FILTER_TOWNS` for a long run.
fn towns() -> u32 {
    #[expect(clippy::disallowed_methods, reason = "a longer run on request")]
    std::env::var("SHOAL_FILTER_TOWNS").ok().and_then(|number| number.parse().ok()).unwrap_or(300)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(towns()))]

    #[test]
    fn nobody_touches_anybody(
        kinds in prop::collection::vec(kind(), 2..8), timing in timing(), loss in prop_oneof![Just(0.0), 0.0..0.9f64],
        delay_ticks in 0..5u64, missed in 0.0..0.5f64, sees: bool, seed: u64
    ) {
        let mut town = Town::new(&kinds, Trouble { timing, loss, delay_ticks, missed, sees }, seed);
        for _ in 0..120 {
            town.step()?;
        }
    }
}

/// A world that takes the place of one that died may have lost a few ticks: the last command then acts as long as the world counts.
#[test]
fn a_command_of_a_tick_that_comes_again_is_reckoned_with() {
    let mut filter = Filter::new(body(0, Kind::Point, 0.2), Timing::Loose { hold_ticks: 2 });
    let pose = Pose::resting(Point2::origin(), 0.0);
    let wall = |x: f64| {
        let shape = Capsule::segment([x, -9.0].into(), [x, 9.0].into());
        [Obstacle { id: 0, shape, velocity: Vector2::zeros() }]
    };
    filter.draw(10, &pose, &[], &wall(9.0), &[]);
    assert_eq!(filter.keep(10, &pose, Drive::Velocity(Vector2::x())), Drive::Velocity(Vector2::x()));
    // In tick 8 that command may act for four ticks: 0.4 m. What is left of the gap is what a new one may use.
    let speed_mps = |filter: &mut Filter, x: f64| {
        filter.draw(8, &pose, &[], &wall(x), &[]);
        assert_eq!(filter.still, Some((Drive::Velocity(Vector2::x()), 4)));
        filter.allowed.iter().map(|plane| -plane.excess(Vector2::zeros())).fold(1.0, f64::min)
    };
    assert_eq!([0.45, 0.39].map(|gap_m| speed_mps(&mut filter, 0.2 + gap_m)), [1.0, 0.0]);
    filter.draw(12, &pose, &[], &wall(0.3), &[]);
    assert_eq!(filter.still, None, "it has ended");
}

/// What the filter is for is to let a fleet move. How far robots get that only want to hit each other, as a share of what they
/// drive without trouble.
#[test]
fn they_go_on_moving() {
    let moved = |kind: Kind, trouble: Trouble| {
        let mut town = Town::new(&[kind; 4], trouble, 7);
        for _ in 0..300 {
            town.step().unwrap();
        }
        assert!(town.changed > 100, "a filter that changes nothing is not tried");
        town.robots.iter().map(|robot| robot.moved_m).sum::<f64>()
    };
    let none = Trouble { timing: Timing::Exact, loss: 0.0, delay_ticks: 0, missed: 0.0, sees: false };
    for kind in [Kind::Point, Kind::SlowPoint, Kind::Unicycle, Kind::SlowUnicycle, Kind::Wheels] {
        let best_m = moved(kind, none);
        let loose = Trouble { timing: Timing::Loose { hold_ticks: 1 }, ..none };
        for (name, trouble, least) in [
            ("loose", loose, 0.4),
            ("half lost", Trouble { loss: 0.5, ..loose }, 0.4),
            ("three ticks late", Trouble { delay_ticks: 3, ..loose }, 0.4),
            ("real time", Trouble { timing: Timing::Loose { hold_ticks: 2 }, missed: 0.1, ..loose }, 0.4),
        ] {
            let share = moved(kind, trouble) / best_m;
            assert!(share > least, "{kind:?} {name}: {share} of {best_m} m");
        }
    }
}
