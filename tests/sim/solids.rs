//! Lazy bodies that cannot stop before a polygon: its inside is solid, so who gets in is driven out, and does not wander
//! about in there.

use model::BodyKind;
use nalgebra::Point2;
use planners::METHODS;
use scenarios::{Overrides, parse};
use shoal_tests::Recording;
use shoal_tests::recording::at;

/// A square between a robot and its goal.
fn scene(kind: BodyKind, accel_mps2: f64, start_y_m: f64, planner: &str) -> Recording {
    let text = format!(
        "[clock]\nduration_s = 60\n[defaults]\nkind = \"{}\"\naccel_mps2_max = {accel_mps2}\n\
         turn_accel_radps2_max = 4\nsensor_range_m = 3\n\
         [[robot]]\nid = \"a\"\nstart_m = [-6, {start_y_m}]\ngoal_m = [6, 0]\n\
         [[obstacle]]\nshape = \"polygon\"\ncorners_m = [[-1, -1], [1, -1], [1, 1], [-1, 1]]\n",
        kind.word()
    );
    let overrides = Overrides { planner: Some(planner.to_owned()), ..Overrides::default() };
    Recording::of(&parse("solid", &text, &overrides).unwrap_or_else(|problems| panic!("{problems}")))
}

/// How deep the centre came into the square, m (negative: how far off it stayed), the longest time that it was in there, s,
/// and whether it is there in the end.
fn inside(recording: &Recording) -> (f64, f64, bool) {
    let depth = |p: Point2<f64>| 1.0 - p.coords.amax();
    let depths: Vec<f64> = recording.frames.iter().filter_map(|frame| Some(depth(at(frame.robot(0)?)))).collect();
    let longest = depths.split(|depth| *depth <= 0.0).map(<[f64]>::len).max().unwrap_or(0);
    let ends_inside = depths.last().is_some_and(|depth| *depth > 0.0);
    (
        depths.into_iter().fold(f64::NEG_INFINITY, f64::max),
        longest as f64 * recording.scenario.clock.dt_s(),
        ends_inside,
    )
}

#[test]
fn bodies_that_brake_slowly_do_not_stay_in_a_polygon() {
    let mut wrong = Vec::new();
    for kind in [BodyKind::Point, BodyKind::Unicycle] {
        for method in METHODS.iter().filter(|method| method.kinds.contains(&kind) && method.name != "straight") {
            for accel_mps2 in [1.0, 0.5] {
                for start_y_m in [0.05, 0.7] {
                    let (deepest_m, longest_s, ends_inside) = inside(&scene(kind, accel_mps2, start_y_m, method.name));
                    // Those that look at least a second's way ahead, and those that begin to turn late.
                    let (may_m, may_s) = match (method.name, accel_mps2 < 1.0) {
                        ("liquid" | "liquid-online" | "pso-via-points" | "decentralized-apf", _) => (0.0, 0.0),
                        ("apf" | "rpoa", false) => (0.0, 0.0),
                        (_, false) => (0.3, 2.0),
                        (_, true) => (0.8, 4.0),
                    };
                    if deepest_m > may_m || longest_s > may_s || ends_inside {
                        wrong.push(format!(
                            "{} {kind:?}, {accel_mps2} m/s², from {start_y_m}: {deepest_m:.3} m, {longest_s:.2} s, {ends_inside}",
                            method.name
                        ));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
