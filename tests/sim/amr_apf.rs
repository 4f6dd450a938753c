//! With the default of `amr-apf` every robot arrives without a contact in the paper's two experiments, from moved starts.
//!
//! `SHOAL_AMR_STARTS` is the number of starts of each of the 27 fleets; two unless it is set. From the usual 30:
//!
//! `SHOAL_AMR_STARTS=30 cargo test --release -p shoal-tests --test sim -- --nocapture amr_apf`
#![expect(clippy::print_stdout, reason = "the figures are what one runs it for")]

use model::random::Stream;
use model::{Outcome, ParamValue, ParamValues, Scenario};
use nalgebra::Vector2;
use scenarios::Overrides;
use shoal_tests::catalog;
use std::ops::ControlFlow;

/// How far a start is moved in x and in y, m.
const MOVED_M: f64 = 0.02;

/// The number of starts that a variable of the environment asks for.
#[expect(clippy::disallowed_methods, reason = "how many starts")]
pub(crate) fn starts(variable: &str, unset: u64) -> u64 {
    let text = std::env::var(variable).ok();
    text.map_or(unset, |text| text.parse().unwrap_or_else(|_| panic!("{variable}={text} is not a number")))
}

/// Case 1 with 1 to 15 robots, and the twelve layouts of case 2.
fn fleets() -> Vec<(String, Scenario)> {
    let growing = (1..=15).map(|robots| {
        let overrides = Overrides { robots: Some(robots), ..Overrides::default() };
        (format!("case 1, {robots} robots"), catalog("amr-case1", &overrides))
    });
    let layouts = (1..=12).map(|i| {
        let name = format!("amr-case2-{i:02}");
        (format!("layout {i}"), catalog(&name, &Overrides::default()))
    });
    growing.chain(layouts).collect()
}

/// A fleet whose starts are moved by chance, and the seed of everything else too.
pub(crate) fn moved(fleet: &Scenario, seed: u64) -> Scenario {
    let mut scenario = fleet.clone();
    scenario.clock.seed = seed;
    for (slot, robot) in (0..).zip(&mut scenario.robots) {
        let mut stream = Stream::new(seed, slot, 0, "amr-apf jitter");
        let mut offset = || stream.between(-MOVED_M, MOVED_M);
        robot.start += Vector2::new(offset(), offset());
    }
    scenario
}

fn run(fleet: &Scenario, params: &ParamValues, seed: u64) -> Outcome {
    let mut scenario = moved(fleet, seed);
    for robot in &mut scenario.robots {
        assert_eq!(robot.planner, "amr-apf");
        robot.params = params.clone();
    }
    single::run(&scenario, &mut |_, _| ControlFlow::Continue(())).expect("the parameters fit")
}

/// Runs every fleet from all starts; no contact is allowed, and every robot has to arrive.
fn check(what: &str, params: &[(&str, ParamValue)]) {
    let params: ParamValues = params.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
    let mut wrong = Vec::new();
    let (mut runs, mut nearest_m, mut slowest_s) = (0, f64::INFINITY, 0.0);
    for (name, fleet) in fleets() {
        for seed in 1..=starts("SHOAL_AMR_STARTS", 2) {
            let outcome = run(&fleet, &params, seed);
            runs += 1;
            for clearance_m in [outcome.min_clearance_m, outcome.min_obstacle_clearance_m].into_iter().flatten() {
                nearest_m = clearance_m.min(nearest_m);
            }
            slowest_s = outcome.robots.iter().filter_map(|robot| robot.time_s).fold(slowest_s, f64::max);
            let contacts = outcome.robot_contacts + outcome.obstacle_contacts;
            let robots = fleet.robots.len();
            let arrived = outcome.robots.iter().filter(|robot| robot.arrived).count();
            if contacts > 0 || arrived != robots {
                wrong.push(format!("{name}, start {seed}: {arrived} of {robots} arrived, {contacts} contacts"));
            }
        }
    }
    println!(
        "{what}: {runs} runs, {} wrong, clearance at least {nearest_m:.3} m, slowest {slowest_s:.1} s",
        wrong.len()
    );
    assert!(wrong.is_empty(), "{what}:\n{}", wrong.join("\n"));
}

#[test]
fn the_default_arrives_without_contact() {
    check("the default", &[]);
}

/// With zones as wide as in the authors' programs, which take robots and pillars for larger than they are.
#[test]
fn the_default_arrives_without_contact_with_wide_zones() {
    check("wide zones", &[("margin_m", ParamValue::Float(0.077)), ("safety_m", ParamValue::Float(0.09))]);
}

/// What the default adds is needed: without it, robots touch or stay behind.
#[test]
fn without_brakes_and_detours_they_do_not() {
    let fixed = ParamValues::from([("preset".to_owned(), ParamValue::Choice("fixed".to_owned()))]);
    let touched = fleets().into_iter().filter(|(_, fleet)| {
        let outcome = run(fleet, &fixed, 1);
        outcome.robot_contacts + outcome.obstacle_contacts > 0
    });
    assert!(touched.count() > 0);
}
