//! What the daemon tells an agent when it starts it: a file in the root of the run, read once.

use model::{Clock, Radio, Robot, RobotInstance, Scenario, TimelineAction};
use serde::{Deserialize, Serialize};

/// Everything an agent needs to know of the scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AgentSpec {
    /// Which process of which robot.
    pub instance: RobotInstance,
    /// The robot.
    pub robot: Robot,
    /// How time passes.
    pub clock: Clock,
    /// A command acts for this long after the odometry that it was computed from, s; from older odometry there is none.
    pub command_timeout_s: f64,
    /// How many pieces there are besides one per robot.
    pub shape_pieces: u32,
    /// How many robots the fleet can hold.
    pub max_robots: u32,
    /// The fixed obstacles, if the robot knows the map; else empty.
    pub map: Vec<MapPiece>,
    /// The radio of this receiver: from which tick on it is what. The first entry is for tick 0.
    pub radio: Vec<(u64, Radio)>,
}

impl AgentSpec {
    /// The part of a scenario that the agent of this instance may know.
    pub fn new(scenario: &Scenario, robot: &Robot, instance: RobotInstance) -> AgentSpec {
        let mut radio = vec![(0, scenario.radio)];
        for event in &scenario.events {
            if let TimelineAction::Radio { robot, radio: new } = &event.what
                && robot.is_none_or(|place| place == instance.index.at())
            {
                radio.push((event.tick, *new));
            }
        }
        let mut map = Vec::new();
        if robot.knows_map {
            for (id, obstacle) in scenario.obstacles.iter().enumerate().filter(|(_, o)| o.motion.is_none()) {
                map.extend(obstacle.shape.pieces().into_iter().map(|shape| MapPiece { id: id as u32, shape }));
            }
        }
        AgentSpec {
            instance,
            robot: robot.clone(),
            clock: scenario.clock,
            command_timeout_s: scenario.fleet.command_timeout_s,
            shape_pieces: scenario.shape_pieces(),
            max_robots: scenario.fleet.max_robots as u32,
            map,
            radio,
        }
    }
}

/// A fixed piece on a map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapPiece {
    /// Names the obstacle.
    pub id: u32,
    /// Its shape.
    pub shape: geometry::Capsule,
}
