//! The authors' programs of 2023 (presets `c1` and `p`, and their baselines): times of the specification's replays, to
//! the printed digit where nothing is left to rounding; where rounding decides a run, each of its commands.

use super::commands::{Agreement, TOLERANCE};
use super::layouts::{case1, demos};
use super::oracle::{AUTHORS, ORACLE, authors_best, by_robots, count, hundredth, list, number};
use super::replay::{Outcome, Program, amr, dapf};
use crate::row::{Item, Rows};
use crate::scene::Scene;
use crate::stepper::{Body, Stepper};
use planners::amr_apf::Preset;
use planners::dapf::{self as baseline, Variant};
use serde_json::Value;
use std::ops::ControlFlow;

/// Half of the last printed digit of a time, of a path, of a distance.
pub(super) const TIME_S: f64 = 0.051;
const PATH_M: f64 = 0.0051;
const DISTANCE_M: f64 = 0.000_51;
/// Centres nearer than this are contacts: bodies side by side, body and pillar.
const CONTACT_M: [f64; 2] = [0.266, 0.233];
/// With more robots the rectangles around crowds of three are equally small, and rounding decides which one counts.
const DECIDED: usize = 3;

const COMMANDS_WHY: &str = "rounding, amplified by steep forces: 1e-9 m/s and rad/s. Of rectangles that are equally small \
                            (areas within 1e-9) any may count. No other rule gives the same commands in every state";

/// The methods of the case 1 table, with their names there and in the authors' results.
pub(super) fn case1_methods() -> [(&'static str, Program, Option<&'static str>); 5] {
    [
        ("DAPF_linear", dapf(Variant::Lin), Some(super::stored::LINEAR)),
        ("DAPF_constant", dapf(Variant::Const), Some(super::stored::CONSTANT)),
        ("DAPF_max4", dapf(Variant::Max4), None),
        ("AMR_C1", amr(Preset::C1), Some(super::stored::AMR)),
        ("AMR_0623", amr(Preset::P), None),
    ]
}

/// K6, K7, K13 and the rest of case 1.
pub(super) fn case1_rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    for (name, program, authors) in case1_methods() {
        let proposed = name.starts_with("AMR");
        let mut contacts = [Vec::new(), Vec::new()];
        let mut baseline = Agreement::default();
        for (robots, oracle) in by_robots(&ORACLE["P"][name]) {
            rows.begin(&format!("case 1, {name}, {robots} robots"))?;
            let layout = case1(robots);
            let method =
                format!("case 1 (amr-case1), {robots} robots, nominal starts: {name} at 10 Hz, all on one snapshot");
            rows.about(
                "specification, section 5.2, K6 and K7, and its oracle file",
                method.clone(),
                "half of the last printed digit: nothing is left to rounding",
            );
            let authors = authors
                .and_then(|table| authors_best(table, &robots.to_string()))
                .map(|(time_s, path_m)| format!("{time_s} s, {path_m} m (Gazebo)"));
            let outcome = program.run(&layout);
            let item = Item::new(format!("case 1, {name}, {robots} robots: replay")).authors(authors.clone());
            if !proposed || robots <= DECIDED {
                replay_row(rows, item, &layout, &outcome, oracle);
            }
            let agreement = program.commands(&layout);
            if proposed {
                let mut note = String::new();
                if robots > DECIDED {
                    let [theirs, ours] = [number(&oracle[0]), outcome.time_s()];
                    note = format!(
                        "rounding decides how long this run takes: {theirs:.1} s in the specification's replay, {ours:.1} s here"
                    );
                }
                let item = Item::new(format!("case 1, {name}, {robots} robots: commands along the run"));
                commands_row(rows, item.note(note).authors(authors).method(method), &agreement);
            } else {
                baseline.add(agreement);
            }
            let specified = [oracle[3].as_f64().unwrap_or(f64::INFINITY), number(&oracle[4])];
            for (contacts, nearest) in contacts.iter_mut().zip([[outcome.robots_m, outcome.pillars_m], specified]) {
                if nearest.iter().zip(CONTACT_M).any(|(distance, contact)| *distance < contact) {
                    contacts.push(robots.to_string());
                }
            }
        }
        if proposed {
            let [ours, specified] =
                contacts.map(|robots| if robots.is_empty() { "none".to_owned() } else { robots.join(", ") });
            let item = Item::new(format!("K13 case 1, {name}: fleets in which bodies touch"))
                .source("specification, section 5.2, K13")
                .method(
                    "centres of robots nearer than 0.266 m, of robot and pillar nearer than 0.233 m, nominal starts",
                )
                .why("exact; the planner has no guard against contact");
            rows.exact(item, specified, ours);
        } else {
            let item = Item::new(format!("case 1, {name}, 1 to 15 robots: commands along the runs"));
            commands_row(rows, item, &baseline);
        }
    }
    ControlFlow::Continue(())
}

