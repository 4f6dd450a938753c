//! Worlds of bodies that have weight: what a fleet meets there, whatever drives it.

use model::{EventKind, Partner};
use nalgebra::Point2;
use scenarios::{Overrides, parse};
use shoal_tests::Recording;
use shoal_tests::recording::at;

fn run(text: &str) -> Recording {
    let text = format!("[world]\nphysics = \"rapier\"\n{text}");
    Recording::of(&parse("weight", &text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}")))
}

fn end(recording: &Recording, slot: usize) -> Point2<f64> {
    let last = recording.frames.last().expect("there is a last frame");
    at(last.robot(slot).expect("it is in the world"))
}

const WALL: &str = "[[obstacle]]\nshape = \"polygon\"\ncorners_m = [[1, -5], [1.2, -5], [1.2, 5], [1, 5]]\n";

/// `straight` drives at its goal behind the wall, for all of its time; on each kind of drive.
#[test]
fn a_robot_against_a_wall_stops_at_the_wall() {
    for kind in ["point", "unicycle", "diff-drive"] {
        let recording = run(&format!(
            "[clock]\nduration_s = 15\n[defaults]\nkind = \"{kind}\"\nplanner = \"straight\"\nradius_m = 0.2\n\
             [[robot]]\nid = \"a\"\nstart_m = [-1, 0.1]\ngoal_m = [3, 0.1]\n{WALL}"
        ));
        let deepest = recording.frames.iter().filter_map(|frame| frame.robot(0)).map(|robot| at(robot).x);
        let deepest = deepest.fold(f64::NEG_INFINITY, f64::max);
        assert!((0.8 - 2e-3..0.8 + 5e-4).contains(&deepest), "{kind}: {deepest}");
        assert_eq!(recording.outcome.obstacle_contacts, 1, "{kind}: it leans on it");
        let touch = recording.outcome.events.iter().find_map(|event| match event.kind {
            EventKind::Contact { with: Partner::Obstacle(0), touch } => Some(touch),
            _ => None,
        });
        let touch = touch.expect("it is in the log");
        assert!((touch.at_m[0] - 1.0).abs() < 0.01 && (touch.at_m[1] - 0.1).abs() < 0.01, "{kind}: {touch:?}");
    }
}

/// A dead robot is still a body: it is pushed out of the way, and its next life starts where it lies.
#[test]
fn a_dead_robot_is_pushed_and_starts_again_where_it_lies() {
    let recording =
        run("[clock]\nduration_s = 16\nstop = \"duration\"\n[defaults]\nplanner = \"straight\"\nradius_m = 0.2\n\
         [[robot]]\nid = \"pusher\"\nstart_m = [-3, 0]\ngoal_m = [4, 0]\nmass_kg = 5\n\
         [[robot]]\nid = \"b\"\nstart_m = [0, 0]\ngoal_m = [0, 4]\nrestart = \"on-failure\"\nrestart_delay_s = 6\n\
         [[event]]\nat_s = 0.04\nkind = \"kill\"\nrobot = \"b\"\n");
    let dead: Vec<Point2<f64>> = recording.frames[..300].iter().filter_map(|frame| frame.robot(1)).map(at).collect();
    assert!(dead.last().is_some_and(|p| p.x > 0.3), "it was pushed: {:?}", dead.last());
    assert!((end(&recording, 1) - Point2::new(0.0, 4.0)).norm() < 0.2, "{}", end(&recording, 1));
    assert!((end(&recording, 0) - Point2::new(4.0, 0.0)).norm() < 0.2, "{}", end(&recording, 0));
    assert_eq!(recording.outcome.robots[1].incarnation, 1);
}

/// Robots that come, go and come again: a place that was left is free, and nothing stays behind that could be run into.
#[test]
fn a_robot_that_left_is_not_in_the_way() {
    let recording = run("[clock]\nduration_s = 10\n[defaults]\nplanner = \"straight\"\nradius_m = 0.3\n\
         [[robot]]\nid = \"a\"\nstart_m = [-3, 0]\ngoal_m = [3, 0]\n\
         [[robot]]\nid = \"b\"\nstart_m = [0, 0]\ngoal_m = [0, 0.05]\n\
         [[event]]\nat_s = 1\nkind = \"leave\"\nrobot = \"b\"\n");
    assert_eq!((recording.outcome.robot_contacts, recording.outcome.robots[0].arrived), (0, true));
}

/// Whole crowds of all kinds among moving obstacles: no body is ever inside another one by more than a crowd's weight can
/// press, and the run is the same twice.
#[test]
fn crowds_stay_solid() {
    let text = "[clock]\nduration_s = 8\n[defaults]\nplanner = \"straight\"\nradius_m = 0.2\n\
         [layout]\nkind = \"circle-swap\"\nrobots = 9\nradius_m = 3\njitter_m = 0.3\n\
         [[robot]]\nid = \"w0\"\nkind = \"diff-drive\"\nstart_m = [0.2, 0.7]\ngoal_m = [3, 3]\n\
         [[robot]]\nid = \"w1\"\nkind = \"unicycle\"\nstart_m = [0.4, -0.7]\ngoal_m = [-3, 3]\n\
         [[obstacle]]\nshape = \"disc\"\ncenter_m = [1.2, 0]\nradius_m = 0.3\n\
         motion = { kind = \"bounce\", velocity_mps = [0.4, 0.3], x_m = [-3, 3], y_m = [-3, 3] }\n";
    let (once, twice) = (run(text), run(text));
    assert_eq!(once.outcome.trajectory_hash, twice.outcome.trajectory_hash);
    assert!(once.outcome.robot_contacts > 5, "{:?}", once.outcome.robot_contacts);
    let clearance = once.outcome.min_clearance_m.expect("there are others");
    assert!(clearance > -2e-3, "{clearance}");
    let clearance = once.outcome.min_obstacle_clearance_m.expect("there is one");
    assert!(clearance > -2e-3, "{clearance}");
}
