//! Worlds that nobody thought of: whatever is drawn, nothing panics and every number is one.

use model::random::Stream;
use scenarios::Overrides;
use shoal_tests::{Recording, build, seeds};

const SEEDS: u64 = 300;

/// A world from a seed: robots of the kinds that drive about anywhere, obstacles of all shapes and motions, a bad radio, and
/// processes that come and go.
fn world(seed: u64) -> String {
    let mut stream = Stream::new(seed, 0, 0, "test-world");
    let mut one_of = |options: &[&str]| options[stream.between(0.0, options.len() as f64) as usize].to_string();
    let (kind, speed, accel) =
        (one_of(&["point", "unicycle", "diff-drive"]), one_of(&["0.01", "1", "12"]), one_of(&["0.1", "3", "inf"]));
    // A wheel of 1 m radius is as fast as its body.
    let body = match kind.as_str() {
        "diff-drive" => format!("wheel_radius_m = 1\nwheel_radps_max = {speed}\nwheel_accel_radps2_max = {accel}"),
        _ => format!("speed_mps_max = {speed}\naccel_mps2_max = {accel}"),
    };
    let robots = one_of(&["1", "2", "5", "9", "16"]);
    let mut text = format!(
        r#"
        [clock]
        tick_hz = {}
        duration_s = 8
        stop = "{}"
        [radio]
        delay_ticks = {}
        drop = {}
        noise_m = {}
        [defaults]
        {}
        radius_m = {}
        goal_tolerance_m = {}
        sensor_range_m = {}
        radio_range_m = {}
        restart = "{}"
        [layout]
        kind = "random"
        robots = {robots}
        spread_m = 0
        "#,
        one_of(&["5", "20", "50"]),
        one_of(&["arrived", "duration"]),
        one_of(&["0", "0", "3", "40"]),
        one_of(&["0", "0", "0.5", "1"]),
        one_of(&["0", "0", "0.1", "5"]),
        format_args!("kind = \"{kind}\"\n{body}"),
        one_of(&["0.02", "0.2", "0.6"]),
        one_of(&["0.001", "0.1", "1"]),
        one_of(&["0.01", "2", "100"]),
        one_of(&["0.01", "3", "100"]),
        one_of(&["never", "on-failure"]),
    );
    for _ in 0..one_of(&["0", "3", "8"]).parse().unwrap() {
        let mut place = || stream.between(-9.0, 9.0);
        let (x, y) = (place(), place());
        let shape = match (place() + 9.0) as u32 / 5 {
            0 => format!("shape = \"disc\"\ncenter_m = [{x}, {y}]\nradius_m = 0.4"),
            1 => format!("shape = \"segment\"\nfrom_m = [{x}, {y}]\nto_m = [{}, {y}]", x + 1.0),
            2 => format!("shape = \"capsule\"\nfrom_m = [{x}, {y}]\nto_m = [{x}, {}]\nradius_m = 0.2", y + 0.7),
            _ => format!("shape = \"polygon\"\ncorners_m = [[{x}, {y}], [{}, {y}], [{x}, {}]]", x + 0.8, y + 0.8),
        };
        let motion = match (place() + 9.0) as u32 / 4 {
            0 => "motion = { kind = \"random-walk\", speed_mps = 0.8 }".to_string(),
            1 => "motion = { kind = \"bounce\", velocity_mps = [0.9, -0.4] }".to_string(),
            2 => format!("motion = {{ kind = \"orbit\", center_m = [{}, {y}], omega_radps = -0.7 }}", x / 2.0),
            _ => String::new(),
        };
        text += &format!("[[obstacle]]\n{shape}\n{motion}\n");
    }
    for (kind, more) in [("kill", ""), ("pause", "for_s = 1.3"), ("task", "goal_m = [0, 0]\nnow = true")] {
        let at_s = stream.between(0.0, 7.9);
        if at_s < 5.0 {
            text += &format!("[[event]]\nat_s = {at_s:.2}\nkind = \"{kind}\"\nrobot = \"r00\"\n{more}\n");
        }
    }
    text
}

#[test]
fn nothing_panics_and_everything_is_finite() {
    let mut ran = 0;
    seeds(0..SEEDS, |seed| {
        let overrides = Overrides { seed: Some(seed), ..Overrides::default() };
        // Some of these worlds are refused: no room, or an event for a robot that has been killed. That is an answer too.
        let Ok(scenario) = scenarios::parse("random.toml", &world(seed), &overrides) else { return };
        ran += 1;
        let recording = Recording::of(&scenario);
        for frame in &recording.frames {
            for body in &frame.bodies {
                let numbers = [body.x_m, body.y_m, body.yaw_rad, body.vx_mps, body.vy_mps, body.radius_m];
                assert!(numbers.iter().all(|x| x.is_finite()), "tick {}: {body:?}", frame.tick);
            }
        }
        let report = recording.report();
        let outcome = &report.outcome;
        let numbers = [outcome.makespan_s, outcome.flowtime_s, outcome.min_clearance_m, outcome.ldj_mean];
        let ratios = [outcome.path_ratio_mean, outcome.path_ratio_max, outcome.min_obstacle_clearance_m];
        assert!(numbers.iter().chain(&ratios).flatten().all(|x| x.is_finite()), "{outcome:#?}");
        assert!(outcome.path_length_m.is_finite() && outcome.path_length_m >= 0.0);
    });
    assert!(ran * 2 > SEEDS, "only {ran} of {SEEDS} worlds were accepted");
}

/// Many robots anywhere, no obstacle: the default method brings nearly all of them home.
#[test]
fn random_crowds_sort_themselves_out() {
    let text = r#"
        [world]
        x_m = [-12, 12]
        y_m = [-12, 12]
        [clock]
        tick_hz = 20
        duration_s = 60
        [defaults]
        sensor_range_m = 3
        radio_range_m = 4
        [layout]
        kind = "random"
        robots = 24
        spread_m = 1.4
        goal_distance_m_min = 6
    "#;
    let (mut arrived, mut robots) = (0, 0);
    seeds(0..12, |seed| {
        let report = Recording::of(&build::with(text, &build::seed(seed))).report();
        (arrived, robots) = (arrived + report.outcome.arrived, robots + report.robots);
        assert_eq!(report.outcome.robot_contacts, 0, "{:#?}", report.unmet);
    });
    assert!(arrived * 100 >= robots * 95, "{arrived} of {robots}");
}
