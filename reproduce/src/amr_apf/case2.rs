//! Case 2 with the authors' programs of 2023: eight robots in twelve layouts of random pillars.

use super::commands::Agreement;
use super::early::{TIME_S, commands_row};
use super::layouts::{case2, extra22};
use super::oracle::{ORACLE, authors_best, hundredth, list, number};
use super::replay::{Outcome, Program, amr, dapf};
use super::{reduction_percent, stored};
use crate::row::{Item, Rows};
use crate::scene::Scene;
use crate::stats;
use planners::amr_apf::Preset;
use planners::dapf::Variant;
use std::ops::ControlFlow;

/// The specification's replays gave up after this time.
const CASE2_S: f64 = 150.0;
/// Control periods, s: the nominal one, and that of the authors' simulator with eight robots.
pub(super) const PERIODS_S: [f64; 2] = [0.1, 0.22];

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
    for dt_s in PERIODS_S {
        for (name, program) in case2_methods() {
            rows.begin(&format!("case 2, {name}, period {dt_s} s"))?;
            runs_rows(rows, name, &with_rate(program, dt_s), dt_s);
        }
        rows.begin(&format!("case 2, period {dt_s} s, reductions"))?;
        let programs = [dapf(Variant::Max3), dapf(Variant::Lin), amr(Preset::C1)];
        reductions(rows, dt_s, &programs.map(|program| nearby(&with_rate(program, dt_s))));
    }
    rows.begin("case 2, K10")?;
    for layout in [&case2()[3], &case2()[5]] {
        let outcome = dapf(Variant::Const).for_seconds(CASE2_S).run(layout);
        let item = Item::new(format!("K10 {}, DAPF-const: all 8 arrive within 150 s", layout.name))
            .source("specification, section 5.2, K10")
            .method("case 2 at 10 Hz, nominal starts");
        rows.exact(item, false, outcome.all_arrived());
    }
    ControlFlow::Continue(())
}

/// The runs of a program from nominal starts: times of the baselines, commands of the proposed method, whose times
/// rounding decides.
fn runs_rows(rows: &mut Rows<'_>, name: &str, program: &Program, dt_s: f64) {
    let proposed = name.starts_with("AMR");
    let oracle = list(&ORACLE["case2_o15_replay"][format!("{name}_dt{dt_s:.2}")]);
    let words = |time_s: Option<f64>| time_s.map_or("not all arrive".to_owned(), |t| format!("{t:.1} s"));
    let mut baseline = Agreement::default();
    for (i, (layout, oracle)) in case2().iter().zip(oracle).enumerate() {
        rows.about(
            "specification, section 4.2, K10, K11, and its oracle file",
            format!(
                "case 2 layout {} (amr-case2-{:02}), nominal starts: {name}, control period {dt_s} s",
                i + 1,
                i + 1
            ),
            "the specification's for simulated runs: 2 % or one cycle; layouts are stored to 0.1 mm",
        );
        let key = (i + 1).to_string();
        let table = if proposed { "case2_o15_AMR" } else { "case2_o15_DAPF" };
        let authors = matches!(name, "AMR_C1" | "DAPF_max3")
            .then(|| authors_best(table, &key).map_or("none".to_owned(), |(t, _)| format!("{t} s")))
            .map(|text| format!("{text} (Gazebo)"));
        let agreement = program.commands(layout);
        let outcome = program.run(layout);
        let (specified, ours) = (oracle.as_f64(), outcome.all_arrived().then(|| outcome.time_s()));
        let what = format!("{}, {name}, period {dt_s} s", layout.name);
        if proposed {
            let note = format!(
                "rounding decides how long this run takes: {} in the specification's replay, {} here",
                words(specified),
                words(ours)
            );
            let item = Item::new(format!("{what}: commands along the run"));
            commands_row(rows, item.note(note).authors(authors), &agreement);
            continue;
        }
        baseline.add(agreement);
        let tolerance_s = specified.map_or(0.0, |time_s| (0.02 * time_s).max(dt_s));
        let ok = match (specified, ours) {
            (Some(specified), Some(ours)) => (specified - ours).abs() <= tolerance_s + TIME_S,
            (None, None) => true,
            _ => false,
        };
        let item = Item::new(format!("{what}: time")).authors(authors);
        let tolerance = if specified.is_some() { format!("± {tolerance_s:.2} s") } else { "exact".to_owned() };
        rows.push(item, Some(words(specified)), words(ours), tolerance, ok);
    }
    if !proposed {
        let item = Item::new(format!("case 2, {name}, period {dt_s} s: commands along the twelve runs"));
        let method = format!("case 2, all layouts, nominal starts: {name}, control period {dt_s} s");
        commands_row(rows, item.method(method), &baseline);
    }
}

/// By layout: times of runs as good as the nominal one, s, `None` where not all arrive.
type Runs = Vec<Vec<Option<f64>>>;

/// Twelve runs of each layout, with everything moved by the 0.05 mm to which layouts are stored, and every choice among
/// equally small rectangles.
fn nearby(program: &Program) -> Runs {
    let seeds = if program.has_ties() { 3 } else { 12 };
    let time = |outcome: Outcome| outcome.all_arrived().then(|| outcome.time_s());
    let runs = |layout: &Scene| program.run_nearby(layout, seeds, 0.000_05).into_iter().map(time).collect();
    case2().iter().map(runs).collect()
}

