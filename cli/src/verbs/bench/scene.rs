//! The fleets of the benches: a block of robots on a lattice that drives on, so that whom a robot hears does not depend
//! on how large the fleet is, nor on how long it has been running.

use crate::exit::Failure;
use crate::source;
use model::Scenario;
use scenarios::Draft;

/// From robot to robot, m.
const SPACING_M: f64 = 2.0;
/// On the lattice that is twelve neighbours at most.
const RADIO_M: f64 = 2.1 * SPACING_M;
/// Before obstacles robots come closer to each other: eight on the lattice, and sixteen at most where they bunch.
const RADIO_AMONG_OBSTACLES_M: f64 = 1.7 * SPACING_M;
/// In the worlds that have obstacles.
const OBSTACLES: usize = 10;

/// What a bench needs of a fleet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene {
    pub(super) robots: usize,
    pub(super) mode: &'static str,
    pub(super) planner: &'static str,
    /// Ten obstacles before the block, and every robot sees all of them.
    pub(super) obstacles: bool,
    /// The robots are where they are to go.
    pub(super) parked: bool,
    pub(super) tick_hz: f64,
    pub(super) duration_s: f64,
}

impl Scene {
    /// As a scenario.
    pub(super) fn scenario(&self) -> Result<Scenario, Failure> {
        let way_m = if self.parked { 0.01 } else { 9e5 };
        let (sensor_m, radio_m) = if self.obstacles { (1e4, RADIO_AMONG_OBSTACLES_M) } else { (1.0, RADIO_M) };
        let half_m = SPACING_M * (self.robots as f64).sqrt() / 2.0;
        let obstacle = |index: usize| {
            // Spread over the breadth of the block, one behind the other.
            let across = (index * 7 % OBSTACLES) as f64 / OBSTACLES as f64 - 0.45;
            let center_m = [half_m + 2.0 + index as f64, 2.0 * half_m * across];
            Draft::new().with("shape", "disc").with("center_m", center_m).with("radius_m", 0.2)
        };
        let obstacles = if self.obstacles { OBSTACLES } else { 0 };
        Draft::new()
            .with("world.x_m", [-1e3, 1e6])
            .with("world.y_m", [-1e3, 1e3])
            .with("clock.mode", self.mode)
            .with("clock.tick_hz", self.tick_hz)
            .with("clock.duration_s", self.duration_s)
            .with("clock.stop", "duration")
            .with("defaults.planner", self.planner)
            .with("defaults.sensor_range_m", sensor_m)
            // The scene fixes the number of neighbours that are heard and of obstacles that are seen.
            .with("defaults.sees_robots", false)
            .with("defaults.radio_range_m", radio_m)
            .with("defaults.radio_hysteresis_m", 0.1)
            .with("layout.kind", "grid")
            .with("layout.robots", self.robots)
            .with("layout.spacing_m", SPACING_M)
            .with("layout.offset_m", [way_m, 0.0])
            .with("obstacle", (0..obstacles).map(obstacle).collect::<Vec<_>>())
            .scenario("bench")
            .map_err(|problems| source::failure(&problems))
    }

    /// A free place at the edge of the block, for one more.
    pub(super) fn place(&self) -> [f64; 2] {
        let columns = (self.robots as f64).sqrt().ceil();
        let rows = (self.robots as f64 / columns).ceil();
        [0.5 * SPACING_M * (columns - 1.0) - SPACING_M, -0.5 * SPACING_M * (rows - 1.0) - SPACING_M]
    }

    /// How many of the robots one at this place hears.
    pub(super) fn in_range(scenario: &Scenario, [x_m, y_m]: [f64; 2]) -> usize {
        let near = |robot: &&model::Robot| (robot.start.x - x_m).hypot(robot.start.y - y_m) <= RADIO_M;
        scenario.robots.iter().filter(near).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use single;
    use std::ops::ControlFlow;

    /// On the way past the obstacles too.
    #[test]
    fn nobody_hears_more_than_sixteen() {
        for robots in [15, 64, 200] {
            for (planner, obstacles) in [("straight", false), ("decentralized-apf", true)] {
                let scene = Scene {
                    robots,
                    mode: "single",
                    planner,
                    obstacles,
                    parked: false,
                    tick_hz: 20.0,
                    duration_s: 20.0,
                };
                let scenario = scene.scenario().unwrap();
                let (mut most, mut ticks) = (0, 0);
                single::run(&scenario, &mut |world, _| {
                    most = (0..robots).map(|slot| world.neighbors(slot).len()).fold(most, usize::max);
                    ticks += 1;
                    ControlFlow::Continue(())
                })
                .unwrap();
                assert_eq!(ticks, 400);
                assert!((4..=16).contains(&most), "{robots} robots, {planner}: {most}");
            }
        }
    }

    #[test]
    fn there_is_room_for_one_more() {
        for robots in [1, 2, 15, 64, 200] {
            let scene = Scene {
                robots,
                mode: "realtime",
                planner: "straight",
                obstacles: false,
                parked: true,
                tick_hz: 50.0,
                duration_s: 1.0,
            };
            let scenario = scene.scenario().unwrap();
            let [x_m, y_m] = scene.place();
            let gaps = scenario.robots.iter().map(|robot| (robot.start.x - x_m).hypot(robot.start.y - y_m));
            assert!(gaps.fold(f64::INFINITY, f64::min) >= SPACING_M - 1e-9, "{robots}");
            assert!(Scene::in_range(&scenario, [x_m, y_m]) >= 1, "{robots}");
        }
    }
}
