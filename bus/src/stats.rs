//! Latency histograms and counters that survive whoever writes them.
//!
//! A process counts into a mapped file on tmpfs; anybody may read the file at any time, and the writer does not
//! notice. A SIGKILL loses nothing that was counted. Counting takes a few nanoseconds and no system call.
//!
//! Buckets are log-linear: exact below 128 ns, then 64 per factor of two, up to 2^36 ns (68 s). The middle of a bucket is
//! at most 0.8 % away from anything in it. A histogram takes 8 KiB.
#![expect(clippy::disallowed_methods, reason = "statistics are files in the root of the fleet")]

use crate::map::Mapping;
use crate::{Address, BusError, Result};
use hdrhistogram::Histogram;
use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::atomic::Ordering::{Relaxed, Release};

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u32)]
pub enum Metric {
    /// Age of a neighbour's pose at the moment the planner uses it.
    PoseAge,
    /// From the moment a process should have woken to the moment it did.
    Wake,
    /// One call of the planner.
    Plan,
    /// One step of the process: from waking to having published.
    Step,
    /// Age of a command at the moment it acts in the world.
    CommandAge,
    /// From the odometry sample to the moment the command computed from it acts in the world.
    Reaction,
}

impl Metric {
    /// All of them.
    pub const ALL: [Metric; 6] =
        [Metric::PoseAge, Metric::Wake, Metric::Plan, Metric::Step, Metric::CommandAge, Metric::Reaction];
}

/// What is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u32)]
pub enum Counter {
    /// Periods of a `realtime` loop, or ticks answered.
    Periods,
    /// Periods that were over before their work was.
    DeadlineMisses,
}

impl Counter {
    /// All of them.
    pub const ALL: [Counter; 2] = [Counter::Periods, Counter::DeadlineMisses];
}

const DIRECTORY: &str = "stats";
const MAGIC: u64 = u64::from_le_bytes(*b"shoalSt1");
/// Sub-buckets per factor of two, as a power of two.
const BITS: u32 = 6;
const MAX_BITS: u32 = 36;
const BUCKETS: usize = ((MAX_BITS - BITS + 1) << BITS) as usize;

// A file: magic, which metrics it has (a bit each), the counters; then per metric its maximum and its buckets.
const PRESENT: usize = 8;
const COUNTERS: usize = 64;
const COUNTERS_ROOM: usize = 24;
const HISTOGRAMS: usize = COUNTERS + COUNTERS_ROOM * 8;
const HISTOGRAM_SIZE: usize = 64 + BUCKETS * 4;
const _: () = assert!(Counter::ALL.len() <= COUNTERS_ROOM && Metric::ALL.len() <= 32);

/// The largest that one file can be.
pub(crate) const FILE_BYTES_MAX: u64 = (HISTOGRAMS + Metric::ALL.len() * HISTOGRAM_SIZE + 4096) as u64;

fn bucket_of(ns: u64) -> usize {
    let ns = ns.min((1 << MAX_BITS) - 1);
    let shift = (u64::BITS - ns.leading_zeros()).saturating_sub(BITS + 1);
    ((shift as usize) << BITS) + (ns >> shift) as usize
}

/// The middle of a bucket.
fn value_of(bucket: usize) -> u64 {
    let shift = (bucket >> BITS).saturating_sub(1);
    let low = ((bucket - (shift << BITS)) as u64) << shift;
    low + ((1 << shift) - 1) / 2
}

/// The file that one process counts into.
pub struct StatsWriter {
    map: Mapping,
    /// Where the histogram of each metric begins, if the file has it.
    at: [Option<usize>; Metric::ALL.len()],
    /// Counting is a load and a store, not a locked addition: one thread writes.
    _one_thread: PhantomData<Cell<()>>,
}

impl StatsWriter {
    /// Makes the file of this name, in place of an older one.
    ///
    /// # Errors
    /// When shared memory is full or closed to us.
    pub fn create(address: &Address, name: &str, histograms: &[Metric]) -> Result<StatsWriter> {
        let directory = address.file(DIRECTORY);
        match std::fs::create_dir(&directory) {
            Err(e) if e.kind() != std::io::ErrorKind::AlreadyExists => {
                return Err(BusError::io(&directory, "make the directory of the statistics", e));
            }
            _ => {}
        }
        let present = histograms.iter().fold(0_u64, |bits, &metric| bits | 1 << metric as u32);
        let mut at = [None; Metric::ALL.len()];
        let mut len = HISTOGRAMS;
        for (metric, at) in Metric::ALL.iter().zip(&mut at) {
            if present >> *metric as u32 & 1 == 1 {
                *at = Some(len);
                len += HISTOGRAM_SIZE;
            }
        }
        let map = Mapping::create(address, &format!("{DIRECTORY}/{name}"), len, |map| {
            map.u64_at(PRESENT).store(present, Relaxed);
            map.u64_at(0).store(MAGIC, Release);
        })?;
        Ok(StatsWriter { map, at, _one_thread: PhantomData })
    }

