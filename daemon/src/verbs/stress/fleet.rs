//! The scenario of a stress test: a square of robots, each of which chases a goal that goes round its own place, so that
//! all of them drive, hear about twelve others, and never arrive.

use std::fmt::Write;

/// From place to place, m.
const SPACING_M: f64 = 2.5;
/// Radius of the circle on which a goal moves, m: robots of two places do not touch.
const ORBIT_M: f64 = 0.7;
/// A goal moves faster than its robot.
const OMEGA_RADPS: f64 = 2.0;
/// Hears two places along the rows, one along the diagonals.
const RADIO_RANGE_M: f64 = 5.4;

/// Its text, for `scenarios::parse`.
pub(super) fn scenario(robots: usize, tick_hz: f64, duration_s: f64) -> String {
    let columns = (robots as f64).sqrt().ceil() as usize;
    let half_m = 0.5 * SPACING_M * columns as f64 + SPACING_M;
    let mut text = format!(
        "description = \"Robots that drive all the time.\"\n\
         [world]\nx_m = [-{half_m}, {half_m}]\ny_m = [-{half_m}, {half_m}]\n\
         [clock]\nmode = \"realtime\"\ntick_hz = {tick_hz:?}\nduration_s = {duration_s:?}\nstop = \"duration\"\n\
         [fleet]\nmax_robots = {robots}\n\
         [defaults]\nspeed_mps_max = 1\nsensor_range_m = 2\nradio_range_m = {RADIO_RANGE_M}\n\
         [expect]\narrived = 0\ncontacts_max = 1000000000\n"
    );
    for robot in 0..robots {
        let place = |index: usize| (index as f64 - 0.5 * (columns - 1) as f64) * SPACING_M;
        let (x_m, y_m) = (place(robot % columns), place(robot / columns));
        let goal_x_m = x_m + ORBIT_M;
        let _ = write!(
            text,
            "[[robot]]\nid = \"r{robot:02}\"\nstart_m = [{x_m:?}, {y_m:?}]\ngoal_m = [{goal_x_m:?}, {y_m:?}]\n\
             goal_motion = {{ kind = \"orbit\", center_m = [{x_m:?}, {y_m:?}], omega_radps = {OMEGA_RADPS:?} }}\n"
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::MAX_ROBOTS;
    use scenarios::{Overrides, parse};

    #[test]
    fn fleets_of_any_size_are_valid_and_drive_to_the_end() {
        for robots in [1, 2, 15, 64, MAX_ROBOTS] {
            let text = scenario(robots, 50.0, 0.5);
            let scenario =
                parse("stress", &text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}"));
            assert_eq!((scenario.robots.len(), scenario.fleet.max_robots), (robots, robots));
        }
        let scenario = parse("stress", &scenario(15, 50.0, 10.0), &Overrides::default()).unwrap();
        let outcome = crate::single::run(&scenario, &mut |_, _| std::ops::ControlFlow::Continue(())).unwrap();
        assert_eq!((outcome.ticks, outcome.robot_contacts), (500, 0));
        assert!(outcome.robots.iter().all(|robot| !robot.arrived && robot.path_length_m > 3.0), "{:?}", outcome.robots);
    }
}
