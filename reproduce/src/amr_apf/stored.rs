//! What the authors' stored runs say: how the paper's own numbers arise from them.

use super::oracle::{AUTHORS, by_robots, hundredth, list, pair};
use super::{oracle::authors_best, reduction_percent};
use crate::row::{Item, Rows};
use serde_json::Value;

const NOTE: &str = "from the authors' stored runs, nothing of ours is simulated";

/// Reductions in the stored tables, and those that the paper prints.
pub(super) fn rows(rows: &mut Rows<'_>) {
    let table = [35.9, 35.7, 35.6, 33.9, 32.6, 32.3, 31.7, 34.6, 36.7, 35.6, 45.9, 42.8, 43.5, 37.6, 27.0];
    let time = |series: &str, robots: usize| authors_best(series, &robots.to_string()).map_or(f64::NAN, |best| best.0);
    for (i, oracle) in table.into_iter().enumerate() {
        let robots = i + 1;
        let ours = reduction_percent(time("case1_AMR", robots), time("case1_DAPF_linear_attraction", robots));
        let paper_value = (robots == 2).then(|| "35 %".to_owned());
        let item = Item::new(format!("stored runs, case 1, {robots} robots: reduction")).note(NOTE);
        rows.number(Item { paper_value, ..item }, oracle, hundredth(ours), 0.051, "%");
    }
    let constant = time("case1_earlier_DAPF_constant_attraction", 15);
    let mixed = reduction_percent(time("case1_AMR", 15), constant);
    let item = Item::new("stored runs, case 1, 15 robots, series mixed: reduction").note(NOTE);
    rows.number(Item { paper_value: Some("50 %".to_owned()), ..item }, 46.9, hundredth(mixed), 0.051, "%");
    let first = reduction_percent(time("case1_earlier_AMR", 15), constant);
    rows.number(
        Item::new("stored runs, case 1, 15 robots, first series: reduction").note(NOTE),
        35.5,
        hundredth(first),
        0.051,
        "%",
    );
    for (name, ours, base, oracle, paper) in [
        ("case 2", "case2_o15_AMR", "case2_o15_DAPF", 26.9, Some("about 27 %")),
        ("extra layouts", "o22_AMR", "o22_DAPF", 28.4, None),
    ] {
        let pairs = both(ours, base);
        let mean = pairs.iter().map(|(ours, base)| reduction_percent(*ours, *base)).sum::<f64>() / pairs.len() as f64;
        let item = Item::new(format!("stored runs, {name}: mean reduction")).note(NOTE);
        rows.number(Item { paper_value: paper.map(str::to_owned), ..item }, oracle, hundredth(mean), 0.051, "%");
        if name == "case 2" {
            let sum = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
            let ratio = reduction_percent(sum(|pair| pair.0), sum(|pair| pair.1));
            rows.number(Item::new("stored runs, case 2: ratio of sums").note(NOTE), 27.8, hundredth(ratio), 0.051, "%");
        }
    }
}

/// The best times of both methods, s, where both have one.
fn both(ours: &str, base: &str) -> Vec<(f64, f64)> {
    let best = |tries: &Value| list(tries).iter().map(|one| pair(one)[0]).fold(f64::INFINITY, f64::min);
    let keys = by_robots(&AUTHORS[base]);
    let pairs = keys
        .into_iter()
        .filter_map(|(key, base)| AUTHORS[ours].get(key.to_string()).map(|ours| (best(ours), best(base))));
    pairs.collect()
}
