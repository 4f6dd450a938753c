//! What can be seen of a run, taken from its record: courses instead of ticks, as few points as the eye needs.

use super::axes::{Span, span};
use super::thin::thin;
use model::{RobotIndex, Shape};
use record::{Body, Ending, Record, RecordError};
use std::collections::HashMap;

/// A line may be off by this share of the picture: a fifth of a pixel.
const TOLERANCE: f64 = 1.0 / 4000.0;
/// An arm is shown at so many instants.
const POSES: usize = 9;
/// So many contacts are marked; a jam can have thousands.
pub(super) const CONTACTS_MAX: usize = 400;

/// More points of one course are not kept.
const POINTS_MAX: usize = 1 << 16;

/// A run as a picture shows it. Lengths in m.
#[derive(Debug)]
pub struct Scene {
    pub(super) title: String,
    pub(super) subtitle: String,
    pub(super) x: Span,
    pub(super) y: Span,
    pub(super) obstacles: Vec<Thing>,
    /// The walls of the map, as lines of corners.
    pub(super) walls: Vec<Vec<[f64; 2]>>,
    pub(super) robots: Vec<Trace>,
    pub(super) contacts: Vec<[f64; 2]>,
    /// Contacts that are not marked.
    pub(super) contacts_more: u64,
}

/// An obstacle.
#[derive(Debug)]
pub(super) struct Thing {
    pub(super) shape: Shape,
    /// Where its reference point went; empty if it stands.
    pub(super) course: Vec<[f64; 2]>,
}

/// A robot.
#[derive(Debug)]
pub(super) struct Trace {
    pub(super) id: String,
    pub(super) radius: f64,
    /// Where it went, from where it entered to where it was last; of an arm, where its tip went.
    pub(super) course: Vec<[f64; 2]>,
    /// Its goals, one after the other.
    pub(super) goals: Vec<[f64; 2]>,
    /// The course of a goal that moves.
    pub(super) goal_course: Vec<[f64; 2]>,
    /// Base, elbow and tip of an arm at some instants, in order.
    pub(super) poses: Vec<[[f64; 2]; 3]>,
    /// What became of it, in a word.
    pub(super) fate: String,
}

/// What is gathered of one body while the frames go by.
#[derive(Default)]
struct Gathered {
    course: Vec<[f64; 2]>,
    last: [f64; 2],
    goals: Vec<[f64; 2]>,
    joints: Vec<[f64; 2]>,
}

/// Adds a point to a course. A long one loses those that make no difference, or else every second one, so that a run of
/// any length takes bounded memory.
fn push(course: &mut Vec<[f64; 2]>, point: [f64; 2], tolerance: f64) {
    if course.len() >= POINTS_MAX {
        *course = thin(course, tolerance);
        if course.len() > POINTS_MAX / 2 {
            *course = course.iter().copied().step_by(2).collect();
        }
    }
    course.push(point);
}

impl Gathered {
    fn see(&mut self, body: &Body, step: f64) {
        let far = |a: [f64; 2], b: [f64; 2], step: f64| (a[0] - b[0]).hypot(a[1] - b[1]) > step;
        if self.course.last().is_none_or(|last| far(*last, body.position_m, step)) {
            push(&mut self.course, body.position_m, 4.0 * step);
        }
        self.last = body.position_m;
        if !body.is_obstacle() && self.goals.last().is_none_or(|last| far(*last, body.goal_m, step)) {
            push(&mut self.goals, body.goal_m, 4.0 * step);
        }
    }

    fn course(&self, tolerance: f64) -> Vec<[f64; 2]> {
        let mut points = self.course.clone();
        if points.last() != Some(&self.last) && !points.is_empty() {
            points.push(self.last);
        }
        thin(&points, tolerance)
    }
}