/// Whether a run's commands are those of the specification's equations, all of them.
pub(super) fn commands_row(rows: &mut Rows<'_>, item: Item, agreement: &Agreement) {
    let Agreement { agree, all, first } = agreement;
    let item = item
        .source("specification, sections 3.1 to 3.10: its equations, written down a second time (reference.rs)")
        .why(COMMANDS_WHY);
    let item = match first {
        Some(first) => item.note(format!("the first that differs: {first}")),
        None => item,
    };
    let ours = format!("{agree} of {all} agree");
    rows.push(
        item,
        Some("the equations' in every state".to_owned()),
        ours,
        format!("± {TOLERANCE:e}"),
        agree == all && *all > 0,
    );
}

/// Time, arrivals, mean path, smallest distances.
fn replay_row(rows: &mut Rows<'_>, item: Item, layout: &Scene, outcome: &Outcome, oracle: &Value) {
    let (time_s, arrived, path_m) = (number(&oracle[0]), count(&oracle[1]), number(&oracle[2]));
    let words = |time_s: f64, arrived: usize, path_m: f64, robots_m: Option<f64>, pillars_m: f64| {
        let robots = robots_m.map_or("-".to_owned(), |d| format!("{d:.3}"));
        format!("{time_s:.1} s, {arrived} arrived, {path_m:.2} m; nearest {robots} m, {pillars_m:.3} m")
    };
    let expected = words(time_s, arrived, path_m, oracle[3].as_f64(), number(&oracle[4]));
    let robots_m = (layout.scenario.robots.len() > 1).then_some(outcome.robots_m);
    let ours = words(outcome.time_s(), outcome.arrived(), outcome.mean_path_m(), robots_m, outcome.pillars_m);
    let same = (outcome.time_s() - time_s).abs() <= TIME_S
        && outcome.arrived() == arrived
        && (outcome.mean_path_m() - path_m).abs() <= PATH_M
        && oracle[3].as_f64().zip(robots_m).is_none_or(|(oracle, ours)| (oracle - ours).abs() <= DISTANCE_M)
        && (outcome.pillars_m - number(&oracle[4])).abs() <= DISTANCE_M;
    rows.push(item, Some(expected), ours, "all printed digits".to_owned(), same);
}

