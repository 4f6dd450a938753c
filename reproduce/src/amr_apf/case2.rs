//! Case 2 with the authors' programs of 2023: eight robots in twelve layouts of random pillars.

use super::early::{RANGE_NOTE, TIME_S, around, nearby_range};
use super::layouts::{case2, extra22};
use super::oracle::{ORACLE, authors_best, hundredth, list, number};
use super::reduction_percent;
use super::replay::{Outcome, Program, amr, dapf};
use crate::row::{Item, Rows};
use crate::scene::Scene;
use planners::amr_apf::Preset;
use planners::dapf::Variant;
use serde_json::Value;
use std::ops::ControlFlow;

/// The specification's replays gave up after this time.
const CASE2_S: f64 = 150.0;

/// The methods of the case 2 table.
fn case2_methods() -> [(&'static str, Program); 5] {
    [
        ("DAPF_max3", dapf(Variant::Max3)),
        ("DAPF_max4", dapf(Variant::Max4)),
        ("DAPF_linear", dapf(Variant::Lin)),
        ("AMR_C1", amr(Preset::C1)),
        ("AMR_0623", amr(Preset::P)),
    ]
}

/// At the real control rate with 8 robots the motion between two cycles goes in two steps.
fn with_rate(program: Program, dt_s: f64) -> Program {
    Program { substeps: if dt_s > 0.1 { 2 } else { 1 }, ..program }.with_period(dt_s).for_seconds(CASE2_S)
}

/// K10, K11 and the reductions of case 2.
pub(super) fn rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    let layouts = case2();
    for dt_s in [0.1, 0.22] {
        let mut times: Vec<Vec<Option<f64>>> = Vec::new();
        for (name, program) in case2_methods() {
            rows.begin(&format!("case 2, {name}, period {dt_s} s"))?;
            let program = with_rate(program, dt_s);
            let oracle = list(&ORACLE["case2_o15_replay"][format!("{name}_dt{dt_s:.2}")]);
            let mut column = Vec::new();
            for (i, (layout, oracle)) in layouts.iter().zip(oracle).enumerate() {
                let outcome = program.run(layout);
                column.push(outcome.all_arrived().then(|| outcome.time_s()));
                let key = (i + 1).to_string();
                let table = if name.starts_with("AMR") { "case2_o15_AMR" } else { "case2_o15_DAPF" };
                let paper_value = matches!(name, "AMR_C1" | "DAPF_max3")
                    .then(|| authors_best(table, &key).map_or("none".to_owned(), |(t, _)| format!("{t} s")))
                    .map(|text| format!("{text} (Gazebo)"));
                let item = Item::new(format!("{}, {name}, period {dt_s} s: time", layout.name));
                case2_row(rows, Item { paper_value, ..item }, &program, layout, &outcome, oracle);
            }
            times.push(column);
        }
        reductions(rows, dt_s, &times);
    }
    rows.begin("case 2, K10")?;
    for (name, variant) in [
        ("max3", Variant::Max3),
        ("max4", Variant::Max4),
        ("lin", Variant::Lin),
        ("const", Variant::Const),
        ("H", Variant::H),
    ] {
        for layout in [&layouts[3], &layouts[5]] {
            let outcome = dapf(variant).for_seconds(CASE2_S).run(layout);
            let item = Item::new(format!("K10 {}, DAPF-{name}: all 8 arrive within 150 s", layout.name));
            rows.exact(item, false, outcome.all_arrived());
        }
    }
    ControlFlow::Continue(())
}

fn case2_row(rows: &mut Rows<'_>, item: Item, program: &Program, layout: &Scene, outcome: &Outcome, oracle: &Value) {
    let words = |time_s: Option<f64>| time_s.map_or("not all arrive".to_owned(), |t| format!("{t:.1} s"));
    let (expected, ours) = (oracle.as_f64(), outcome.all_arrived().then(|| outcome.time_s()));
    let same = match (expected, ours) {
        (Some(expected), Some(ours)) => (expected - ours).abs() <= TIME_S,
        (None, None) => true,
        _ => false,
    };
    if same {
        rows.push(item, Some(words(expected)), words(ours), format!("± {TIME_S} s"), true);
        return;
    }
    let (tolerance, ok) = nearby_range(program, layout, outcome, |found| match expected {
        Some(time_s) => around(found, time_s),
        None => found.iter().any(|outcome| !outcome.all_arrived()),
    });
    rows.push(item.note(RANGE_NOTE), Some(words(expected)), words(ours), tolerance, ok);
}

