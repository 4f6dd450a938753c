//! What stays as it is while a fleet runs, or seldom changes: obstacles, robots and their names.

use geometry::Map;
use model::{Mode, Obstacle, Robot, Scenario, Shape};
use serde::Serialize;

/// A fleet.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fleet {
    /// Its id; of a record, the path.
    pub id: String,
    /// The name that it was given.
    pub name: Option<String>,
    /// The scenario.
    pub scenario: String,
    /// Clock mode.
    pub mode: Mode,
    /// Ticks per second of simulated time.
    pub tick_hz: f64,
    /// Seed of its random streams.
    pub seed: u64,
    /// The world's edges, m: lowest and highest x, lowest and highest y.
    pub bounds_m: [[f64; 2]; 2],
    /// What stands or moves besides robots.
    pub things: Vec<Thing>,
    /// The walls of the map as lines of corners, m; none without a map.
    pub walls_m: Vec<Vec<[f64; 2]>>,
    /// The robots by slot; those that were added come last.
    pub members: Vec<Member>,
}

/// An obstacle, as it was at the start.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Thing {
    /// Its form.
    #[serde(flatten)]
    pub form: Form,
    /// Of one that moves, the point that a frame gives a new place, m. It keeps its orientation.
    pub carried_at_m: Option<[f64; 2]>,
}

/// The form of an obstacle. Lengths in m.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "form", rename_all = "kebab-case")]
pub enum Form {
    /// All that is within a distance of a line.
    Capsule {
        /// The ends of the line.
        ends_m: [[f64; 2]; 2],
        /// The distance.
        radius_m: f64,
    },
    /// A filled polygon.
    Polygon {
        /// Its corners, in order.
        corners_m: Vec<[f64; 2]>,
    },
}

/// A robot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Member {
    /// Its name.
    pub id: String,
    /// How it moves.
    pub kind: &'static str,
    /// Its method.
    pub planner: String,
    /// Body radius, m; of an arm, half the thickness of its links.
    pub radius_m: f64,
    /// Whether its heading means anything.
    pub heads: bool,
    /// How it is built, if it is an arm.
    pub arm: Option<Arm>,
}

/// A two-link arm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Arm {
    /// Where it stands, m.
    pub base_m: [f64; 2],
    /// Lengths of its links, the one at the base first, m.
    pub links_m: [f64; 2],
}

impl Fleet {
    /// The fleet of a scenario.
    pub fn of(id: &str, name: Option<&str>, scenario: &Scenario) -> Fleet {
        Fleet {
            id: id.to_owned(),
            name: name.map(str::to_owned),
            scenario: scenario.name.clone(),
            mode: scenario.clock.mode,
            tick_hz: scenario.clock.tick_hz,
            seed: scenario.clock.seed,
            bounds_m: [scenario.bounds.x_m, scenario.bounds.y_m],
            things: scenario.obstacles.iter().map(Thing::of).collect(),
            walls_m: scenario.walls().map(walls_of).unwrap_or_default(),
            members: scenario.robots.iter().map(Member::of).collect(),
        }
    }
}

/// The walls of a map, to the millimetre.
fn walls_of(map: &Map) -> Vec<Vec<[f64; 2]>> {
    let round = |x: f64| (x * 1000.0).round() / 1000.0;
    map.chains().into_iter().map(|chain| chain.into_iter().map(|p| [round(p.x), round(p.y)]).collect()).collect()
}

impl Thing {
    fn of(obstacle: &Obstacle) -> Thing {
        let form = match &obstacle.shape {
            Shape::Capsule(capsule) => {
                Form::Capsule { ends_m: [capsule.a, capsule.b].map(|end| [end.x, end.y]), radius_m: capsule.radius }
            }
            Shape::Polygon(corners) => Form::Polygon { corners_m: corners.iter().map(|at| [at.x, at.y]).collect() },
        };
        let reference = obstacle.shape.reference();
        Thing { form, carried_at_m: obstacle.motion.is_some().then_some([reference.x, reference.y]) }
    }
}

impl Member {
    /// A robot of a scenario, or one that was added.
    pub fn of(robot: &Robot) -> Member {
        let arm = robot
            .arm
            .map(|arm| Arm { base_m: [arm.geometry.base.x, arm.geometry.base.y], links_m: arm.geometry.links_m });
        Member {
            id: robot.id.clone(),
            kind: robot.kind.word(),
            planner: robot.planner.clone(),
            radius_m: robot.radius_m,
            heads: robot.kind != model::BodyKind::Point && arm.is_none(),
            arm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fleet(name: &str) -> Fleet {
        let entry = scenarios::find_catalog(name).unwrap();
        let scenario = scenarios::parse(entry.name, entry.text, &scenarios::Overrides::default()).unwrap();
        Fleet::of("abc", None, &scenario)
    }

    #[test]
    fn a_fleet_has_all_that_is_drawn() {
        let demo = fleet("demo-15");
        assert_eq!(demo.members.len(), 17);
        assert!(!fleet("ring-15").members[0].heads);
        let moving = demo.things.iter().filter(|thing| thing.carried_at_m.is_some()).count();
        assert!(moving > 0 && moving < demo.things.len());
        let json = serde_json::to_value(&demo).unwrap();
        assert!(json["things"].as_array().unwrap().iter().all(|thing| thing["form"].is_string()));
        assert!(fleet("arm-1").members.iter().all(|member| member.arm.is_some() && !member.heads));
    }
}
