//! The statistics of a summary: pure functions, the same numbers at every call.

use model::random::Stream;

/// The probability with which an interval holds what it is about.
pub const CONFIDENCE: f64 = 0.95;
/// The 97.5 % quantile of the normal distribution.
const Z: f64 = 1.959_963_984_540_054;
/// Number of samples that a bootstrap draws.
const DRAWS: usize = 2000;

/// The Wilson score interval of a share of which `successes` of `n` were seen; `None` if `n` is 0.
///
/// E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22, 1927.
pub fn wilson(successes: usize, n: usize) -> Option<[f64; 2]> {
    if n == 0 {
        return None;
    }
    let (share, n) = (successes as f64 / n as f64, n as f64);
    let scale = 1.0 / (1.0 + Z * Z / n);
    let middle = scale * (share + Z * Z / (2.0 * n));
    let half = scale * Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    // At 0 and n one end is exact; rounding must not move it.
    let low = if successes == 0 { 0.0 } else { (middle - half).max(0.0) };
    let high = if successes as f64 == n { 1.0 } else { (middle + half).min(1.0) };
    Some([low, high])
}

/// A quantile, linear between the two nearest values (type 7 of Hyndman and Fan, the default of NumPy and R); `None` of
/// nothing.
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let below = at.floor() as usize;
    let (low, high) = (sorted[below], sorted[(below + 1).min(last)]);
    Some(low + (at - below as f64) * (high - low))
}

/// The median: of an even number of values, the mean of the two in the middle.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The mean; `None` of nothing.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The geometric mean of positive numbers; `None` of nothing.
pub fn geometric_mean(values: &[f64]) -> Option<f64> {
    mean(&values.iter().map(|x| x.ln()).collect::<Vec<f64>>()).map(f64::exp)
}

/// A 95 % interval of a statistic of `sample` by the percentile bootstrap: the sample is drawn again from itself, with
/// replacement, and the draws are the same at every call. `None` with fewer than two values, or where the statistic of a
/// draw is not finite.
pub fn bootstrap<T: Copy>(sample: &[T], statistic: impl Fn(&[T]) -> Option<f64>) -> Option<[f64; 2]> {
    let n = sample.len();
    if n < 2 {
        return None;
    }
    let mut stream = Stream::new(0, 0, 0, "sweep bootstrap");
    let mut drawn = Vec::with_capacity(DRAWS);
    let mut again: Vec<T> = Vec::with_capacity(n);
    for _ in 0..DRAWS {
        again.clear();
        again.extend((0..n).map(|_| sample[((stream.unit() * n as f64) as usize).min(n - 1)]));
        drawn.push(statistic(&again).filter(|value| value.is_finite())?);
    }
    let tail = 0.5 * (1.0 - CONFIDENCE);
    Some([quantile(&drawn, tail)?, quantile(&drawn, 1.0 - tail)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: Option<[f64; 2]>, [low, high]: [f64; 2]) {
        let [a, b] = found.expect("an interval");
        assert!((a - low).abs() < 5e-5 && (b - high).abs() < 5e-5, "[{a}, {b}] for [{low}, {high}]");
    }

    #[test]
    fn wilson_agrees_with_published_values() {
        // R. G. Newcombe, Statistics in Medicine 17, 1998, table I, method 3.
        close(wilson(81, 263), [0.2553, 0.3662]);
        close(wilson(15, 148), [0.0624, 0.1605]);
        close(wilson(0, 20), [0.0, 0.1611]);
        close(wilson(1, 29), [0.0061, 0.1718]);
        close(wilson(20, 20), [0.8389, 1.0]);
        assert_eq!(wilson(0, 0), None);
        assert_eq!((wilson(0, 7).unwrap()[0], wilson(7, 7).unwrap()[1]), (0.0, 1.0));
    }

    #[test]
    fn quantiles_and_means_of_known_values() {
        assert_eq!((median(&[]), median(&[3.0]), median(&[4.0, 1.0])), (None, Some(3.0), Some(2.5)));
        assert_eq!(median(&[5.0, 1.0, 3.0]), Some(3.0));
        // numpy.quantile([1, 2, 3, 4], [0.25, 0.75])
        assert_eq!([0.25, 0.75].map(|share| quantile(&[4.0, 3.0, 2.0, 1.0], share)), [Some(1.75), Some(3.25)]);
        assert_eq!(geometric_mean(&[]), None);
        assert!((geometric_mean(&[0.5, 2.0, 8.0]).unwrap() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_bootstrap_is_repeatable_and_does_not_depend_on_the_order() {
        let values: Vec<f64> = (0..21).map(|i| 10.0 + f64::from(i)).collect();
        let found = bootstrap(&values, median);
        assert_eq!(found, bootstrap(&values, median));
        let [low, high] = found.unwrap();
        // Exact order statistics of the median of 21: the 6th and the 16th value.
        assert!((14.0..=17.0).contains(&low) && (23.0..=26.0).contains(&high), "[{low}, {high}]");
        assert_eq!(bootstrap(&[1.0], median), None);
        assert_eq!(bootstrap(&[2.0, 2.0, 2.0], median), Some([2.0, 2.0]));
    }

    /// The interval of a mean holds the true mean about as often as it says.
    #[test]
    fn a_bootstrap_covers_what_it_is_about() {
        let mut stream = Stream::new(7, 0, 0, "coverage");
        let held = (0..300).filter(|_| {
            let sample: Vec<f64> = (0..30).map(|_| stream.normal()).collect();
            let [low, high] = bootstrap(&sample, mean).unwrap();
            low <= 0.0 && 0.0 <= high
        });
        let share = held.count() as f64 / 300.0;
        assert!((0.89..=0.985).contains(&share), "{share}");
    }
}
