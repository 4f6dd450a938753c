//! What the authors' stored runs say: where the paper's own numbers come from. They are not simulated here, so
//! they make no rows of their own; they stand beside the paper's numbers in the column `authors`.

use super::oracle::{AUTHORS, authors_best, by_robots, list, pair};
use super::reduction_percent;
use serde_json::Value;

/// Reduction with this number of robots between two series of case 1, %.
pub(super) fn case1_percent(ours: &str, base: &str, robots: usize) -> f64 {
    let time = |series: &str| authors_best(series, &robots.to_string()).map_or(f64::NAN, |best| best.0);
    reduction_percent(time(ours), time(base))
}

/// Mean of the reductions per layout, %, over the layouts that both series have.
pub(super) fn mean_percent(ours: &str, base: &str) -> f64 {
    let pairs = both(ours, base);
    pairs.iter().map(|(ours, base)| reduction_percent(*ours, *base)).sum::<f64>() / pairs.len() as f64
}

/// The best times of both series, s, where both have one.
fn both(ours: &str, base: &str) -> Vec<(f64, f64)> {
    let best = |tries: &Value| list(tries).iter().map(|one| pair(one)[0]).fold(f64::INFINITY, f64::min);
    let keys = by_robots(&AUTHORS[base]);
    let pairs = keys
        .into_iter()
        .filter_map(|(key, base)| AUTHORS[ours].get(key.to_string()).map(|ours| (best(ours), best(base))));
    pairs.collect()
}

/// Case 1: the method and its baseline, as the paper's text has them for few robots.
pub(super) const AMR: &str = "case1_AMR";
/// Linear attraction.
pub(super) const LINEAR: &str = "case1_DAPF_linear_attraction";
/// Constant attraction, of an earlier series.
pub(super) const CONSTANT: &str = "case1_earlier_DAPF_constant_attraction";

#[cfg(test)]
mod tests {
    use super::*;

    /// The tables of the specification.
    #[test]
    fn the_papers_numbers_come_from_these_runs() {
        let table = [35.9, 35.7, 35.6, 33.9, 32.6, 32.3, 31.7, 34.6, 36.7, 35.6, 45.9, 42.8, 43.5, 37.6, 27.0];
        for (robots, expected) in (1..).zip(table) {
            assert!((case1_percent(AMR, LINEAR, robots) - expected).abs() < 0.051, "{robots} robots");
        }
        assert!((case1_percent(AMR, CONSTANT, 15) - 46.9).abs() < 0.051, "two series mixed");
        assert!((case1_percent("case1_earlier_AMR", CONSTANT, 15) - 35.5).abs() < 0.051);
        assert!((mean_percent("case2_o15_AMR", "case2_o15_DAPF") - 26.9).abs() < 0.051);
        assert!((mean_percent("o22_AMR", "o22_DAPF") - 28.4).abs() < 0.051);
        let sum = |of: fn(&(f64, f64)) -> f64| both("case2_o15_AMR", "case2_o15_DAPF").iter().map(of).sum::<f64>();
        assert!((reduction_percent(sum(|pair| pair.0), sum(|pair| pair.1)) - 27.8).abs() < 0.051);
    }
}
