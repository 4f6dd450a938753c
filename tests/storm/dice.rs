//! Chance, from a seed.

use model::random::Stream;

/// A millisecond, ns.
pub(crate) const MS: u64 = 1_000_000;

/// Everything that is left to chance in one storm. Who asks first gets the first number, so the order of asking has to
/// be a function of the seed as well.
pub(crate) struct Dice(Stream);

impl Dice {
    pub(crate) fn new(seed: u64) -> Dice {
        Dice(Stream::new(seed, 0, 0, "storm"))
    }

    /// A number below `n`, which is not zero.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((self.0.unit() * n as f64) as usize).min(n - 1)
    }

    /// Whether something happens that happens `times` out of a thousand.
    pub(crate) fn permille(&mut self, times: usize) -> bool {
        self.below(1000) < times
    }

    pub(crate) fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// A time between these two, ms, in ns.
    pub(crate) fn between_ms(&mut self, low: u64, high: u64) -> u64 {
        low * MS + (self.0.unit() * ((high - low) * MS) as f64) as u64
    }
}