/// Mean of the reductions per layout, over the layouts that both finish, for one run of each: the runs' indices are drawn.
fn drawn_reductions(ours: &Runs, base: &Runs) -> Vec<f64> {
    let mut stream = model::random::Stream::new(1, 0, 0, "case 2");
    let mut draw = |runs: &[Option<f64>]| runs[(stream.between(0.0, runs.len() as f64) as usize).min(runs.len() - 1)];
    let one = |_| {
        let pairs = ours.iter().zip(base).filter_map(|(ours, base)| draw(ours).zip(draw(base)));
        stats::mean(&pairs.map(|(ours, base)| reduction_percent(ours, base)).collect::<Vec<_>>())
    };
    stats::sorted((0..1000).map(one).collect())
}

fn reductions(rows: &mut Rows<'_>, dt_s: f64, all: &[Runs; 3]) {
    let [max3, lin, c1] = all;
    let oracle = &ORACLE["case2_o15_replay"]["mean_reduction_percent"];
    rows.about(
        "specification, section 4.2, and its oracle file",
        format!(
            "case 2, control period {dt_s} s: in each of the twelve layouts twelve runs, everything moved by up to 0.05 mm, \
             and every choice among equally small rectangles; one run of each is drawn, a thousand times"
        ),
        "the specification's mean is that of one run of each layout: it has to lie where 99 % of the drawn means do",
    );
    // Of the other pairs the interval is as wide as the reduction itself.
    for (key, ours, base) in [("C1_vs_max3", c1, max3), ("C1_vs_linear", c1, lin)] {
        let drawn = drawn_reductions(ours, base);
        let (middle, interval) = (drawn[500], [drawn[5], drawn[994]]);
        let specified = number(&oracle[key][format!("{dt_s:.2}")]);
        let item = Item::new(format!("case 2, period {dt_s} s, {key}: mean reduction"));
        let item = match key {
            "C1_vs_max3" => headline(item, dt_s, middle, specified),
            _ => item,
        };
        let tolerance = format!("{:.1} to {:.1} % (99 %)", interval[0], interval[1]);
        let ok = stats::inside(interval, specified, 0.05);
        rows.push(item, Some(format!("{specified} %")), format!("{middle:.1} %"), tolerance, ok);
    }
    let failures = |runs: &Runs| runs.iter().filter(|runs| runs.iter().filter(|run| run.is_none()).count() > 6).count();
    let item = Item::new(format!("case 2, period {dt_s} s: layouts in which C1 fails, no more than DAPF-max3"))
        .source("specification, section 5.3, pass for `faithful`, and K11")
        .why("the specification's; a layout counts as failed where more than half of twelve runs do not bring all robots home");
    let ours = format!("{} against {} of 12", failures(c1), failures(max3));
    let ok = failures(c1) <= failures(max3);
    rows.push(item, Some("no more".to_owned()), ours, "no more".to_owned(), ok);
}

/// The paper's number, and what it is made of.
fn headline(item: Item, dt_s: f64, ours: f64, specified: f64) -> Item {
    let authors = stored::mean_percent("case2_o15_AMR", "case2_o15_DAPF");
    let holds = (ours - 27.0).abs() <= super::PAPER_POINTS;
    let item = item
        .against_paper("about 27 %", format!("± {} percentage points", super::PAPER_POINTS), holds)
        .authors(Some(format!("{authors:.1} %")));
    let rate = if dt_s > 0.1 { "at the control rate that the authors' simulator had, 4.5 Hz" } else { "at 10 Hz" };
    let item = item.headline(format!(
        "In twelve random layouts the fleet takes {ours:.0} % less time {rate} (paper: about 27 %, its authors' runs \
         {authors:.1} %, the specification's replay {specified} %)."
    ));
    if holds {
        item
    } else {
        item.note("at 10 Hz, the paper's nominal rate, it is less than at the rate that the authors' runs had")
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
    rows.about(
        "the authors' repository; specification, section 4.2",
        "twelve layouts with 22 pillars (reproduce/scenes/amr_extra_*), nominal starts, 10 Hz; mean of the reductions in the \
         layouts that both finish",
        "as for the paper's own percentages: by as much as it rounds them",
    );
    let authors = stored::mean_percent("o22_AMR", "o22_DAPF");
    for (name, base) in [("max3", &max3), ("lin", &lin)] {
        let pairs = c1.iter().zip(base).filter_map(|(ours, base)| ours.zip(*base));
        let mean = stats::mean(&pairs.map(|(ours, base)| reduction_percent(ours, base)).collect::<Vec<_>>());
        let item = Item::new(format!("extra layouts, C1 against DAPF-{name}: mean reduction"));
        let item = item.authors(Some(format!("{authors:.1} %")));
        rows.number(item, 28.4, hundredth(mean), super::PAPER_POINTS, "%");
    }
    let finished = |times: &[Option<f64>]| times.iter().flatten().count();
    let ours = format!("{} against {} of 12", finished(&c1), finished(&max3));
    let item = Item::new("extra layouts: C1 finishes no fewer than DAPF-max3")
        .source("specification, section 5.3, pass for `faithful`")
        .why("the specification's");
    rows.push(item, Some("no fewer".to_owned()), ours, "no fewer".to_owned(), finished(&c1) >= finished(&max3));
    ControlFlow::Continue(())
}
