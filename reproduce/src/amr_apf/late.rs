//! The authors' program of 2025 (preset `h` and its baseline): counts of control steps, to the last one.

use super::layouts::{case1, case2};
use super::moved::{KNOWN, RANK_WHY, median_row};
use super::oracle::{ORACLE, VECTORS, by_robots, count, list, number, text};
use super::replay::{Outcome, Program, amr, amr_without_clusters, dapf};
use crate::row::{Item, Rows};
use planners::amr_apf::{self, Preset};
use planners::dapf::Variant;
use std::ops::ControlFlow;

/// Half of the last printed digit of a distance.
const DISTANCE_M: f64 = 0.000_51;
/// K5.
const SNAPSHOT: f64 = 1e-3;

/// Moved starts per median; the specification took 11.
const SEEDS: u64 = 33;
/// Moved starts of the specification.
const SPECIFIED: usize = 11;
/// The three methods, with their names in the oracle file.
pub(super) fn methods() -> [(&'static str, Program); 3] {
    [
        ("DAPF", dapf(Variant::H)),
        ("AMR_no_clusters", amr_without_clusters(Preset::H)),
        ("AMR_with_clusters", amr(Preset::H)),
    ]
}

/// K2-K5, K13, and what sgn(0) changes.
pub(super) fn case1_rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    for (name, program) in methods() {
        rows.begin(&format!("H, case 1, {name}"))?;
        rows.about(
            "specification, section 5.2, K2 to K4 and K13, and its oracle file",
            format!("case 1 (amr-case1) from nominal starts: {name} of the program of 2025 (preset h, variant h), robots one after the other, 0.05 s"),
            "exact step counts; half of the last printed digit of distances",
        );
        for (robots, oracle) in by_robots(&ORACLE["H"][name]) {
            let outcome = program.run(&case1(robots));
            steps_row(rows, name, robots, oracle, &outcome);
            if robots == 5 {
                per_robot_row(rows, name, &outcome);
            }
            distance_rows(rows, name, robots, &outcome);
        }
    }
    rows.begin("H, snapshots of two robots")?;
    snapshots(rows);
    sgn(rows);
    ControlFlow::Continue(())
}

fn steps_row(rows: &mut Rows<'_>, name: &str, robots: usize, oracle: &serde_json::Value, outcome: &Outcome) {
    let check = if name == "DAPF" { "K2" } else { "K3, K4" };
    let item = Item::new(format!("{check} H case 1, {name}, {robots} robots: steps of the slowest"));
    match (name, robots) {
        ("DAPF", 10) => {
            let item = item.note("the last bits of sine and cosine decide; the specification saw 2598, 2601 and 2603");
            let ours = outcome.slowest().unwrap_or(0) as f64;
            rows.push(
                item,
                Some(text(oracle).to_owned()),
                ours.to_string(),
                "2600 ± 5".to_owned(),
                (ours - 2600.0).abs() <= 5.0,
            );
        }
        ("DAPF", 14) => {
            let never = outcome.steps.iter().filter(|steps| steps.is_none()).count();
            let ours = format!("{} never arrives", if never == 1 { "one robot".to_owned() } else { never.to_string() });
            rows.exact(item, text(oracle).to_owned(), ours);
        }
        _ => rows.exact(item, count(oracle), outcome.slowest().unwrap_or(0)),
    }
}

fn per_robot_row(rows: &mut Rows<'_>, name: &str, outcome: &Outcome) {
    let oracle: Vec<usize> = list(&ORACLE["H"][format!("{name}_per_robot_steps_n5")]).iter().map(count).collect();
    let ours: Vec<usize> = outcome.steps.iter().map(|steps| steps.unwrap_or(0)).collect();
    let item = Item::new(format!("H case 1, {name}, 5 robots: steps of each"));
    rows.exact(item, format!("{oracle:?}"), format!("{ours:?}"));
}

/// K13, for the numbers of robots that the specification lists.
fn distance_rows(rows: &mut Rows<'_>, name: &str, robots: usize, outcome: &Outcome) {
    let listed: [(usize, [f64; 6]); 5] = [
        (2, [0.745, 0.420, 0.848, 0.519, 0.848, 0.519]),
        (5, [0.470, 0.406, 0.458, 0.514, 0.510, 0.518]),
        (8, [0.484, 0.406, 0.371, 0.515, 0.390, 0.509]),
        (12, [0.453, 0.406, 0.299, 0.345, 0.348, 0.396]),
        (15, [0.446, 0.406, 0.364, 0.274, 0.312, 0.326]),
    ];
    let column = match name {
        "DAPF" => 0,
        "AMR_no_clusters" => 2,
        _ => 4,
    };
    for (_, oracle) in listed.iter().filter(|(n, _)| *n == robots) {
        let item =
            Item::new(format!("K13 H case 1, {name}, {robots} robots: nearest robots, nearest pillar (centres)"));
        let ours = [outcome.robots_m, outcome.pillars_m];
        rows.vector(item, [oracle[column], oracle[column + 1]], ours, DISTANCE_M, "m");
    }
}

