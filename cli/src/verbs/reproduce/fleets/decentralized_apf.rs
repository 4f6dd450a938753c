//! The scenes with several robots, each robot a process. The oracle is the one-thread stepper of `reproduce`
//! with poses that are a tick old and whose age is known, as they are between processes.

use super::{Ran, Stop, begin, lockstep};
use model::{BodyKind, Scenario};
use reproduce::decentralized_apf::run as one_thread;
use reproduce::row::{Item, Rows};
use reproduce::scene::{Scene, scenes_of};
use reproduce::stepper::{Rules, Run, tidy};

/// The scenes.
pub(super) fn scenes() -> impl Iterator<Item = &'static Scene> {
    scenes_of("apf_").filter(|scene| scene.scenario.robots.len() > 1)
}

pub(super) fn run(rows: &mut Rows<'_>) -> Result<(), Stop> {
    for scene in scenes() {
        begin(rows, &format!("{} as processes", scene.name))?;
        let run = one_thread(scene, "recommended", BodyKind::Point);
        let method = format!("scene {}, every robot a process, lockstep: {}", scene.name, run.words());
        let Ran { outcome: ours, unusable } = lockstep(as_processes(&run))?;
        rows.about(
            "the one-thread stepper of `reproduce` with poses one tick old, in place of the specification's oracle",
            method,
            "the specification's for arrival times and clearances",
        );
        let rules = Rules::as_in_a_fleet(run.rules.dt_s);
        let oracle = run.under(rules).run();
        let item = |what: &str| {
            Item::new(format!("{} recommended-point, every robot a process in lockstep: {what}", scene.name))
        };
        if let Some(because) = unusable {
            rows.no_evidence(item("arrivals and clearances"), None, &because, false);
            continue;
        }
        let tolerance = if scene.name == "apf_antipodal8" { 2.5 } else { 0.3 };
        for (i, expected) in (0..oracle.bodies().len()).map(|i| (i, oracle.arrival_s(i))) {
            let time_s = ours.robots.iter().find(|robot| robot.robot.at() == i).and_then(|robot| robot.time_s);
            let item = item(&format!("arrival of robot {i}"));
            match (expected, time_s) {
                (Some(expected), Some(time_s)) => rows.number(item, tidy(expected), tidy(time_s), tolerance, "s"),
                _ => {
                    let word = |time_s: Option<f64>| time_s.map_or("never".to_owned(), |time_s| format!("{time_s} s"));
                    rows.exact(item, word(expected), word(time_s));
                }
            }
        }
        let clearance = ours.min_clearance_m.unwrap_or(f64::INFINITY);
        // Here it is swept between the ticks; robots that chatter for ever come nearer there, by what both move in one.
        let (tolerance, note) = match oracle.all_arrived() {
            true => (0.02, "ours is swept between ticks, the oracle's is sampled at them"),
            false => {
                (0.1, "ours is swept between ticks, where two robots that chatter come nearer by what they move in one")
            }
        };
        let item = item("robot clearance").why(note);
        rows.number(item, tidy(oracle.robots.clearance_m), tidy(clearance), tolerance, "m");
    }
    Ok(())
}

/// The same robots, each a process. What they come to is compared, so contacts are no failure.
fn as_processes(run: &Run) -> Scenario {
    let mut scenario = run.scenario.clone();
    scenario.expect.contacts_max = u64::MAX;
    scenario
}