    /// Counts one measurement. A metric that the file was not made for is left out.
    pub fn record(&self, metric: Metric, ns: u64) {
        let Some(at) = self.at[metric as usize] else { return };
        let bucket = self.map.u32_at(at + 64 + 4 * bucket_of(ns));
        bucket.store(bucket.load(Relaxed).saturating_add(1), Relaxed);
        let max = self.map.u64_at(at);
        if ns > max.load(Relaxed) {
            max.store(ns, Relaxed);
        }
    }

    /// Adds to a counter.
    pub fn add(&self, counter: Counter, n: u64) {
        let word = self.map.u64_at(COUNTERS + 8 * counter as usize);
        word.store(word.load(Relaxed).wrapping_add(n), Relaxed);
    }
}

/// What one file, or several together, held at one moment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StatsSnapshot {
    counters: [u64; Counter::ALL.len()],
    /// Of each metric its maximum, and how many values each bucket has; no buckets: not measured.
    hists: [(u64, Vec<u64>); Metric::ALL.len()],
}

/// What a histogram comes to, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Percentiles {
    /// Half of all values are at most this.
    pub p50: u64,
    /// 90 %.
    pub p90: u64,
    /// 99 %.
    pub p99: u64,
    /// 99.9 %.
    pub p999: u64,
    /// The largest value, exactly.
    pub max: u64,
    /// How many values.
    pub n: u64,
}

impl StatsSnapshot {
    /// A counter.
    pub fn counter(&self, counter: Counter) -> u64 {
        self.counters[counter as usize]
    }

    /// Adds what another snapshot holds.
    pub fn merge(&mut self, other: &StatsSnapshot) {
        for (mine, theirs) in self.counters.iter_mut().zip(&other.counters) {
            *mine += theirs;
        }
        for ((max, counts), (other_max, other_counts)) in self.hists.iter_mut().zip(&other.hists) {
            *max = (*max).max(*other_max);
            if counts.is_empty() {
                counts.clone_from(other_counts);
            } else {
                for (mine, theirs) in counts.iter_mut().zip(other_counts) {
                    *mine += theirs;
                }
            }
        }
    }

    /// A metric as a histogram of three significant digits; `None` if nothing was measured.
    pub fn histogram(&self, metric: Metric) -> Option<Histogram<u64>> {
        let (_, counts) = &self.hists[metric as usize];
        let mut histogram = Histogram::new_with_bounds(1, 1 << MAX_BITS, 3).expect("the bounds are constants");
        for (bucket, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            histogram.saturating_record_n(value_of(bucket), count);
        }
        (!histogram.is_empty()).then_some(histogram)
    }

    /// A metric in six numbers; `None` if nothing was measured.
    pub fn percentiles(&self, metric: Metric) -> Option<Percentiles> {
        let histogram = self.histogram(metric)?;
        let max = self.hists[metric as usize].0;
        let at = |quantile| histogram.value_at_quantile(quantile).min(max);
        Some(Percentiles { p50: at(0.5), p90: at(0.9), p99: at(0.99), p999: at(0.999), max, n: histogram.len() })
    }

    fn parse(bytes: &[u8]) -> Option<StatsSnapshot> {
        let u64_at = |at: usize| Some(u64::from_ne_bytes(bytes.get(at..at + 8)?.try_into().ok()?));
        if u64_at(0)? != MAGIC {
            return None;
        }
        let present = u64_at(PRESENT)?;
        let mut snapshot = StatsSnapshot::default();
        for (counter, word) in Counter::ALL.iter().zip(&mut snapshot.counters) {
            *word = u64_at(COUNTERS + 8 * *counter as usize)?;
        }
        let mut at = HISTOGRAMS;
        for (metric, hist) in Metric::ALL.iter().zip(&mut snapshot.hists) {
            if present >> *metric as u32 & 1 == 1 {
                let (words, _) = bytes.get(at + 64..at + HISTOGRAM_SIZE)?.as_chunks::<4>();
                *hist = (u64_at(at)?, words.iter().map(|word| u64::from(u32::from_ne_bytes(*word))).collect());
                at += HISTOGRAM_SIZE;
            }
        }
        Some(snapshot)
    }
}

