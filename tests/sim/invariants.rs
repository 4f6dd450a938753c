//! What holds in every tick of every run: nobody is faster than it can be, nobody moves who does not take part, what is
//! said of a velocity is what the positions show.

use geometry::wrap;
use model::{BodyKind, Robot, Scenario};
use nalgebra::Vector2;
use protocol::world_to_observer::FrameBody;
use shoal_tests::recording::{at, is_silent};
use shoal_tests::{Recording, build, catalog, catalog_names, scenario, seeds};

const EPS: f64 = 1e-9;

/// Checks every robot in every tick.
fn check(scenario: &Scenario) {
    let recording = Recording::of(scenario);
    let dt_s = scenario.clock.dt_s();
    for ticks in recording.frames.windows(2) {
        let [before, after] = ticks else { unreachable!("windows of two") };
        for body in after.robots() {
            let robot = &scenario.robots[body.index as usize];
            let what = || format!("{}, `{}`, tick {}: {body:?}", scenario.name, robot.id, after.tick);
            assert!(all(body).iter().all(|x| x.is_finite()), "{}", what());
            assert_eq!(body.radius_m, robot.radius_m, "{}", what());
            assert!(body.yaw_rad > -std::f64::consts::PI && body.yaw_rad <= std::f64::consts::PI, "{}", what());

            let begin = before.robot(body.index as usize).copied().unwrap_or_else(|| at_start(robot, body));
            let moved = at(body) - at(&begin);
            let velocity = Vector2::new(body.vx_mps, body.vy_mps);
            // Joints turn at rates that suit the tip where the tick opens; on its way it may become a little faster.
            let more = if robot.arm.is_some() { 1.0 + 4.0 * robot.limits.turn_radps_max * dt_s } else { 1.0 };
            assert!(moved.norm() <= robot.limits.speed_mps_max * dt_s * more + EPS, "{}: {moved}", what());
            assert!(velocity.norm() <= robot.limits.speed_mps_max * more + EPS, "{}", what());
            if is_silent(body) {
                assert_eq!((moved, velocity, body.yaw_rad), (Vector2::zeros(), Vector2::zeros(), begin.yaw_rad));
                continue;
            }
            match robot.kind {
                BodyKind::Point => point(robot, &begin, body, dt_s, &what),
                BodyKind::Unicycle | BodyKind::DiffDrive => unicycle(robot, &begin, body, dt_s, &what),
                BodyKind::TwoLinkArm => arm(robot, &begin, body, dt_s, &what),
            }
        }
    }
}

/// The velocity is the way divided by the time, and changes no faster than it can; the heading stays.
fn point(robot: &Robot, begin: &FrameBody, end: &FrameBody, dt_s: f64, what: &dyn Fn() -> String) {
    let velocity = Vector2::new(end.vx_mps, end.vy_mps);
    let change = velocity - Vector2::new(begin.vx_mps, begin.vy_mps);
    assert!((at(end) - at(begin) - velocity * dt_s).norm() < EPS, "{}", what());
    assert!(change.norm() <= robot.limits.accel_mps2_max * dt_s + EPS, "{}: {change}", what());
    assert_eq!(end.yaw_rad, begin.yaw_rad, "{}", what());
}

/// It drives along its heading only, on an arc; the way is the chord of that arc.
fn unicycle(robot: &Robot, begin: &FrameBody, end: &FrameBody, dt_s: f64, what: &dyn Fn() -> String) {
    let limits = &robot.limits;
    let along = |body: &FrameBody| Vector2::new(body.yaw_rad.cos(), body.yaw_rad.sin());
    let speed = |body: &FrameBody| Vector2::new(body.vx_mps, body.vy_mps).dot(&along(body));
    let sideways = Vector2::new(end.vx_mps, end.vy_mps).perp(&along(end));
    assert!(sideways.abs() < EPS, "{}: {sideways} m/s sideways", what());
    assert!((-limits.reverse_mps_max - EPS..=limits.speed_mps_max + EPS).contains(&speed(end)), "{}", what());
    let change = speed(end) - speed(begin);
    assert!(change.abs() <= limits.accel_mps2_max * dt_s + EPS, "{}: {change}", what());

    let turned = wrap(end.yaw_rad - begin.yaw_rad);
    assert!(turned.abs() <= limits.turn_radps_max * dt_s + EPS, "{}: {turned} rad", what());
    // An arc of this length that turns by this much, from its definition: the mean heading's direction, and
    // 2 r sin(angle / 2) with r = length / angle.
    let length = speed(end) * dt_s;
    let chord = if turned.abs() > 1e-6 { 2.0 * length / turned * (turned / 2.0).sin() } else { length };
    let middle = begin.yaw_rad + turned / 2.0;
    let expected = Vector2::new(middle.cos(), middle.sin()) * chord;
    assert!((at(end) - at(begin) - expected).norm() < EPS, "{}: {expected}", what());
}