/// K8, K9, K12, and single runs that the text mentions.
pub(super) fn single_rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    rows.begin("without pillars, demonstrations, late joiner")?;
    let mut empty = case1(1);
    empty.scenario.obstacles.clear();
    rows.about(
        "specification, section 5.2, K8",
        "case 1 without pillars, one robot, 10 Hz",
        "the specification's: 0.2 s",
    );
    for (name, program, oracle, authors) in
        [("DAPF-lin", dapf(Variant::Lin), 50.3, "51.8 s"), ("AMR", amr(Preset::P), 39.8, "40.8 s")]
    {
        let item = Item::new(format!("K8 case 1 without pillars, {name}, 1 robot: time"));
        let item = item.authors(Some(format!("{authors} (Gazebo)")));
        rows.number(item, oracle, hundredth(program.run(&empty).time_s()), 0.2, "s");
    }
    demo_rows(rows);
    rows.about(
        "specification, section 5.2, K12",
        "case 1 with two robots; after 50 (100) cycles a third one joins beside the first (a goal changes)",
        "exact",
    );
    late_joiner(rows);
    new_goal(rows);
    rows.begin("right of way in the baseline, rate fit")?;
    let fair =
        Program::dapf(baseline::Params { right_of_way: true, exact: true, ..baseline::Params::of(Variant::Const) });
    let item = Item::new("case 1, DAPF-const with a working right of way, 15 robots: time")
        .source("specification, section 3.10")
        .method("case 1, 15 robots, nominal starts, 10 Hz, variant const with right_of_way = true")
        .why("the specification's for simulated runs: 2 %");
    rows.number(item, 150.0, hundredth(fair.run(&case1(15)).time_s()), 3.0, "s");
    for (name, program) in [("C1", amr(Preset::C1)), ("DAPF-lin", dapf(Variant::Lin))] {
        let period_s: f64 = 0.045 + 0.0185 * 15.0;
        let program = Program { substeps: (period_s / 0.1).ceil() as u32, ..program }.with_period(period_s);
        let item = Item::new(format!("case 1, {name}, 15 robots, control rate of the fit: commands along the run"))
            .method(format!(
                "case 1, 15 robots, nominal starts, control period {period_s:.4} s as the authors' simulator ran"
            ))
            .note("single runs say little, says the specification: their times are not compared");
        commands_row(rows, item, &program.commands(&case1(15)));
    }
    ControlFlow::Continue(())
}

/// K9. The specification does not say which robot it moved to break the symmetry: all moves that it may mean are tried,
/// and one of them has to give its time and its separation together.
fn demo_rows(rows: &mut Rows<'_>) {
    let keys = ["single obstacle", "head-on", "crossing", "gate"];
    for (layout, key) in demos().iter().zip(keys) {
        let oracle = &ORACLE["demos_replay"][key];
        for (name, program) in [("AMR", amr(Preset::P)), ("DAPF", dapf(Variant::Max4))] {
            let program = program.for_seconds(100.0);
            let outcomes: Vec<Outcome> = moved(layout, key).iter().map(|layout| program.run(layout)).collect();
            rows.about(
                "paper, figures 4, 6, 7, 8; specification, section 4.3 and section 5.2, K9",
                format!("demonstration {key}, 10 Hz: {name}, {} small moves of one or all robots", outcomes.len()),
                "which robot was moved is not known, so one of the moves has to give the time, and in the same run the \
                 separation to 2 %. Times of the proposed method to the printed digit; those of the baseline, which the \
                 move decides, to the specification's 5 %",
            );
            let time_s = number(&oracle[name]);
            let apart_m = oracle.get("min_separation").map(|apart| number(&apart[name]));
            let time_tolerance_s = if name == "AMR" { TIME_S } else { 0.05 * time_s };
            let off = |outcome: &&Outcome| {
                let apart = apart_m.map_or(0.0, |apart_m| (outcome.robots_m / apart_m - 1.0).abs() / 0.02);
                let lost = if outcome.all_arrived() { 0.0 } else { f64::INFINITY };
                apart.max((outcome.time_s() - time_s).abs() / time_tolerance_s).max(lost)
            };
            let best = outcomes.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("there are moves");
            let words = |time_s: f64, apart_m: Option<f64>| match apart_m {
                Some(apart_m) => format!("{time_s:.1} s, {apart_m:.3} m apart"),
                None => format!("{time_s:.1} s"),
            };
            let ours = words(best.time_s(), apart_m.map(|_| best.robots_m));
            let item = Item::new(format!("K9 demonstration {key}, {name}: the nearest of the moves"));
            let ok = off(&best) <= 1.0;
            rows.push(
                item.authors(authors_demo(key, name)),
                Some(words(time_s, apart_m)),
                ours,
                format!("± {time_tolerance_s:.2} s, 2 %"),
                ok,
            );
        }
    }
}

