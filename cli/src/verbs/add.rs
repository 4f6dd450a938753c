//! `shoal add`: robots join a running fleet.

use super::{fleet, ps};
use crate::args::{AddArgs, Format};
use crate::exit::Failure;
use crate::out;
use bus::Address;
use bus::clean::FleetEntry;
use geometry::Capsule;
use model::{ProcessState, RobotIndex, Scenario};
use protocol::operator_to_daemon::{NewRobot, Reply, Request, Status};
use scenarios::NewLayout;
use serde_json::{Value, json};

/// Requests that wait for their answer at the same time.
const AT_ONCE: usize = 32;

/// Asks the daemon to let robots in. When this returns, they take part and hear their neighbours, and these hear them.
///
/// # Errors
/// When no fleet is running, its daemon does not answer, or there is no room for such a robot. Of several, those that could
/// join are printed first.
pub fn run(options: &AddArgs) -> Result<(), Failure> {
    let entry = fleet::choose_entry(&options.fleet)?;
    let address = &entry.address;
    let robot = |start_m: [f64; 2], goal_m: [f64; 2]| NewRobot {
        start_m,
        goal_m,
        planner: options.planner.clone(),
        kind: options.kind.clone(),
        ..NewRobot::default()
    };
    let (Some(kind), Some(count)) = (&options.layout, options.count) else {
        let (Some(start_m), Some(goal)) = (options.start, options.goal) else {
            return Err(Failure::usage("`--start` and `--goal` are missing"));
        };
        let new = NewRobot {
            id: options.id.clone(),
            start_yaw_rad: options.yaw,
            goal_yaw_rad: goal.yaw_rad,
            ..robot(start_m, goal.at_m)
        };
        let joined = join(address, &Request::Add(new))?;
        return match options.format {
            Format::Json => out::json(&joined.json("shoal.add/1", address.id())),
            Format::Text => out::data(&joined.words(address.id())),
        };
    };
    let layout = NewLayout { kind: kind.clone(), robots: count, set: options.set.clone(), seed: options.seed };
    let places = places(&entry, &layout)?;
    let new: Vec<NewRobot> = places.into_iter().map(|[start_m, goal_m]| robot(start_m, goal_m)).collect();
    let (mut joined, mut failed) = (Vec::new(), Vec::new());
    for several in new.chunks(AT_ONCE) {
        for (new, result) in several.iter().zip(join_all(address, several)) {
            match result {
                Ok(robot) => joined.push(robot),
                Err(failure) => failed.push((new.start_m, failure)),
            }
        }
    }
    joined.sort_by_key(|robot| robot.index);
    match options.format {
        Format::Json => {
            let robots: Vec<Value> = joined.iter().map(Joined::facts).collect();
            let failures =
                failed.iter().map(|(start_m, failure)| json!({ "start_m": start_m, "error": failure.message() }));
            out::json(&json!({
                "schema": "shoal.add/1", "fleet": address.id(), "robots": robots,
                "failures": failures.collect::<Vec<_>>(),
            }))?;
        }
        Format::Text => {
            out::data(&joined.iter().map(|robot| robot.words(address.id())).collect::<String>())?;
        }
    }
    let Some((_, first)) = failed.first() else { return Ok(()) };
    for ([x_m, y_m], failure) in &failed[1..] {
        out::talk(&format!("robot at {x_m:.2},{y_m:.2}: {}", failure.message()));
    }
    Err(first.clone().hint(format!("{} of {count} robots have joined", joined.len())))
}

/// A robot that has joined, or has come back.
pub(super) struct Joined {
    robot: String,
    index: RobotIndex,
    incarnation: u32,
    joined_ms: f64,
    neighbors: u32,
}

impl Joined {
    fn words(&self, fleet: &str) -> String {
        self.told(|robot, _| format!("robot `{robot}` has joined fleet {fleet}"))
    }

    /// What has happened to this robot in this life, whom it hears, and how long it took.
    pub(super) fn told(&self, happened: impl FnOnce(&str, u32) -> String) -> String {
        let hears = match self.neighbors {
            0 => "no neighbours in range".to_owned(),
            1 => "it and 1 neighbour hear each other".to_owned(),
            more => format!("it and {more} neighbours hear each other"),
        };
        format!("{}: {hears}, {:.0} ms\n", happened(&self.robot, self.incarnation), self.joined_ms)
    }

    pub(super) fn json(&self, schema: &str, fleet: &str) -> Value {
        let mut value = self.facts();
        (value["schema"], value["fleet"]) = (json!(schema), json!(fleet));
        value
    }

    fn facts(&self) -> Value {
        json!({
            "robot": self.robot, "slot": self.index, "incarnation": self.incarnation, "joined_ms": self.joined_ms,
            "neighbors": self.neighbors,
        })
    }
}

/// Asks for it, and waits until the robot and its neighbours hear each other.
pub(super) fn join(address: &Address, request: &Request) -> Result<Joined, Failure> {
    match fleet::ask(address, request)? {
        Reply::Joined { robot, index, incarnation, joined_ms, neighbors } => {
            Ok(Joined { robot, index, incarnation, joined_ms, neighbors })
        }
        reply => Err(fleet::confused(&reply)),
    }
}

/// All at the same time: each waits until its robot hears its neighbours.
fn join_all(address: &Address, new: &[NewRobot]) -> Vec<Result<Joined, Failure>> {
    std::thread::scope(|scope| {
        let asked: Vec<_> = new.iter().map(|new| scope.spawn(|| join(address, &Request::Add(new.clone())))).collect();
        let failed = || Err(Failure::environment("the request ended without an answer"));
        asked.into_iter().map(|asked| asked.join().unwrap_or_else(|_| failed())).collect()
    })
}

/// Start and goal of each robot of a layout, clear of where robots are now.
fn places(entry: &FleetEntry, layout: &NewLayout) -> Result<Vec<[[f64; 2]; 2]>, Failure> {
    let scenario: Scenario = fleet::left(&entry.address, world_sim::shell::SCENARIO_FILE)?;
    let status = ps::seen(entry)?;
    let places = scenarios::places(&scenario, layout, &bodies(&scenario, &status))
        .map_err(|problems| Failure::from_text(crate::exit::USAGE, problems.to_string().trim_end()))
        .map_err(|failure| failure.hint("`shoal schema --format text` lists the keys of a layout"))?;
    Ok(places.into_iter().map(|place| place.map(<[f64; 2]>::from)).collect())
}

/// Where robots are now. Of one that was added, nobody but the daemon knows the radius: it is taken to be the usual one.
fn bodies(scenario: &Scenario, status: &Status) -> Vec<Capsule> {
    let there = status.robots.iter().filter(|robot| robot.state != ProcessState::Left);
    let body = |robot: &protocol::operator_to_daemon::RobotStatus| {
        let known = scenario.robots.iter().find(|known| known.id == robot.id);
        let radius_m = known.map_or(scenario.template.radius_m, |known| known.radius_m);
        Some(Capsule::disc(robot.position_m?.into(), radius_m))
    };
    there.filter_map(body).collect()
}