/// Its tip is where its joints say, they keep their ranges and rates, and what is said of the tip's velocity is what the
/// joints do, unless one of them has come to the end of its range.
fn arm(robot: &Robot, begin: &FrameBody, end: &FrameBody, dt_s: f64, what: &dyn Fn() -> String) {
    let geometry = robot.arm.expect("an arm has a build").geometry;
    let [first, second] = end.joints_rad;
    let whole = first + second;
    let reach = Vector2::new(first.cos(), first.sin()) * geometry.links_m[0]
        + Vector2::new(whole.cos(), whole.sin()) * geometry.links_m[1];
    assert!((at(end) - geometry.base - reach).norm() < EPS, "{}", what());
    assert!(wrap(end.yaw_rad - whole).abs() < EPS, "{}", what());
    let mut free = true;
    for i in 0..2 {
        let (low, high) = (geometry.joint_min_rad[i], geometry.joint_max_rad[i]);
        assert!((low..=high).contains(&end.joints_rad[i]), "{}", what());
        let turned = end.joints_rad[i] - begin.joints_rad[i];
        assert!(turned.abs() <= robot.limits.turn_radps_max * dt_s + EPS, "{}: {turned} rad", what());
        free &= end.joints_rad[i] != low && end.joints_rad[i] != high;
    }
    if free {
        let rates = [0, 1].map(|i| (end.joints_rad[i] - begin.joints_rad[i]) / dt_s);
        let expected = Vector2::new(-reach.y, reach.x) * rates[0]
            + Vector2::new(-whole.sin(), whole.cos()) * (geometry.links_m[1] * rates[1]);
        assert!((Vector2::new(end.vx_mps, end.vy_mps) - expected).norm() < 1e-6, "{}: {expected}", what());
    }
}

/// Turn rates are not in a frame: they are what headings show, from the third frame on.
fn turn_rates_change_slowly(scenario: &Scenario) {
    let recording = Recording::of(scenario);
    let dt_s = scenario.clock.dt_s();
    for (slot, robot) in scenario.robots.iter().enumerate() {
        let yaws: Vec<f64> = recording.frames.iter().filter_map(|frame| Some(frame.robot(slot)?.yaw_rad)).collect();
        let rates: Vec<f64> = yaws.windows(2).map(|two| wrap(two[1] - two[0]) / dt_s).collect();
        for two in rates.windows(2) {
            let change = (two[1] - two[0]).abs();
            assert!(change <= robot.limits.turn_accel_radps2_max * dt_s + 1e-6, "`{}`: {change} rad/s", robot.id);
        }
        assert!(rates.iter().any(|rate| rate.abs() > 0.1), "`{}` turns at all", robot.id);
    }
}

/// Rates of wheels are not in a frame: they are what speeds and headings show.
fn wheels_change_slowly(scenario: &Scenario) {
    let recording = Recording::of(scenario);
    let dt_s = scenario.clock.dt_s();
    for (slot, robot) in scenario.robots.iter().enumerate() {
        let wheels = robot.wheels.expect("all have wheels");
        let bodies: Vec<FrameBody> = recording.frames.iter().filter_map(|frame| frame.robot(slot).copied()).collect();
        let rates = bodies.windows(2).map(|two| {
            let turn_radps = wrap(two[1].yaw_rad - two[0].yaw_rad) / dt_s;
            let heading = Vector2::new(two[1].yaw_rad.cos(), two[1].yaw_rad.sin());
            wheels.rates_of(heading.dot(&Vector2::new(two[1].vx_mps, two[1].vy_mps)), turn_radps)
        });
        let rates: Vec<[f64; 2]> = rates.collect();
        for (two, side) in rates.windows(2).flat_map(|two| [(two, 0), (two, 1)]) {
            let (rate, change) = (two[1][side].abs(), (two[1][side] - two[0][side]).abs());
            assert!(rate <= wheels.speed_radps_max + 1e-6, "`{}`: {rate} rad/s", robot.id);
            assert!(change <= wheels.accel_radps2_max * dt_s + 1e-6, "`{}`: {change} rad/s", robot.id);
        }
        let at_its_limit = |two: &[f64; 2]| two[0].abs().max(two[1].abs()) > wheels.speed_radps_max - 1e-6;
        assert!(rates.iter().any(at_its_limit), "`{}` drives as fast as it can", robot.id);
    }
}

