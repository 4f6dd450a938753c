//! Comparisons that survive chance: exact tests for counts and for ranks, and the spread of a ratio of medians.
//!
//! Where a run is decided by random numbers, or by the last bit of a start, a single value of the specification cannot be
//! compared with a single one of ours. What can be compared is whether the specification's few runs may come from the
//! distribution of our many. The tests here assume nothing about the form of that distribution.

use model::random::Stream;

/// A value of the specification is taken to differ when chance explains it with less than this probability.
pub const LEVEL: f64 = 0.01;

/// ln n!
fn ln_factorial(n: u64) -> f64 {
    (2..=n).map(|i| (i as f64).ln()).sum()
}

fn ln_choose(n: u64, k: u64) -> f64 {
    ln_factorial(n) - ln_factorial(k) - ln_factorial(n - k)
}

/// Fisher's exact test, two-sided: how probable two counts as different as `a` of `n` and `b` of `m` are, if both have
/// the same share.
pub fn fisher([a, n]: [u32; 2], [b, m]: [u32; 2]) -> f64 {
    let [a, n, b, m] = [a, n, b, m].map(u64::from);
    let all = a + b;
    let ln_p = |k: u64| ln_choose(n, k) + ln_choose(m, all - k) - ln_choose(n + m, all);
    let here = ln_p(a);
    let counts = all.saturating_sub(m)..=all.min(n);
    counts.map(ln_p).filter(|p| *p <= here + 1e-9).map(f64::exp).sum::<f64>().min(1.0)
}

/// The probability that exactly `k` of `n` values are below the `r`-th of `m` others (from 1) of the same distribution.
fn rank_probability(r: u64, m: u64, k: u64, n: u64) -> f64 {
    (ln_choose(k + r - 1, k) + ln_choose(n - k + m - r, n - k) - ln_choose(n + m, n)).exp()
}

/// The indices of a sorted sample of `n` between which the `r`-th of `m` values of the same distribution lies: outside of
/// them with less than [`LEVEL`], half of it on each side. `None` on a side on which no index is that improbable.
pub fn rank_bounds(r: usize, m: usize, n: usize) -> [Option<usize>; 2] {
    let (r, m, n) = (r as u64, m as u64, n as u64);
    let (mut low, mut sum) = (None, 0.0);
    for k in 0..=n {
        sum += rank_probability(r, m, k, n);
        if sum >= LEVEL / 2.0 {
            // At least k are below it: it lies above the k-th, if there is one.
            low = k.checked_sub(1);
            break;
        }
    }
    let (mut high, mut sum) = (None, 0.0);
    for k in (0..=n).rev() {
        sum += rank_probability(r, m, k, n);
        if sum >= LEVEL / 2.0 {
            high = (k < n).then_some(k);
            break;
        }
    }
    [low, high].map(|index| index.map(|index| index as usize))
}

/// Where the `r`-th of `m` more values would lie, by a sorted sample: an interval that holds it with 99 %. A side that the
/// sample cannot bound ends `beyond` its last value.
pub fn interval(sorted: &[f64], r: usize, m: usize, beyond: f64) -> [f64; 2] {
    let [low, high] = rank_bounds(r, m, sorted.len());
    let low = low.map_or_else(|| sorted[0] - beyond, |index| sorted[index]);
    let high = high.map_or_else(|| sorted[sorted.len() - 1] + beyond, |index| sorted[index]);
    [low, high]
}

/// Whether a printed value lies in an interval, half of its last digit being free.
pub fn inside([low, high]: [f64; 2], value: f64, half_digit: f64) -> bool {
    (low - half_digit..=high + half_digit).contains(&value)
}

/// In order.
pub fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

/// The middle one of a sorted sample; the upper one of two.
pub fn median(sorted: &[f64]) -> Option<f64> {
    sorted.get(sorted.len() / 2).copied()
}

