//! The papers' fleets on wheels, in both worlds: what mass, grip and contacts change. The table of docs/methods.md:
//!
//! `SHOAL_WORLDS_STARTS=30 cargo test -p shoal-tests --test sim -- --nocapture both_worlds`
#![expect(clippy::print_stdout, reason = "the table is what one runs it for")]

use crate::amr_apf;
use model::{Outcome, Physics, Scenario};
use scenarios::{Overrides, parse};
use shoal_tests::catalog;
use std::ops::ControlFlow;

/// Starts of each fleet.
fn starts() -> u64 {
    amr_apf::starts("SHOAL_WORLDS_STARTS", 1)
}

/// As a TurtleBot3 Waffle has them, in the authors' simulator: 1 m/s² at the rim.
const WAFFLE: [&str; 5] =
    ["kind=\"diff-drive\"", "track_m=0.287", "wheel_radps_max=7.88", "wheel_accel_radps2_max=30", "mass_kg=1.8"];
/// Wheels for 1 m/s. The paper gives none.
const FAST: [&str; 6] = [
    "kind=\"diff-drive\"",
    "wheel_radius_m=0.05",
    "track_m=0.3",
    "wheel_radps_max=20",
    "wheel_accel_radps2_max=40",
    "mass_kg=5",
];

fn overrides(planner: &str, body: &[&str]) -> Overrides {
    let set = body.iter().map(|key| format!("defaults.{key}")).collect();
    Overrides { planner: Some(planner.to_owned()), set, ..Overrides::default() }
}

fn of_scene(name: &str, text: &str) -> Scenario {
    parse(name, text, &overrides("decentralized-apf", &FAST)).unwrap_or_else(|problems| panic!("{problems}"))
}

fn fleets() -> Vec<(&'static str, Scenario)> {
    let case1 = |planner| catalog("amr-case1", &overrides(planner, &WAFFLE));
    let mut default = case1("amr-apf");
    default.robots.iter_mut().for_each(|robot| robot.params.clear());
    vec![
        ("`amr-case1`, `amr-apf`", default),
        ("`amr-case1`, `amr-apf` with preset `c1`", case1("amr-apf")),
        ("`amr-case1`, `dapf`", case1("dapf")),
        (
            "`apf_cross4`, `decentralized-apf`",
            of_scene("cross4", include_str!("../../reproduce/scenes/apf_cross4.toml")),
        ),
        (
            "`apf_antipodal8`, `decentralized-apf`",
            of_scene("antipodal8", include_str!("../../reproduce/scenes/apf_antipodal8.toml")),
        ),
    ]
}

fn run(fleet: &Scenario, physics: Physics, seed: u64) -> Outcome {
    let scenario = Scenario { physics, ..amr_apf::moved(fleet, seed) };
    single::run(&scenario, &mut |_, _| ControlFlow::Continue(())).expect("the parameters fit")
}

/// What came of a fleet in one world, over all starts.
#[derive(Default)]
struct Came {
    arrived: usize,
    contacts: u64,
    /// When the last robot of a run arrived, s, for runs in which all did.
    times_s: Vec<f64>,
    ways_m: Vec<f64>,
}

impl Came {
    fn of(fleet: &Scenario, physics: Physics) -> Came {
        let mut came = Came::default();
        for seed in 1..=starts() {
            let outcome = run(fleet, physics, seed);
            came.contacts += outcome.robot_contacts + outcome.obstacle_contacts;
            came.arrived += outcome.robots.iter().filter(|robot| robot.arrived).count();
            if outcome.robots.iter().all(|robot| robot.arrived) {
                came.times_s.extend(outcome.robots.iter().filter_map(|robot| robot.time_s).max_by(f64::total_cmp));
            }
            let way_m: f64 = outcome.robots.iter().map(|robot| robot.path_length_m).sum();
            came.ways_m.push(way_m / outcome.robots.len() as f64);
        }
        came
    }
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[test]
fn the_papers_fleets_drive_in_both_worlds() {
    println!("| fleet | world | arrived | contacts | time, s | way, m |\n|---|---|---|---|---|---|");
    for (name, fleet) in fleets() {
        let all = fleet.robots.len() * starts() as usize;
        let came = [Physics::Kinematic, Physics::Rapier].map(|physics| (physics, Came::of(&fleet, physics)));
        for (physics, mut came) in came {
            let (time_s, way_m) = (median(&mut came.times_s), median(&mut came.ways_m).unwrap_or_default());
            let time = time_s.map_or("not all".to_owned(), |time_s| format!("{time_s:.1}"));
            println!(
                "| {name} | `{}` | {} of {all} | {} | {time} | {way_m:.2} |",
                physics.word(),
                came.arrived,
                came.contacts
            );
            // The others are the papers' own, and do not always keep clear in either world.
            if ["`amr-case1`, `amr-apf`", "`apf_cross4`, `decentralized-apf`"].contains(&name) {
                assert_eq!((came.arrived, came.contacts), (all, 0), "{name}, {physics:?}");
            }
        }
    }
}

/// What a robot meets that has nothing to push and enough grip is no more than the start and the end of its motion.
#[test]
fn a_robot_alone_drives_alike_in_both_worlds() {
    for planner in ["amr-apf", "dapf", "decentralized-apf", "apf", "straight"] {
        let mut fleet = catalog("amr-case1", &Overrides { robots: Some(1), ..overrides(planner, &WAFFLE) });
        // In long ticks it matters that solid wheels change their rates within a tick, and kinematic ones at its beginning.
        fleet.clock.ticks_max *= 5;
        fleet.clock.tick_hz = 50.0;
        if planner == "straight" {
            fleet.obstacles.clear();
        }
        let time_s =
            |physics| run(&fleet, physics, 1).robots[0].time_s.unwrap_or_else(|| panic!("{planner}: not there"));
        let (kinematic_s, rapier_s) = (time_s(Physics::Kinematic), time_s(Physics::Rapier));
        assert!((rapier_s / kinematic_s - 1.0).abs() < 0.02, "{planner}: {kinematic_s} and {rapier_s} s");
    }
}