fn at_start(robot: &Robot, body: &FrameBody) -> FrameBody {
    let (x_m, y_m) = (robot.start.x, robot.start.y);
    let joints_rad = robot.arm.map_or([0.0; 2], |arm| arm.start_joints_rad);
    FrameBody { x_m, y_m, yaw_rad: wrap(robot.start_yaw_rad), vx_mps: 0.0, vy_mps: 0.0, joints_rad, ..*body }
}

fn all(body: &FrameBody) -> [f64; 6] {
    [body.x_m, body.y_m, body.yaw_rad, body.radius_m, body.vx_mps, body.vy_mps]
}

#[test]
fn in_the_catalog() {
    for name in catalog_names() {
        seeds([1, 2], |seed| check(&catalog(name, &build::seed(seed))));
    }
}

/// Heavy bodies, all kinds in one world, every limit in force, and processes that come and go.
const HEAVY: &str = r#"
    [clock]
    tick_hz = 25
    duration_s = 25
    [defaults]
    sensor_range_m = 3
    radio_range_m = 4
    accel_mps2_max = 0.8
    [kinds.unicycle]
    speed_mps_max = 0.7
    reverse_mps_max = 0.2
    turn_radps_max = 1.5
    turn_accel_radps2_max = 4
    [layout]
    kind = "circle-swap"
    robots = 8
    radius_m = 6
    jitter_m = 0.4
    [[robot]]
    id = "uni-1"
    kind = "unicycle"
    start_m = [-8, -8]
    start_yaw_rad = 3.1
    goal_m = [8, 7.5]
    [[robot]]
    id = "uni-2"
    kind = "unicycle"
    start_m = [8, -8]
    start_yaw_rad = -1.5
    goal_m = [-8, 8]
    restart = "on-failure"
    [[robot]]
    id = "wheels"
    kind = "diff-drive"
    start_m = [0, -8]
    start_yaw_rad = -1.5
    goal_m = [0, -4, 2]
    wheel_accel_radps2_max = 6
    reverse_mps_max = 0.1
    [[event]]
    at_s = 5
    kind = "pause"
    robot = "uni-1"
    for_s = 1.2
    [[event]]
    at_s = 7
    kind = "kill"
    robot = "uni-2"
    [[event]]
    at_s = 9
    kind = "kill"
    robot = "r03"
"#;

#[test]
fn with_every_limit_in_force() {
    seeds(1..=6, |seed| check(&build::with(HEAVY, &build::seed(seed))));
}

#[test]
fn of_wheels() {
    let text = r#"
        [clock]
        duration_s = 30
        [defaults]
        kind = "diff-drive"
        start_yaw_rad = 2.5
        wheel_accel_radps2_max = 8
        [layout]
        kind = "circle-swap"
        robots = 6
        radius_m = 3
        "#;
    seeds(1..=3, |seed| {
        let scenario = build::with(text, &build::seed(seed));
        check(&scenario);
        wheels_change_slowly(&scenario);
    });
}

#[test]
fn of_unicycles_that_turn_slowly() {
    let text = r#"
        [clock]
        duration_s = 20
        [defaults]
        kind = "unicycle"
        start_yaw_rad = 2.5
        turn_accel_radps2_max = 2
        accel_mps2_max = 1
        [layout]
        kind = "circle-swap"
        robots = 6
        radius_m = 5
        jitter_m = 0.3
    "#;
    let scenario = scenario(text);
    check(&scenario);
    turn_rates_change_slowly(&scenario);
}

/// Obstacles and goals are not stopped by anything.
#[test]
fn obstacles_move_whoever_is_in_the_way() {
    let mut scenario = catalog("moving-obstacles", &build::seed(3));
    let free = Recording::of(&scenario);
    scenario.robots.truncate(1);
    let empty = Recording::of(&scenario);
    for (a, b) in free.frames.iter().zip(&empty.frames) {
        for index in 0..scenario.obstacles.len() {
            assert_eq!(a.obstacle(index), b.obstacle(index), "tick {}", a.tick);
            assert!(a.obstacle(index).is_some());
        }
    }
}