fn snapshots(rows: &mut Rows<'_>) {
    rows.about(
        "specification, section 5.2, K5",
        "case 1 with two robots from nominal starts, program of 2025",
        "the specification's: 1e-3",
    );
    for case in list(&VECTORS["trajectory_H"]) {
        let method = text(&case["method"]);
        let program = if method == "DAPF" { dapf(Variant::H) } else { amr_without_clusters(Preset::H) };
        let outcome = program.run(&case1(count(&case["n"])));
        for snapshot in list(&case["snapshots"]) {
            let step = count(&snapshot["step"]);
            for (robot, oracle) in list(&snapshot["poses"]).iter().enumerate() {
                let oracle = [0, 1, 2].map(|i| number(&oracle[i]));
                let body = &outcome.poses[step - 1][robot];
                let ours = [body.position.x, body.position.y, body.yaw_rad];
                let ok = oracle.iter().zip(ours).all(|(oracle, ours)| (oracle - ours).abs() <= SNAPSHOT);
                let item = Item::new(format!("K5 H {method}, robot {}, pose after step {step}", robot + 1));
                let text = |p: [f64; 3]| format!("({:.4}, {:.4}, {:.4})", p[0], p[1], p[2]);
                rows.push(item, Some(text(oracle)), text(ours), format!("± {SNAPSHOT} each"), ok);
            }
        }
        let oracle: Vec<usize> = list(&case["steps_per_robot"]).iter().map(count).collect();
        let ours: Vec<usize> = outcome.steps.iter().map(|steps| steps.unwrap_or(0)).collect();
        rows.exact(Item::new(format!("K5 H {method}: steps of each")), format!("{oracle:?}"), format!("{ours:?}"));
    }
}

/// Section 6.4: what production's sgn(0) = +1 does to the counts.
fn sgn(rows: &mut Rows<'_>) {
    rows.about("specification, section 6.4", "case 1, preset h without clusters and with sgn(0) = +1", "exact");
    let params = amr_apf::Params { exact: true, clusters: amr_apf::Which::Off, ..amr_apf::Params::of(Preset::H) };
    for (robots, oracle) in [(12, 1088), (13, 1294), (14, 1511), (15, 1072)] {
        let ours = Program::amr(params.clone()).run(&case1(robots)).slowest().unwrap_or(0);
        let item = Item::new(format!("H case 1, AMR without clusters, sgn(0) = +1, {robots} robots: steps"));
        rows.exact(item, oracle, ours);
    }
}

/// K11 and the rest of case 2.
pub(super) fn case2_rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    for (name, program) in methods() {
        rows.begin(&format!("H, case 2, {name}"))?;
        rows.about(
            "specification, section 5.2, K11, and its oracle file",
            format!("case 2 (amr-case2-01 to -12) from nominal starts: {name} of the program of 2025"),
            "the specification's for simulated runs: 2 % or one step; layouts are stored to 0.1 mm",
        );
        for (layout, oracle) in case2().iter().zip(list(&ORACLE["H_case2_o15"][name])) {
            let (outcome, specified) = (program.run(layout), text(oracle).to_owned());
            let item = Item::new(format!("K11 H {}, {name}: steps of the slowest : robots arrived", layout.name));
            let [steps, arrived] = [0, 1].map(|i| specified.split(':').nth(i).and_then(|n| n.parse::<usize>().ok()));
            let steps = steps.unwrap_or(0);
            let found = outcome.slowest().unwrap_or(program.steps_max);
            let tolerance = (steps / 50).max(1);
            let ok = Some(outcome.arrived()) == arrived && steps.abs_diff(found) <= tolerance;
            let ours = words(&program, &outcome);
            rows.push(item, Some(specified), ours, format!("2 %, {tolerance} steps; arrivals exact"), ok);
        }
    }
    ControlFlow::Continue(())
}

fn words(program: &Program, outcome: &Outcome) -> String {
    let slowest = outcome.slowest().unwrap_or(program.steps_max);
    format!("{slowest}:{}", outcome.arrived())
}

/// Medians over starts moved by up to 3 cm.
pub(super) fn jitter_rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    let [(_, baseline), (_, without), (_, with)] = methods();
    let listed = by_robots(&ORACLE["jitter_medians"]["H_steps_pm3cm_11_seeds"]);
    for (robots, oracle) in listed.into_iter().filter(|(robots, _)| *robots <= KNOWN) {
        for (key, program) in [("DAPF", &baseline), ("AMR", &without), ("AMR_clusters", &with)] {
            rows.begin(&format!("H, case 1, {key}, {robots} robots, moved starts"))?;
            rows.about(
                "specification, section 5.3, and its oracle file",
                format!(
                    "case 1, {robots} robots, {key} of the program of 2025, {SEEDS} sets of starts moved by up to 3 cm"
                ),
                RANK_WHY,
            );
            let outcomes = program.run_jittered(&case1(robots), SEEDS, 0.03);
            let name = format!("H case 1, {key}, {robots} robots, starts moved by 3 cm");
            let steps = outcomes.iter().filter_map(Outcome::slowest).map(|steps| steps as f64).collect();
            let item = format!("{name}: median steps");
            median_row(rows, item, number(&oracle[key]), steps, SPECIFIED, [0.5, 1.0], "steps");
        }
    }
    ControlFlow::Continue(())
}
