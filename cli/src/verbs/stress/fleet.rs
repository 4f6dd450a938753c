//! The scenario of a stress test: a square of robots, each of which chases a goal that goes round its own place, so that
//! all of them drive, hear about twelve others, and never arrive.

use crate::exit::Failure;
use model::Scenario;
use scenarios::Draft;

/// From place to place, m.
const SPACING_M: f64 = 2.5;
/// Radius of the circle on which a goal moves, m: robots of two places do not touch.
const ORBIT_M: f64 = 0.7;
/// A goal moves faster than its robot.
const OMEGA_RADPS: f64 = 2.0;
/// Hears two places along the rows, one along the diagonals.
const RADIO_RANGE_M: f64 = 5.4;

/// The scenario of this many robots.
pub(super) fn scenario(robots: usize, tick_hz: f64, duration_s: f64) -> Result<Scenario, Failure> {
    let columns = (robots as f64).sqrt().ceil() as usize;
    let half_m = 0.5 * SPACING_M * columns as f64 + SPACING_M;
    let robot = |robot: usize| {
        let place = |index: usize| (index as f64 - 0.5 * (columns - 1) as f64) * SPACING_M;
        let (x_m, y_m) = (place(robot % columns), place(robot / columns));
        Draft::new()
            .with("id", format!("r{robot:02}"))
            .with("start_m", [x_m, y_m])
            .with("goal_m", [x_m + ORBIT_M, y_m])
            .with("goal_motion.kind", "orbit")
            .with("goal_motion.center_m", [x_m, y_m])
            .with("goal_motion.omega_radps", OMEGA_RADPS)
    };
    Draft::new()
        .with("description", "Robots that drive all the time.")
        .with("world.x_m", [-half_m, half_m])
        .with("world.y_m", [-half_m, half_m])
        .with("clock.mode", "realtime")
        .with("clock.tick_hz", tick_hz)
        .with("clock.duration_s", duration_s)
        .with("clock.stop", "duration")
        .with("fleet.max_robots", robots)
        .with("defaults.speed_mps_max", 1.0)
        .with("defaults.sensor_range_m", 2.0)
        .with("defaults.radio_range_m", RADIO_RANGE_M)
        .with("expect.arrived", 0_u64)
        .with("expect.contacts_max", 1_000_000_000_u64)
        .with("robot", (0..robots).map(robot).collect::<Vec<_>>())
        .scenario("stress")
        .map_err(|problems| crate::source::failure(&problems))
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::MAX_ROBOTS;

    #[test]
    fn fleets_of_any_size_are_valid_and_drive_to_the_end() {
        for robots in [1, 2, 15, 64, MAX_ROBOTS] {
            let scenario = scenario(robots, 50.0, 0.5).unwrap();
            assert_eq!((scenario.robots.len(), scenario.fleet.max_robots), (robots, robots));
        }
        let scenario = scenario(15, 50.0, 10.0).unwrap();
        let outcome = single::run(&scenario, &mut |_, _| std::ops::ControlFlow::Continue(())).unwrap();
        assert_eq!((outcome.ticks, outcome.robot_contacts), (500, 0));
        assert!(outcome.robots.iter().all(|robot| !robot.arrived && robot.path_length_m > 3.0), "{:?}", outcome.robots);
    }
}
