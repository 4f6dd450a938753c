//! A small sweep, and fabricated runs.

use model::Mode;
use shoal_sweep::execute;
use shoal_sweep::plan::SCHEMA;
use shoal_sweep::{Plan, Record, ScenarioSource, Varied};

/// Two robots that meet head-on, with starts that depend on the seed.
const PAIR: &str = "\
[clock]
tick_hz = 10
duration_s = 8
[layout]
kind = \"circle-swap\"
robots = 2
radius_m = 2
jitter_m = 0.3
";

/// Two scenarios, two planners, two tick rates, two seeds: 16 short runs.
pub(crate) fn plan() -> Plan {
    Plan {
        schema: SCHEMA.to_owned(),
        shoal: "0.1.0".to_owned(),
        build: "b".to_owned(),
        mode: Mode::Single,
        scenarios: vec![
            ScenarioSource::new("pair.toml", PAIR),
            ScenarioSource::new("three.toml", PAIR.replace("robots = 2", "robots = 3")),
        ],
        planners: vec!["straight".to_owned(), "amr-apf".to_owned()],
        set: vec!["defaults.speed_mps_max=1.5".to_owned()],
        varied: vec![Varied::parse("clock.tick_hz=10,20").unwrap()],
        seeds: vec![3, 1],
    }
}

/// The record of a run, as a line has it.
pub(crate) fn record(plan: &Plan, index: usize) -> Record {
    let run = plan.run(index);
    let record = execute::single(&run, run.scenario().unwrap(), &|| true).unwrap().expect("it was not broken off");
    Record::parse(&record.line()).unwrap()
}

/// All records of a plan.
pub(crate) fn records(plan: &Plan) -> Vec<Record> {
    (0..plan.runs()).map(|index| record(plan, index)).collect()
}