impl Scene {
    /// Goes through a record, as far as it goes.
    ///
    /// # Errors
    /// When it is damaged, or cannot be read.
    pub fn of(record: &Record) -> Result<Scene, RecordError> {
        let scenario = record.scenario();
        let size = |[low, high]: Span| high - low;
        let extent = size(scenario.bounds.x_m).max(size(scenario.bounds.y_m));
        let tolerance = extent * TOLERANCE;
        let mut robots: HashMap<u32, Gathered> = HashMap::new();
        let mut things: HashMap<u32, Gathered> = HashMap::new();
        let touches = record.events().iter().filter_map(|event| event.kind.touch());
        let contacts: Vec<[f64; 2]> = touches.map(|touch| touch.at_m).take(CONTACTS_MAX).collect();
        let mut frames = record.frames();
        let (mut last_tick, mut contact_count) = (0, 0);
        while let Some(frame) = frames.next()? {
            (last_tick, contact_count) = (frame.tick, frame.contacts);
            for body in frame.bodies {
                let gathered = if body.is_obstacle() { &mut things } else { &mut robots };
                let gathered = gathered.entry(body.index).or_default();
                gathered.see(body, 0.25 * tolerance);
                if !body.is_obstacle() && record.robot(RobotIndex(body.index)).is_some_and(|r| r.arm.is_some()) {
                    push(&mut gathered.joints, body.joints_rad, 1e-3);
                }
            }
        }
        let obstacles = (scenario.obstacles.iter().zip(0..))
            .map(|(obstacle, index)| Thing {
                shape: obstacle.shape.clone(),
                course: things.get(&index).map(|gathered| gathered.course(tolerance)).unwrap_or_default(),
            })
            .collect();
        let robots: Vec<Trace> = (record.robots())
            .filter_map(|(index, robot)| {
                let gathered = robots.get(&index.0)?;
                let moving_goal = robot.goal_motion.is_some();
                Some(Trace {
                    id: robot.id.clone(),
                    radius: robot.radius_m,
                    course: gathered.course(tolerance),
                    goals: if moving_goal {
                        gathered.goals.last().copied().into_iter().collect()
                    } else {
                        gathered.goals.clone()
                    },
                    goal_course: if moving_goal { thin(&gathered.goals, tolerance) } else { Vec::new() },
                    poses: poses(robot, &gathered.joints),
                    fate: fate(record, index),
                })
            })
            .collect();
        let mut scene = Scene {
            title: title(record),
            subtitle: subtitle(record, last_tick, contact_count),
            x: scenario.bounds.x_m,
            y: scenario.bounds.y_m,
            obstacles,
            walls: scenario.walls().map(walls_of).unwrap_or_default(),
            robots,
            contacts_more: contact_count.saturating_sub(contacts.len() as u64),
            contacts,
        };
        scene.frame(extent);
        Ok(scene)
    }

    /// Chooses what part of the plane is shown: everything that there is, and the world's edges where they are near.
    fn frame(&mut self, extent: f64) {
        let corners = self.obstacles.iter().flat_map(|thing| match &thing.shape {
            Shape::Capsule(c) => [c.a, c.b]
                .iter()
                .flat_map(|p| [[p.x - c.radius, p.y - c.radius], [p.x + c.radius, p.y + c.radius]])
                .collect::<Vec<_>>(),
            Shape::Polygon(corners) => corners.iter().map(|p| [p.x, p.y]).collect(),
        });
        let courses = self.obstacles.iter().flat_map(|thing| thing.course.iter().copied());
        let bodies = self.robots.iter().flat_map(|robot| {
            let r = robot.radius;
            let places = robot.course.iter().chain(&robot.goals).chain(&robot.goal_course);
            places.chain(robot.poses.iter().flatten()).flat_map(move |p| [[p[0] - r, p[1] - r], [p[0] + r, p[1] + r]])
        });
        let walls = self.walls.iter().flatten().copied();
        let all: Vec<[f64; 2]> = corners.chain(courses).chain(bodies).chain(walls).collect();
        let room = |found: Option<Span>, bounds: Span| {
            let Some([low, high]) = found else { return bounds };
            let pad = 0.04 * (high - low).max(0.1 * extent).max(0.1);
            // An edge that is near is shown; one that is far would make everything small.
            let near = 0.25 * (high - low);
            let low_edge = if bounds[0] > low - near && bounds[0] < low { bounds[0] } else { low };
            let high_edge = if bounds[1] < high + near && bounds[1] > high { bounds[1] } else { high };
            [low_edge.min(low - pad), high_edge.max(high + pad)]
        };
        self.x = room(span(all.iter().map(|p| p[0])), self.x);
        self.y = room(span(all.iter().map(|p| p[1])), self.y);
    }
}

fn walls_of(map: &geometry::Map) -> Vec<Vec<[f64; 2]>> {
    map.chains().into_iter().map(|chain| chain.into_iter().map(|p| [p.x, p.y]).collect()).collect()
}

/// An arm at instants that are evenly spread over its motion.
fn poses(robot: &model::Robot, joints: &[[f64; 2]]) -> Vec<[[f64; 2]; 3]> {
    let Some(arm) = &robot.arm else { return Vec::new() };
    let turned = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0]).abs() + (pair[1][1] - pair[0][1]).abs();
    let total: f64 = joints.windows(2).map(turned).sum();
    let (mut so_far, mut next, mut chosen) = (0.0, 0, Vec::new());
    for (i, own) in joints.iter().enumerate() {
        so_far += if i > 0 { turned(&joints[i - 1..=i]) } else { 0.0 };
        if so_far >= total * next as f64 / (POSES - 1) as f64 - 1e-12 || i + 1 == joints.len() {
            next = next.max((so_far / total.max(1e-12) * (POSES - 1) as f64) as usize) + 1;
            chosen.push(*own);
        }
    }
    chosen.dedup();
    let place = |p: nalgebra::Point2<f64>| [p.x, p.y];
    let geometry = &arm.geometry;
    chosen.into_iter().map(|own| [geometry.base, geometry.elbow(own), geometry.tip(own)].map(place)).collect()
}

