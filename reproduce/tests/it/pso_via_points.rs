//! What the rows do not say: every expectation has one, and what the method does as a robot runs it.

use geometry::Elbow;
use geometry::arm::{FreeSpace, Room, Through, shortest_grid_path};
use geometry::spline::length;
use model::BodyKind;
use model::key::Named;
use planners::pso_via_points::field::Variant;
use shoal_reproduce::Row;
use shoal_reproduce::pso_via_points::experiment::{Experiment, reduction_percent};
use shoal_reproduce::pso_via_points::{PAPER, fleet};
use shoal_reproduce::scene::{plain, scene, scenes_of};

/// No expectation is passed over.
#[test]
fn every_expectation_has_a_row() {
    let rows = PAPER.all_rows();
    for scene in scenes_of("pso_") {
        for expect in scene.expectations() {
            let keys: Vec<&str> = expect.results().map(|key| key.name()).collect();
            // The distance between start and goal cannot fail, and these others imply.
            let implied = |key: &str| match key {
                "straight_line_m" => true,
                "arrives" => keys.contains(&"path_length_m"),
                "distance_to_goal_m" => keys.contains(&"end_m"),
                key => key.strip_prefix("free_elbow_").is_some_and(|sheet| {
                    let share = format!("fraction_free_{sheet}");
                    keys.contains(&share.as_str())
                }),
            };
            for key in keys.iter().filter(|key| !implied(key)) {
                let (begin, end) = (format!("{} {}", scene.name, expect.method), format!(": {}", plain(key)));
                let named = |row: &Row| row.item.starts_with(&begin) && row.item.ends_with(&end);
                assert!(rows.iter().any(named), "{begin}{end}");
            }
        }
    }
}

/// The best cost never increases, and no path is shorter than the straight line.
#[test]
fn swarms_only_improve() {
    let experiment = Experiment::new(scene("pso_mass_point_1"));
    let raw = experiment.raw(Variant::Plain);
    for seed in 0..3 {
        let best = experiment.optimise(&raw.points, None, seed);
        assert!(best.history.windows(2).all(|pair| pair[1] <= pair[0]), "seed {seed}");
        assert!(best.length_m >= experiment.straight(), "seed {seed}");
    }
}

/// What the range of joint 1 does to paths on a grid: it has 360 degrees, and stops at both ends.
#[test]
fn joint_1_stops_at_both_ends() {
    for (name, elbow, expected) in [
        ("pso_arm_1", Elbow::Up, Some(11.657)),
        ("pso_arm_1", Elbow::Down, Some(23.021)),
        ("pso_arm_elbow_flip", Elbow::Up, None),
        ("pso_arm_elbow_flip", Elbow::Down, Some(23.021)),
    ] {
        let experiment = Experiment::new(scene(name));
        let shapes: Vec<_> = experiment.obstacles.iter().map(|obstacle| obstacle.shape).collect();
        let space = FreeSpace::of(&experiment.arm.expect("an arm"), &shapes, 0.1, Room::default());
        let found = shortest_grid_path(&space, experiment.start, experiment.goal, Through::SheetWithStops(elbow));
        let rounded = found.map(|length_m| (length_m * 1000.0).round() / 1000.0);
        assert_eq!(rounded, expected, "{name} {elbow:?}");
    }
}

/// What the specification's worst seed takes off the raw path, less its tolerance of half a percentage point, and no
/// contact on the way.
#[test]
fn the_swarm_shortens_every_path_without_a_contact() {
    for (name, base, elbow, percent) in [
        ("pso_mass_point_1", Variant::Plain, None, 12.0),
        ("pso_mass_point_2", Variant::FadedBias, None, 6.2),
        ("pso_arm_1", Variant::Plain, Some(Elbow::Up), 4.1),
        ("pso_arm_2", Variant::FadedBias, Some(Elbow::Up), 17.2),
    ] {
        let experiment = Experiment::new(scene(name));
        let raw = experiment.raw(base);
        for seed in 0..10 {
            let best = experiment.optimise(&raw.points, elbow, seed);
            let reduction = reduction_percent(length(&raw.points), best.length_m);
            assert!(reduction >= percent - 0.5, "{name}, seed {seed}: {reduction:.2} %");
            assert!(best.accepted && best.clearance_m > 0.0, "{name}, seed {seed}: {:.3} m", best.clearance_m);
        }
    }
}

/// An arm arrives within its joints' limits and its sheet, no link touching; where the way would need the other sheet it
/// goes round, or stays where it is.
#[test]
fn arms_keep_their_limits_and_their_sheet() {
    for (name, elbow, arrives) in [
        ("pso_arm_1", Elbow::Up, true),
        ("pso_arm_1", Elbow::Down, true),
        ("pso_arm_2", Elbow::Up, true),
        ("pso_arm_2", Elbow::Down, false),
        ("pso_arm_elbow_flip", Elbow::Down, true),
        ("pso_arm_elbow_flip", Elbow::Up, false),
    ] {
        let run = fleet::run_arm(&Experiment::new(scene(name)), elbow);
        assert_eq!(run.arrival_s.is_some(), arrives, "{name} {elbow:?}: {:?}", run.arrival_s);
        assert!(run.within_limits && run.clearance_m >= 0.0, "{name} {elbow:?}: {:.3} m", run.clearance_m);
        assert!(arrives || run.tip_path_m == 0.0, "{name} {elbow:?}: moved {:.3} m", run.tip_path_m);
    }
}

#[test]
fn figures_say_what_is_refused() {
    let series = (PAPER.series)();
    let refused = series.iter().find(|series| series.name == "pso_arm_elbow_flip_up_paths").expect("it is drawn");
    assert!(refused.title.contains("stays put"), "{}", refused.title);
}

/// Robots that plan alone and meet: nobody waits for ever, nobody touches, also where a field alone stands still (exactly
/// opposed robots, a trap between two discs). Poses are one tick old.
#[test]
fn fleets_arrive_without_contact() {
    for (name, robots_m, obstacles_m) in [
        ("apf_headon", 0.2, f64::INFINITY),
        ("apf_headon_offset", 0.2, f64::INFINITY),
        ("apf_cross4", 0.2, 0.05),
        ("apf_dynamic", 0.2, 0.04),
        ("apf_antipodal8", 0.15, f64::INFINITY),
        ("apf_two_disc_trap", f64::INFINITY, 0.05),
    ] {
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            let outcome = fleet::run(scene(name), kind);
            assert!(outcome.all_arrived(), "{name} {kind:?}: {:?}", outcome.arrival_ticks);
            assert!(
                outcome.robots.clearance_m >= robots_m,
                "{name} {kind:?}: robots {:.3}",
                outcome.robots.clearance_m
            );
            let clearance = outcome.obstacles.clearance_m;
            assert!(clearance >= obstacles_m, "{name} {kind:?}: obstacles {clearance:.3}");
        }
    }
}

/// Traps in which Khatib's field stands still.
#[test]
fn traps_of_the_field_are_left() {
    for name in ["liquid_two_obstacles", "liquid_u_resonance", "rpoa_u_trap"] {
        for kind in [BodyKind::Point, BodyKind::Unicycle] {
            let outcome = fleet::run(scene(name), kind);
            assert!(
                outcome.all_arrived() && outcome.obstacles.clearance_m > 0.0,
                "{name} {kind:?}: {:?}",
                outcome.arrival_ticks
            );
        }
    }
}
