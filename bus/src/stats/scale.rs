//! How values become buckets: log-linear, so that a bucket is narrow against what it holds, at every size.

/// A log-linear scale: exact to one unit below `2^(bits + 1)` units, then `2^bits` buckets per factor of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Scale {
    /// The unit, ns, as a power of two.
    pub(crate) unit_bits: u32,
    /// Buckets per factor of two, as a power of two.
    pub(crate) bits: u32,
}

/// Values from here on, ns, as a power of two (68 s), go to the last bucket.
pub(crate) const MAX_BITS: u32 = 36;

/// Of a metric: the middle of a bucket is at most 0.8 % away from anything in it.
pub(crate) const FINE: Scale = Scale { unit_bits: 0, bits: 6 };
/// Of a strip, which there are many of: at most 6.3 % away, or 0.5 us.
pub(crate) const COARSE: Scale = Scale { unit_bits: 10, bits: 3 };

impl Scale {
    /// How many buckets it has.
    pub(crate) const fn buckets(self) -> usize {
        ((MAX_BITS - self.unit_bits - self.bits + 1) << self.bits) as usize
    }

    /// The bucket of a value.
    pub(crate) fn bucket_of(self, ns: u64) -> usize {
        let units = ns.min((1 << MAX_BITS) - 1) >> self.unit_bits;
        let shift = (u64::BITS - units.leading_zeros()).saturating_sub(self.bits + 1);
        ((shift as usize) << self.bits) + (units >> shift) as usize
    }

    /// The middle of a bucket, ns.
    pub(crate) fn value_of(self, bucket: usize) -> u64 {
        let shift = (bucket >> self.bits).saturating_sub(1) as u32;
        let low = ((bucket - ((shift as usize) << self.bits)) as u64) << (shift + self.unit_bits);
        low + ((1 << (shift + self.unit_bits)) - 1) / 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn buckets_follow_each_other_and_hold_their_middle() {
        for scale in [FINE, COARSE] {
            for bucket in 0..scale.buckets() {
                assert_eq!(scale.bucket_of(scale.value_of(bucket)), bucket, "{scale:?}");
            }
            assert_eq!(scale.bucket_of(u64::MAX), scale.buckets() - 1);
            assert_eq!(scale.bucket_of((1 << MAX_BITS) - 1), scale.buckets() - 1);
        }
        const { assert!(60_000_000_000 < 1_u64 << MAX_BITS, "a minute fits") }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn the_middle_is_as_near_as_stated(bits in 0_u32..36, below in 0_u64..1 << 35) {
            let ns = (1 << bits) + below % (1 << bits);
            for (scale, share, least) in [(FINE, 1.0 / 128.0, 0.0), (COARSE, 1.0 / 16.0, 512.0)] {
                let error = scale.value_of(scale.bucket_of(ns)).abs_diff(ns) as f64;
                prop_assert!(error <= (ns as f64 * share).max(least), "{scale:?} {ns}: {error}");
            }
        }

        #[test]
        fn a_larger_value_has_no_smaller_bucket(a in 0_u64..1 << 37, b in 0_u64..1 << 37) {
            for scale in [FINE, COARSE] {
                prop_assert!(scale.bucket_of(a.min(b)) <= scale.bucket_of(a.max(b)));
            }
        }
    }
}
