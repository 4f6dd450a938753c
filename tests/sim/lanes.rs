//! The crowd planner in crowds: all robots arrive and no bodies touch, with one set of parameters, in rings, circles of
//! unequal robots, corridors, doors and crossings, at coarse ticks, for bodies of three sizes.

use scenarios::Overrides;
use shoal_tests::{Recording, build};
use std::f64::consts::TAU;
use std::fmt::Write;

/// A scene for robots of radius 0.2 m and 1 m/s, before it is scaled.
struct Scene {
    name: String,
    tick_hz: f64,
    /// Start, goal, radius.
    robots: Vec<([f64; 2], [f64; 2], f64)>,
    /// Corners of blocks: lowest and highest.
    blocks: Vec<[[f64; 2]; 2]>,
}

/// A number from 0 to 1 that looks like chance.
fn chance(index: usize, salt: usize) -> f64 {
    let mixed = ((index * 7919 + salt * 104_729 + 12_345) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed >> 40) as f64 / (1u64 << 24) as f64
}

fn ring(count: usize, radius_m: f64) -> Scene {
    let at = |index: usize| {
        [(index as f64 / count as f64 * TAU).cos() * radius_m, (index as f64 / count as f64 * TAU).sin() * radius_m]
    };
    let robots = (0..count).map(|index| (at(index), at(index).map(|x| -x), 0.2)).collect();
    Scene { name: format!("ring of {count}"), tick_hz: 6.7, robots, blocks: Vec::new() }
}

/// Unequal robots on a circle that is not evenly filled.
fn circle(count: usize, radius_m: f64) -> Scene {
    let robots = (0..count).map(|index| {
        let angle = (index as f64 + 0.3 * chance(index, 1)) / count as f64 * TAU;
        let at = [angle.cos() * radius_m, angle.sin() * radius_m];
        (at, at.map(|x| -x), 0.12 + 0.08 * chance(index, 2))
    });
    Scene { name: format!("circle of {count}"), tick_hz: 10.0, robots: robots.collect(), blocks: Vec::new() }
}

/// Two groups that change places through what is left between two blocks.
fn through(name: &str, per_side: usize, width_m: f64, depth_m: f64, both: bool) -> Scene {
    let (half, rows) = (0.5 * width_m, 4);
    let mut robots = Vec::new();
    for index in 0..per_side {
        let (row, column) = (index % rows, index / rows);
        let y = (row as f64 - 1.5) * 0.8;
        let x = depth_m * 0.5 + 1.0 + 0.8 * column as f64;
        robots.push(([-x, y], [depth_m + 2.4 - 0.8 * column as f64, y], 0.2));
        if both {
            robots.push(([x, -y], [-(depth_m + 2.4 - 0.8 * column as f64), -y], 0.2));
        }
    }
    let x = 0.5 * depth_m;
    let blocks = vec![[[-x, half], [x, 6.0]], [[-x, -6.0], [x, -half]]];
    Scene { name: format!("{name} of {per_side}, {width_m} m wide"), tick_hz: 12.5, robots, blocks }
}

/// Four that cross between four blocks.
fn crossing() -> Scene {
    let ends = [[-4.0, 0.1], [4.0, -0.1], [0.1, 4.0], [-0.1, -4.0]];
    let robots = ends.iter().map(|at| (*at, at.map(|x| -x), 0.2)).collect();
    let sides = [[0.7, 3.0], [-3.0, -0.7]];
    let blocks = sides.iter().flat_map(|x| sides.iter().map(move |y| [[x[0], y[0]], [x[1], y[1]]])).collect();
    Scene { name: "crossing".to_owned(), tick_hz: 15.0, robots, blocks }
}