/// Mean of the reductions per layout, over the layouts that both finish.
fn mean_reduction(times: &[Option<f64>], base: &[Option<f64>]) -> f64 {
    let pairs = times.iter().zip(base).filter_map(|(ours, base)| ours.zip(*base));
    let each: Vec<f64> = pairs.map(|(ours, base)| reduction_percent(ours, base)).collect();
    each.iter().sum::<f64>() / each.len() as f64
}

fn reductions(rows: &mut Rows<'_>, dt_s: f64, times: &[Vec<Option<f64>>]) {
    let [max3, max4, lin, c1, p] = [0, 1, 2, 3, 4].map(|i| times[i].as_slice());
    let oracle = &ORACLE["case2_o15_replay"]["mean_reduction_percent"];
    let note = "our tolerance: the layouts that rounding decides move the mean by so much";
    for (key, ours, base) in
        [("C1_vs_max3", c1, max3), ("0623_vs_max3", p, max3), ("C1_vs_linear", c1, lin), ("C1_vs_max4", c1, max4)]
    {
        let item = Item::new(format!("case 2, period {dt_s} s, {key}: mean reduction")).note(note);
        let paper_value = (key == "C1_vs_max3").then(|| "about 27 %".to_owned());
        let expected = number(&oracle[key][format!("{dt_s:.2}")]);
        rows.number(Item { paper_value, ..item }, expected, hundredth(mean_reduction(ours, base)), 9.0, "%");
    }
    let ours = mean_reduction(c1, max3);
    let item = Item::new(format!("faithful: case 2, period {dt_s} s, C1 against DAPF-max3"));
    let ok = (18.0..=35.0).contains(&ours);
    let paper_value = Some("about 27 %".to_owned());
    rows.push(
        Item { paper_value, ..item },
        Some("18 to 35 %".to_owned()),
        format!("{ours:.1} %"),
        "range".to_owned(),
        ok,
    );
    let failures = |times: &[Option<f64>]| times.iter().filter(|time| time.is_none()).count();
    let item = Item::new(format!("faithful: case 2, period {dt_s} s, C1 fails no more often than DAPF-max3"));
    rows.exact(item, true, failures(c1) <= failures(max3));
    if dt_s == 0.1 {
        rows.exact(Item::new("K11 case 2, C1: layouts in which all arrive"), 12, 12 - failures(c1));
    }
}

/// The layouts with 22 pillars: the authors' runs are all there is to compare with.
pub(super) fn extra_rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    rows.begin("extra layouts with 22 pillars")?;
    let layouts = extra22();
    let [c1, max3, lin] =
        [amr(Preset::C1), dapf(Variant::Max3), dapf(Variant::Lin)].map(|program| -> Vec<Option<f64>> {
            let program = program.for_seconds(CASE2_S);
            let time = |outcome: Outcome| outcome.all_arrived().then(|| outcome.time_s());
            layouts.iter().map(|layout| time(program.run(layout))).collect()
        });
    let max3_note = "the authors do not say which baseline theirs was; with DAPF-lin the number comes out";
    for (name, base, note) in [("max3", &max3, max3_note), ("lin", &lin, "our tolerance")] {
        let item = Item::new(format!("extra layouts, C1 against DAPF-{name}: mean reduction")).note(note);
        rows.number(item, 28.4, hundredth(mean_reduction(&c1, base)), 15.0, "%");
    }
    let finished = |times: &[Option<f64>]| times.iter().flatten().count();
    let ours = format!("{} against {} of 12", finished(&c1), finished(&max3));
    let item = Item::new("faithful: extra layouts, C1 finishes no fewer than DAPF-max3");
    rows.push(item, None, ours, "no fewer".to_owned(), finished(&c1) >= finished(&max3));
    ControlFlow::Continue(())
}