/// The mean.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// An interval that holds, with 95 %, what the samples' statistic comes to when each sample is drawn again from itself
/// (a bootstrap; the same one at every call).
pub fn spread<const N: usize>(samples: [&[f64]; N], statistic: impl Fn([&[f64]; N]) -> f64) -> [f64; 2] {
    const DRAWS: usize = 2000;
    let mut stream = Stream::new(1, 0, 0, "bootstrap");
    let mut again = |sample: &[f64]| -> Vec<f64> {
        let n = sample.len();
        sorted((0..n).map(|_| sample[(stream.between(0.0, n as f64) as usize).min(n - 1)]).collect())
    };
    let drawn = (0..DRAWS).map(|_| {
        let samples: [Vec<f64>; N] = samples.map(&mut again);
        statistic(std::array::from_fn(|i| samples[i].as_slice()))
    });
    let drawn = sorted(drawn.collect());
    [drawn[DRAWS / 40], drawn[DRAWS - 1 - DRAWS / 40]]
}

/// A sign test, two-sided: how probable so uneven a number of wins is, if either side wins as easily.
pub fn sign(wins: u32, all: u32) -> f64 {
    let (wins, all) = (u64::from(wins), u64::from(all));
    let least = wins.min(all - wins);
    let ln_half = all as f64 * 0.5f64.ln();
    (2.0 * (0..=least).map(|k| (ln_choose(all, k) + ln_half).exp()).sum::<f64>()).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fisher_agrees_with_printed_tables() {
        // The lady tasting tea: 3 of 4 against 1 of 4.
        assert!((fisher([3, 4], [1, 4]) - 0.485_714).abs() < 1e-6);
        assert!((fisher([1, 10], [11, 14]) - 0.002_759).abs() < 1e-6);
        assert!((fisher([5, 20], [5, 20]) - 1.0).abs() < 1e-9);
        assert!(fisher([0, 20], [200, 200]) < 1e-6);
    }

    #[test]
    fn a_coin_is_fair() {
        assert!((sign(0, 10) - 2.0 / 1024.0).abs() < 1e-9);
        assert!((sign(5, 10) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn ranks_are_a_distribution() {
        let sum: f64 = (0..=45).map(|k| rank_probability(4, 7, k, 45)).sum();
        assert!((sum - 1.0).abs() < 1e-9);
        // That the least of 20 more is below all 200: 20 of 220.
        assert!((rank_probability(1, 20, 0, 200) - 20.0 / 220.0).abs() < 1e-9);
    }

    /// Medians of seven draws from a known distribution lie in the interval as often as it says.
    #[test]
    fn the_interval_of_a_median_holds_what_it_says() {
        let mut stream = Stream::new(1, 0, 0, "coverage");
        let mut draw = |n: usize| sorted((0..n).map(|_| stream.between(0.0, 1.0).powi(3)).collect());
        let outside = (0..4000).filter(|_| {
            let (ours, theirs) = (draw(45), draw(7));
            let [low, high] = interval(&ours, 4, 7, 0.0);
            !(low..=high).contains(&theirs[3])
        });
        let share = outside.count() as f64 / 4000.0;
        assert!(share < 1.5 * LEVEL && share > 0.0, "{share}");
        // A distribution that is shifted by its own spread is found out.
        let found = (0..400).filter(|_| {
            let (ours, theirs) = (draw(45), draw(7));
            let [low, high] = interval(&ours, 4, 7, 0.0);
            !(low..=high).contains(&(theirs[3] + 1.0))
        });
        assert!(found.count() > 390);
    }

    #[test]
    fn a_ratio_of_medians_has_its_spread() {
        let base: Vec<f64> = (0..41).map(|i| 100.0 + f64::from(i)).collect();
        let half: Vec<f64> = base.iter().map(|x| 0.5 * x).collect();
        let ratio = |[a, b]: [&[f64]; 2]| a[a.len() / 2] / b[b.len() / 2];
        let [low, high] = spread([&half, &base], ratio);
        assert!(low < 0.5 && high > 0.5 && high - low < 0.15, "{low} {high}");
    }
}