impl Scene {
    /// The scenario for bodies `size` times as large and `speed` times as fast; starts are moved a little by the seed.
    fn text(&self, size: f64, speed: f64, seed: usize) -> String {
        let edge_m = 9.0 * size;
        let mut text = format!(
            "[world]\nx_m = [-{edge_m}, {edge_m}]\ny_m = [-{edge_m}, {edge_m}]\n[clock]\ntick_hz = {}\n\
             duration_s = {}\n[defaults]\nplanner = \"lanes\"\nknows_map = true\nspeed_mps_max = {speed}\n\
             sensor_range_m = {}\nradio_range_m = {}\ngoal_tolerance_m = {}\n",
            self.tick_hz * speed / size,
            90.0 * size / speed,
            6.0 * size,
            8.0 * size,
            0.15 * size
        );
        for (index, (start, goal, radius)) in self.robots.iter().enumerate() {
            let moved = |axis: usize| start[axis] + 0.02 * seed.min(1) as f64 * (chance(index, 2 * seed + axis) - 0.5);
            let [x, y] = [moved(0), moved(1)].map(|x| x * size);
            let [gx, gy] = goal.map(|x| x * size);
            writeln!(
                text,
                "[[robot]]\nid = \"r{index:02}\"\nstart_m = [{x}, {y}]\ngoal_m = [{gx}, {gy}]\nradius_m = {}",
                radius * size
            )
            .unwrap();
        }
        for [low, high] in &self.blocks {
            let ([x, y], [u, v]) = (low.map(|x| x * size), high.map(|x| x * size));
            let corners = format!("[[{x}, {y}], [{u}, {y}], [{u}, {v}], [{x}, {v}]]");
            writeln!(text, "[[obstacle]]\nshape = \"polygon\"\ncorners_m = {corners}").unwrap();
        }
        text
    }
}

fn scenes() -> Vec<Scene> {
    vec![
        ring(2, 3.0),
        ring(6, 4.0),
        ring(15, 4.0),
        ring(22, 4.0),
        circle(14, 3.4),
        circle(30, 4.2),
        through("corridor", 5, 2.8, 6.0, true),
        through("door one way", 12, 1.2, 0.16, false),
        through("door both ways", 3, 1.2, 0.16, true),
        through("door both ways", 5, 1.6, 0.16, true),
        crossing(),
    ]
}

#[test]
fn all_robots_arrive_and_no_bodies_touch() {
    for scene in scenes() {
        for (size, speed, seed) in [(1.0, 1.0, 0), (1.0, 1.0, 1), (0.35, 0.15, 2), (12.5, 15.0, 3)] {
            let what = format!("{}, {size} times as large, {speed} m/s, seed {seed}", scene.name);
            let report = Recording::of(&build::scenario(&scene.text(size, speed, seed))).report();
            let found = &report.outcome;
            assert_eq!((found.robot_contacts, found.obstacle_contacts), (0, 0), "{what}: {:?}", found.min_clearance_m);
            assert_eq!(found.arrived as usize, scene.robots.len(), "{what}");
        }
    }
}

/// When the last one arrives, s, with starts that are moved a little: the median of five runs.
fn makespan_s(scene: &Scene) -> f64 {
    let mut times_s: Vec<f64> = (1..6)
        .map(|seed| {
            let report = Recording::of(&build::scenario(&scene.text(1.0, 1.0, seed))).report();
            report.outcome.makespan_s.unwrap_or(f64::INFINITY)
        })
        .collect();
    times_s.sort_by(f64::total_cmp);
    times_s[2]
}

/// All robots from one side go through a narrow door before those from the other side, even if their ways are shorter.
#[test]
fn they_go_through_a_narrow_door_side_by_side() {
    let times_s = [0.5, 0.6, 0.8].map(|width_m| makespan_s(&through("door both ways", 4, width_m, 0.6, true)));
    assert!(times_s.iter().all(|time_s| *time_s < 20.0), "{times_s:?}");
}

/// The outermost of a stream make room at the side for those beside them: two streams pass each other at full speed.
#[test]
fn streams_pass_each_other_without_a_wait() {
    let scene = through("corridor", 8, 3.5, 5.5, true);
    let time_s = makespan_s(&scene);
    assert!(time_s < 13.5, "{time_s}");
}

/// Two of eight drive by a method that tells nothing of what it is about.
#[test]
fn robots_that_tell_nothing_are_plain_bodies() {
    let mut text = ring(8, 3.0).text(1.0, 1.0, 0);
    text = text
        .replace("id = \"r01\"", "id = \"r01\"\nplanner = \"orca\"")
        .replace("id = \"r05\"", "id = \"r05\"\nplanner = \"orca\"");
    let report = Recording::of(&build::with(&text, &Overrides::default())).report();
    assert_eq!((report.outcome.arrived, report.outcome.robot_contacts), (8, 0), "{:?}", report.outcome.min_clearance_m);
}
