//! What the daemon tells an agent when it starts it: a file in the root of the run, read once.

use model::{Clock, MapRef, Physics, Robot, RobotInstance, Scenario};
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
    /// What moves the bodies.
    pub physics: Physics,
    /// A command acts for this long after the odometry that it was computed from, s; from older odometry there is none.
    pub command_timeout_s: f64,
    /// Whether commands may act late and messages may be late or lost: robots with a filter then agree on borders.
    pub is_loose: bool,
    /// How many pieces there are besides one per robot.
    pub shape_pieces: u32,
    /// How many robots the fleet can hold.
    pub max_robots: u32,
    /// Whom it will hear first, as far as that can be foreseen: it can open their boards before it takes part.
    pub foreseen: Vec<RobotInstance>,
    /// The fixed obstacles, if the robot knows the map; else empty.
    pub map: Vec<MapPiece>,
    /// The map of the scenario, if it has one: for what the robot senses, and for what it knows. Its walls are in a file of their
    /// own.
    pub walls: Option<MapRef>,
}

impl AgentSpec {
    /// The part of a scenario that the agent of this instance may know.
    pub fn new(scenario: &Scenario, robot: &Robot, instance: RobotInstance) -> AgentSpec {
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
            physics: scenario.physics,
            command_timeout_s: scenario.fleet.command_timeout_s,
            is_loose: scenario.is_loose(),
            shape_pieces: scenario.shape_pieces(),
            max_robots: scenario.fleet.max_robots as u32,
            foreseen: Vec::new(),
            map,
            walls: scenario.map.clone(),
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
