//! Starts moved by centimetres: what medians over many of them can say where single runs are decided by the last bit.

use super::early::case1_methods;
use super::layouts::case1;
use super::oracle::{ORACLE, by_robots, number};
use super::replay::{Method, Outcome, Program, amr, amr_without_clusters};
use crate::row::{Item, Rows};
use crate::stats::{self, sorted};
use planners::amr_apf::{self, Circle, Preset};
use std::ops::ControlFlow;

/// Moved starts of ours.
pub(super) const SEEDS: u64 = 45;
/// Moved starts of the specification.
const SPECIFIED: usize = 7;
/// Half of the last printed digit of a time, and a cycle beyond the greatest and the least, s.
const TIME_S: [f64; 2] = [0.051, 0.1];

pub(super) const RANK_WHY: &str = "an exact rank test at 1 %: where the median of the specification's few starts would lie \
                                   if they came from the distribution of ours. A median of so few starts is not known any \
                                   better";

/// The specification's median of `m` values (half of its last digit free) has to lie where the median of `m` values from
/// the distribution of ours would.
pub(super) fn median_row(
    rows: &mut Rows<'_>,
    item: String,
    specified: f64,
    ours: Vec<f64>,
    m: usize,
    [half_digit, beyond]: [f64; 2],
    unit: &str,
) {
    let ours = sorted(ours);
    let Some(median) = stats::median(&ours) else {
        rows.push(
            Item::new(item),
            Some(format!("{specified} {unit}")),
            "no run arrives".to_owned(),
            "-".to_owned(),
            false,
        );
        return;
    };
    let interval = stats::interval(&ours, m / 2 + 1, m, beyond);
    let [low, high] = interval;
    let ok = stats::inside(interval, specified, half_digit);
    let text = format!("{median:.1} {unit} (of {})", ours.len());
    let tolerance = format!("{low:.1} to {high:.1} {unit} (99 %)");
    rows.push(Item::new(item), Some(format!("{specified} {unit} (of {m})")), text, tolerance, ok);
}

/// The runs of a program from moved starts, with 250 s to arrive.
pub(super) fn outcomes(program: &Program, robots: usize) -> Vec<Outcome> {
    program.clone().for_seconds(250.0).run_jittered(&case1(robots), SEEDS, 0.02)
}

/// Operation times of the runs in which all arrive, s.
pub(super) fn times(outcomes: &[Outcome]) -> Vec<f64> {
    sorted(outcomes.iter().filter(|outcome| outcome.all_arrived()).map(Outcome::time_s).collect())
}

/// With more robots a median of the specification's few starts is not known to better than ten or twenty per cent, which
/// any similar rule would meet.
pub(super) const KNOWN: usize = 5;

/// Medians over starts moved by up to 2 cm: section 5.3 and the open questions.
pub(super) fn rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    let method = |what: &str, robots: usize| {
        format!(
            "case 1 (amr-case1), {robots} robots, {what}; {SEEDS} sets of starts moved by up to 2 cm in x and y, 250 s"
        )
    };
    for (robots, oracle) in by_robots(&ORACLE["jitter_medians"]["P_seconds_pm2cm_7_seeds"]) {
        let mut failed = Vec::new();
        for (key, name) in
            [("DAPF_linear", "DAPF_linear"), ("C1", "AMR_C1"), ("DAPF_constant", "DAPF_constant"), ("0623", "AMR_0623")]
        {
            if robots > KNOWN && failed.len() == 2 {
                break;
            }
            rows.begin(&format!("case 1, {key}, {robots} robots, moved starts"))?;
            rows.about("specification, section 5.3, and its oracle file", method(name, robots), RANK_WHY);
            let outcomes = outcomes(&program(name), robots);
            let times = times(&outcomes);
            failed.push(outcomes.len() - times.len());
            if robots <= KNOWN {
                let item = format!("case 1, {key}, {robots} robots, starts moved by 2 cm: median time");
                median_row(rows, item, number(&oracle[key]), times, SPECIFIED, TIME_S, "s");
            }
        }
        let item = Item::new(format!("{robots} robots, moved starts: C1 fails no more often than DAPF-lin"))
            .source("specification, section 5.3, pass for `faithful`")
            .why("the specification's");
        let ours = format!("{} against {} of {SEEDS}", failed[1], failed[0]);
        rows.push(item, Some("no more".to_owned()), ours, "no more".to_owned(), failed[1] <= failed[0]);
    }
    for (name, program, specified) in [
        ("without clusters", amr_without_clusters(Preset::C1), 57.0),
        ("smallest enclosing circle", c1_with(|params| params.circle = Circle::Enclosing), 45.5),
    ] {
        rows.begin(&format!("case 1, C1 {name}, 5 robots, moved starts"))?;
        rows.about("specification, sections 5.3 and 6", method(&format!("C1 {name}"), 5), RANK_WHY);
        let item = format!("case 1, C1 {name}, 5 robots, starts moved by 2 cm: median time");
        median_row(rows, item, specified, times(&outcomes(&program, 5)), SPECIFIED, TIME_S, "s");
    }
    ControlFlow::Continue(())
}

/// C1 with something changed.
fn c1_with(change: fn(&mut amr_apf::Params)) -> Program {
    let Method::Amr(mut params) = amr(Preset::C1).method else { unreachable!("AMR-APF was asked for") };
    change(&mut params);
    Program::amr(params)
}

/// A program of case 1 by its name in the oracle file.
pub(super) fn program(name: &str) -> Program {
    case1_methods().into_iter().find(|(known, ..)| *known == name).expect("the name stands in the code").1
}