fn fate(record: &Record, robot: RobotIndex) -> String {
    let Some(ending) = record.ending() else { return "record ends".to_owned() };
    let outcome = ending.outcome.robots.iter().find(|outcome| outcome.robot == robot);
    match outcome {
        Some(robot) => match (robot.time_s, &robot.gone) {
            (Some(time_s), _) => format!("{time_s:.1} s"),
            (None, Some(gone)) => gone.word().to_owned(),
            (None, None) if robot.stall.is_some() => "stuck".to_owned(),
            (None, None) => "not arrived".to_owned(),
        },
        None => "did not join".to_owned(),
    }
}

fn title(record: &Record) -> String {
    let scenario = record.scenario();
    let mut planners: Vec<&str> = record.robots().map(|(_, robot)| robot.planner.as_str()).collect();
    planners.sort_unstable();
    planners.dedup();
    format!("{} · {} · seed {}", scenario.name, planners.join(" + "), scenario.clock.seed)
}

fn subtitle(record: &Record, last_tick: u64, contacts: u64) -> String {
    let scenario = record.scenario();
    let (come_to, ticks) = match record.ending() {
        Some(ending) => (come_to(record, ending), ending.outcome.ticks),
        None => (format!("cut off after {:.2} s", last_tick as f64 * scenario.clock.dt_s()), last_tick),
    };
    let contacts = match contacts {
        0 => "no contact".to_owned(),
        1 => "1 contact".to_owned(),
        n => format!("{n} contacts"),
    };
    format!("{come_to}, {contacts} · {}, {ticks} ticks at {} Hz", scenario.clock.mode.word(), scenario.clock.tick_hz)
}

/// How the run ended.
fn come_to(record: &Record, ending: &Ending) -> String {
    let report = report::assemble(report::RunFacts {
        robots: record.robots().map(|(_, robot)| report::RobotFacts::of(robot)).collect(),
        ..report::RunFacts::new(record.scenario().clone(), ending.outcome.clone(), 0.0)
    });
    match report.outcome.makespan_s {
        Some(makespan_s) => {
            format!("{} of {} arrived, makespan {makespan_s:.2} s", report.outcome.arrived, report.robots)
        }
        None => format!("{} of {} arrived in {:.2} s", report.outcome.arrived, report.robots, report.sim_time_s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::{Event, EventKind, Outcome, Partner, Touch};
    use record::{Added, Moment, Sink};

    /// Two hundred robots that go round on circles, and two that meet.
    #[test]
    fn a_long_run_of_many_robots_is_a_small_picture() {
        const TICKS: u64 = 2000;
        let entry = scenarios::find_catalog("scale-64").expect("it ships with shoal");
        let overrides = scenarios::Overrides { mode: Some(model::Mode::Single), ..scenarios::Overrides::default() };
        let scenario = scenarios::parse(entry.name, entry.text, &overrides).expect("it is valid");
        let folder = tempfile::tempdir().expect("a temporary directory");
        let path = folder.path().join("run.mcap");
        let mut sink = Sink::begin(&path, &scenario).expect("a file");
        let place = |slot: u32, tick: u64| {
            let (sin, cos) = (tick as f64 * 0.02 + f64::from(slot)).sin_cos();
            [f64::from(slot) * 0.1 + 3.0 * cos, 3.0 * sin]
        };
        let added = |slot| Added { tick: 1, index: RobotIndex(slot), robot: scenario.robots[0].clone() };
        let touch = |tick, at_m| Event {
            tick,
            robot: Some(RobotIndex(3)),
            kind: EventKind::Contact { with: Partner::Obstacle(0), touch: Touch { t_s: 0.0, at_m } },
        };
        for tick in 0..=TICKS {
            let body =
                |slot| Body { index: slot, position_m: place(slot, tick), goal_m: [1.0, 2.0], ..Body::default() };
            let mut moment = Moment { tick, contacts: if tick == TICKS { 6 } else { 0 }, ..Moment::default() };
            moment.bodies.extend((0..200).map(body));
            if tick == 1 {
                moment.added.extend((64..200).map(added));
                moment.events.extend([touch(40, [1.0, 2.0]), touch(90, [-3.0, 0.5])]);
            }
            sink.take(&mut moment);
        }
        let outcome = Outcome { ticks: TICKS, ..Outcome::default() };
        sink.finish(Ending { outcome }).expect("it is written");

        let scene = Scene::of(&Record::open(&path).expect("a record")).expect("it is whole");
        assert_eq!(scene.robots.len(), 200);
        assert_eq!(scene.contacts, [[1.0, 2.0], [-3.0, 0.5]]);
        assert_eq!(scene.contacts_more, 4);
        // Six rounds of a circle each.
        assert!(
            scene.robots.iter().all(|robot| (30..600).contains(&robot.course.len()) && robot.goals == [[1.0, 2.0]])
        );
        let picture = super::super::run::draw(&scene);
        assert!(picture.len() < 2_000_000 && picture.contains("200 robots"), "{}", picture.len());
    }
}
