//! What robots know of what stands.

use model::{MAX_SHAPES, MapRef, Robot, RobotIndex, RobotInstance, Scenario};
use nalgebra::Vector2;
use planners::Obstacle;
use protocol::daemon_to_robot::AgentSpec;

/// A map of fewer pieces needs less to find its links than to read them.
const MANY: usize = 64;

/// The fixed obstacles that a robot knows; with the walls of the map among them if they are few enough for methods that look at all.
pub(crate) fn map_of(spec: &AgentSpec) -> Vec<Obstacle> {
    let walls = spec.walls.as_ref().filter(|_| spec.robot.knows_map).map(MapRef::map);
    let few = walls.filter(|walls| walls.len() + spec.map.len() <= MAX_SHAPES);
    let walls = few.into_iter().flat_map(|walls| (0..).zip(walls.walls()));
    let fixed = spec.map.iter().map(|piece| Obstacle { id: piece.id, shape: piece.shape, velocity: Vector2::zeros() });
    fixed.chain(walls.map(|(index, wall)| Obstacle::wall(index, wall))).collect()
}

/// What the agents of a scenario need of its map for shortest ways, and would each find again: of each radius that several robots
/// have, if there is much on the map. A block for [`tell_links`](planners::way::tell_links).
pub fn links_of(scenario: &Scenario) -> Option<Vec<u8>> {
    if scenario.map.is_some() {
        // Ways past the walls of a map are searched for in another manner.
        return None;
    }
    let follows_ways = |robot: &&Robot| {
        let method = planners::find(&robot.planner).filter(|method| method.follows_ways);
        robot.knows_map && robot.agent.is_none() && method.is_some()
    };
    let robots: Vec<&Robot> = scenario.robots.iter().filter(follows_ways).collect();
    let mut radii_m: Vec<f64> = robots.iter().map(|robot| robot.radius_m).collect();
    radii_m.sort_by(f64::total_cmp);
    let same = radii_m.chunk_by(|a, b| a == b).filter(|same| same.len() > 1);
    let shared_m: Vec<f64> = same.map(|same| same[0]).collect();
    let anyone = RobotInstance { index: RobotIndex(0), incarnation: 0 };
    let map = map_of(&AgentSpec::new(scenario, robots.first()?, anyone));
    (map.len() >= MANY && !shared_m.is_empty()).then(|| planners::way::find_links(&map, &shared_m))
}