fn authors_demo(key: &str, name: &str) -> Option<String> {
    let times = AUTHORS["demos"][key].get(name)?;
    let slowest = list(times).iter().map(number).fold(0.0, f64::max);
    let apart = AUTHORS["demos"][key].get("min_separation_m").map(|apart| format!(", {} m", number(&apart[name])));
    Some(format!("{slowest} s{} (Gazebo)", apart.unwrap_or_default()))
}

/// The layout with one robot, or all, moved as the specification says: x or y by 7 mm, 14 mm where they cross, and the
/// heading by 0.01 rad where they drive up or down.
fn moved(layout: &Scene, key: &str) -> Vec<Scene> {
    let robots = layout.scenario.robots.len();
    let size_m = if key == "crossing" { 0.014 } else { 0.007 };
    let mut all = Vec::new();
    for who in (0..robots).map(Some).chain([None]) {
        for (x, y) in [(size_m, 0.0), (0.0, size_m)] {
            for turn_rad in [0.0, 0.01] {
                let mut layout = layout.clone();
                let chosen = |i: usize| who.is_none_or(|who| who == i);
                for (_, robot) in layout.scenario.robots.iter_mut().enumerate().filter(|(i, _)| chosen(*i)) {
                    robot.start += nalgebra::Vector2::new(x, y);
                    robot.start_yaw_rad += turn_rad;
                }
                all.push(layout);
            }
        }
    }
    all
}

/// K12: a robot that joins a running job is seen in the next cycle, and all arrive.
fn late_joiner(rows: &mut Rows<'_>) {
    let program = amr(Preset::C1);
    let mut runs = two_runs(&program, 50);
    // It appears beside the first robot.
    let mut third = case1(3).scenario.robots.remove(2);
    third.start = runs[0].end(0) + nalgebra::Vector2::new(0.6, 0.1);
    program.prepare(&mut third);
    runs[1].join(third, program.planner(2));
    let [alone, joined] = runs.each_mut().map(after_a_step);
    let item = Item::new("K12 late joiner: the robot beside it reacts within one cycle");
    rows.exact(item, true, alone[0] != joined[0]);
    let [_, joined] = runs;
    rows.exact(Item::new("K12 late joiner: arrivals of 3"), 3, program.finish(joined).arrived());
}

/// Two robots of case 1 after this number of cycles, twice.
fn two_runs(program: &Program, cycles: usize) -> [Stepper; 2] {
    [0, 1].map(|_| {
        let mut run = program.begin(&case1(2));
        (0..cycles).for_each(|_| run.step());
        run
    })
}

/// The robots after one more cycle.
fn after_a_step(run: &mut Stepper) -> Vec<Body> {
    run.step();
    run.bodies().to_vec()
}

/// K12: a goal that changes on the way changes the robot's course in the next cycle, and all arrive.
fn new_goal(rows: &mut Rows<'_>) {
    let program = amr(Preset::P);
    let mut runs = two_runs(&program, 100);
    let goal = nalgebra::Point2::new(7.0, 4.9);
    runs[1].send(1, goal);
    let [old, new] = runs.each_mut().map(after_a_step);
    rows.exact(Item::new("K12 new goal: the robot turns within one cycle"), true, old[1] != new[1]);
    let [_, new] = runs;
    let outcome = program.finish(new);
    let off_m = outcome.poses.last().map_or(f64::NAN, |bodies| (bodies[1].position - goal).norm());
    rows.exact(Item::new("K12 new goal: arrivals of 2"), 2, outcome.arrived());
    rows.number(Item::new("K12 new goal: distance from it at the end"), 0.0, hundredth(off_m), 0.06, "m");
}