/// What all processes of the fleet have counted so far, by the name of the file, sorted.
///
/// # Errors
/// When the fleet is gone.
pub fn read_all(address: &Address) -> Result<Vec<(String, StatsSnapshot)>> {
    let directory = address.file(DIRECTORY);
    let failed = |e| BusError::io(&directory, "read the statistics", e);
    let entries = match std::fs::read_dir(&directory) {
        Ok(entries) => entries,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound && address.root().is_dir() => return Ok(Vec::new()),
        Err(e) => return Err(failed(e)),
    };
    let mut all = Vec::new();
    for entry in entries {
        let entry = entry.map_err(failed)?;
        // Files that are being made have no name yet, only a draft's, and no magic.
        let Ok(bytes) = std::fs::read(entry.path()) else { continue };
        let name = entry.file_name().to_string_lossy().into_owned();
        if let Some(snapshot) = StatsSnapshot::parse(&bytes).filter(|_| !name.contains(".draft")) {
            all.push((name, snapshot));
        }
    }
    all.sort_by(|(a, _), (b, _)| a.cmp(b));
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn buckets_follow_each_other_and_hold_their_middle() {
        for bucket in 0..BUCKETS {
            assert_eq!(bucket_of(value_of(bucket)), bucket);
        }
        assert_eq!(bucket_of(u64::MAX), BUCKETS - 1);
        const { assert!(60_000_000_000 < 1_u64 << MAX_BITS, "a minute fits") }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn a_bucket_is_within_one_percent(ns in 1_u64..60_000_000_000) {
            let error = value_of(bucket_of(ns)).abs_diff(ns) as f64 / ns as f64;
            prop_assert!(error < 0.01, "{ns}: {error}");
        }

        /// Through the file, merged from two writers, and read by somebody else.
        #[test]
        fn percentiles_are_within_one_percent(
            values in proptest::collection::vec((0_u32..36).prop_flat_map(|bits| 0_u64..=1 << bits), 1..400),
            split in 0_usize..400,
        ) {
            let address = Address::create().unwrap();
            let (left, right) = values.split_at(split.min(values.len()));
            for (name, part) in [("left", left), ("right", right)] {
                let writer = StatsWriter::create(&address, name, &[Metric::Step]).unwrap();
                part.iter().for_each(|&ns| writer.record(Metric::Step, ns));
            }
            let all = read_all(&address);
            crate::clean::sweep(&address);
            let mut merged = StatsSnapshot::default();
            all.unwrap().iter().for_each(|(_, snapshot)| merged.merge(snapshot));
            let found = merged.percentiles(Metric::Step).unwrap();

            let mut sorted = values;
            sorted.sort_unstable();
            prop_assert_eq!((found.n, found.max), (sorted.len() as u64, sorted[sorted.len() - 1]));
            for (quantile, found) in [(0.5, found.p50), (0.9, found.p90), (0.99, found.p99), (0.999, found.p999)] {
                let rank = ((quantile * sorted.len() as f64).ceil() as usize).max(1);
                let exact = sorted[rank - 1];
                // Half a bucket, and hdrhistogram's own thousandth.
                prop_assert!(found.abs_diff(exact) as f64 <= exact as f64 * 0.0095 + 1.0, "{quantile}: {found} for {exact}");
            }
        }
    }

    #[test]
    fn counters_add_up_and_what_was_not_measured_is_none() {
        let address = Address::create().unwrap();
        let writer = StatsWriter::create(&address, "agent-1", &[Metric::Wake, Metric::Plan]).unwrap();
        writer.add(Counter::Periods, 2);
        writer.add(Counter::Periods, 3);
        writer.add(Counter::DeadlineMisses, 9);
        writer.record(Metric::Reaction, 1);
        writer.record(Metric::Plan, u64::MAX);
        drop(writer);
        let all = read_all(&address);
        crate::clean::sweep(&address);
        let (name, snapshot) = &all.unwrap()[0];
        assert_eq!(name, "agent-1");
        assert_eq!((snapshot.counter(Counter::Periods), snapshot.counter(Counter::DeadlineMisses)), (5, 9));
        assert_eq!((snapshot.percentiles(Metric::Wake), snapshot.percentiles(Metric::Reaction)), (None, None));
        assert_eq!(snapshot.percentiles(Metric::Plan).unwrap().max, u64::MAX);
        assert!(read_all(&address).unwrap_err().is_missing());
    }
}
