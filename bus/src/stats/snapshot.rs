//! Statistics as they are read: by the daemon at the end, and by whoever looks meanwhile.
#![expect(clippy::disallowed_methods, reason = "statistics are files in the root of the fleet")]

use super::scale::{COARSE, FINE, Scale};
use super::{
    COUNTERS, Counter, DIRECTORY, HISTOGRAM_SIZE, HISTOGRAMS, LATE, MAGIC, PRESENT, STRIP_BUCKETS, STRIP_MAX,
    STRIP_METRIC, STRIP_SIZE, STRIPS, WORLD,
};
use crate::{Address, BusError, Result};
use model::{Cause, Metric, PerCause, PerMetric, RobotIndex, RobotInstance};
use std::collections::BTreeMap;

/// Buckets and their maximum; no buckets: not measured.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Counts {
    max: u64,
    counts: Vec<u64>,
}

impl Counts {
    fn merge(&mut self, other: &Counts) {
        self.max = self.max.max(other.max);
        if self.counts.is_empty() {
            self.counts.clone_from(&other.counts);
        } else {
            for (mine, theirs) in self.counts.iter_mut().zip(&other.counts) {
                *mine += theirs;
            }
        }
    }

    /// What came after `before`. The largest of it is known as far as its bucket is.
    fn since(&self, before: &Counts, scale: Scale) -> Counts {
        let earlier = |bucket: usize| before.counts.get(bucket).copied().unwrap_or(0);
        let newer = self.counts.iter().enumerate().map(|(bucket, count)| count.saturating_sub(earlier(bucket)));
        let counts: Vec<u64> = newer.collect();
        let largest = counts.iter().rposition(|count| *count > 0).map_or(0, |bucket| scale.value_of(bucket));
        Counts { max: if self.max > before.max { self.max } else { largest.min(self.max) }, counts }
    }

    fn spread(&self, scale: Scale, edges: &[u64]) -> Vec<u64> {
        if self.counts.iter().all(|count| *count == 0) {
            return Vec::new();
        }
        let mut spread = vec![0; edges.len()];
        for (bucket, &count) in self.counts.iter().enumerate() {
            if let Some(bin) = edges.partition_point(|edge| *edge <= scale.value_of(bucket)).checked_sub(1) {
                spread[bin] += count;
            }
        }
        spread
    }

    fn percentiles(&self, scale: Scale) -> Option<Percentiles> {
        let n: u64 = self.counts.iter().sum();
        let mut buckets = self.counts.iter().enumerate();
        let (mut seen, mut value) = (0, 0);
        // The quantiles rise, so that the buckets are gone through once: statistics of every robot are read every second.
        let mut at = |quantile: f64| {
            let rank = (quantile * n as f64).ceil() as u64;
            while seen < rank
                && let Some((bucket, count)) = buckets.next()
            {
                seen += count;
                value = scale.value_of(bucket);
            }
            value.min(self.max)
        };
        (n > 0).then(|| Percentiles { p50: at(0.5), p90: at(0.9), p99: at(0.99), p999: at(0.999), max: self.max, n })
    }
}

/// What one file, or several together, held at one moment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StatsSnapshot {
    counters: [u64; Counter::ALL.len()],
    late: PerCause<u64>,
    hists: PerMetric<Counts>,
    /// By robot and metric.
    strips: BTreeMap<(RobotIndex, Metric), Counts>,
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

    /// Late periods by cause.
    pub fn late(&self) -> PerCause<u64> {
        self.late
    }

    /// Adds what another snapshot holds.
    pub fn merge(&mut self, other: &StatsSnapshot) {
        for (mine, theirs) in self.counters.iter_mut().zip(&other.counters) {
            *mine += theirs;
        }
        for (cause, theirs) in other.late.iter() {
            self.late[cause] += theirs;
        }
        for (metric, theirs) in other.hists.iter() {
            self.hists[metric].merge(theirs);
        }
        for (key, theirs) in &other.strips {
            self.strips.entry(*key).or_default().merge(theirs);
        }
    }

    /// What was counted after `before`, an earlier snapshot of the same processes. If one of them has started again from zero, all of it.
    pub fn since(&self, before: &StatsSnapshot) -> StatsSnapshot {
        if self.counter(Counter::Periods) < before.counter(Counter::Periods) {
            return self.clone();
        }
        let none = Counts::default();
        let strip = |(key, counts): (&(RobotIndex, Metric), &Counts)| {
            (*key, counts.since(before.strips.get(key).unwrap_or(&none), COARSE))
        };
        StatsSnapshot {
            counters: std::array::from_fn(|i| self.counters[i].saturating_sub(before.counters[i])),
            late: PerCause::of(|cause| self.late[cause].saturating_sub(before.late[cause])),
            hists: PerMetric::of(|metric| self.hists[metric].since(&before.hists[metric], FINE)),
            strips: self.strips.iter().map(strip).collect(),
        }
    }

    /// A metric in six numbers; `None` if nothing was measured.
    pub fn percentiles(&self, metric: Metric) -> Option<Percentiles> {
        self.hists[metric].percentiles(FINE)
    }

    /// What was kept of a metric by robot, in their order.
    pub fn by_robot(&self, metric: Metric) -> Vec<(RobotIndex, Percentiles)> {
        let of = self.strips.iter().filter(|((_, kept), _)| *kept == metric);
        of.filter_map(|((robot, _), counts)| Some((*robot, counts.percentiles(COARSE)?))).collect()
    }

    /// How many values of a metric lie from each of these edges (ns, rising) up to the next; the last has no end.
    /// A bucket counts where its middle is. Empty if nothing was measured.
    pub fn spread(&self, metric: Metric, edges: &[u64]) -> Vec<u64> {
        self.hists[metric].spread(FINE, edges)
    }

    /// The same of what was kept of one robot.
    pub fn spread_of(&self, robot: RobotIndex, metric: Metric, edges: &[u64]) -> Vec<u64> {
        self.strips.get(&(robot, metric)).map_or_else(Vec::new, |counts| counts.spread(COARSE, edges))
    }

    fn parse(bytes: &[u8]) -> Option<StatsSnapshot> {
        let u64_at = |at: usize| Some(u64::from_ne_bytes(bytes.get(at..at + 8)?.try_into().ok()?));
        let u32_at = |at: usize| Some(u32::from_ne_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
        let counts_at = |at: usize, end: usize| {
            let (words, _) = bytes.get(at..end)?.as_chunks::<4>();
            Some(words.iter().map(|word| u64::from(u32::from_ne_bytes(*word))).collect())
        };
        if u64_at(0)? != MAGIC {
            return None;
        }
        let present = u64_at(PRESENT)?;
        let mut snapshot = StatsSnapshot::default();
        for (counter, word) in Counter::ALL.iter().zip(&mut snapshot.counters) {
            *word = u64_at(COUNTERS + 8 * *counter as usize)?;
        }
        for cause in Cause::ALL {
            snapshot.late[cause] = u64_at(LATE + 8 * cause as usize)?;
        }
        let mut at = HISTOGRAMS;
        for metric in Metric::ALL {
            if present >> metric as u32 & 1 == 1 {
                snapshot.hists[metric] = Counts { max: u64_at(at)?, counts: counts_at(at + 64, at + HISTOGRAM_SIZE)? };
                at += HISTOGRAM_SIZE;
            }
        }
        for strip in 0..usize::try_from(u64_at(STRIPS)?).ok()? {
            let at = at + strip * STRIP_SIZE;
            bytes.get(at..at + STRIP_SIZE)?;
            let (robot, metric) = (u32_at(at)?, u32_at(at + STRIP_METRIC)?);
            let metric = Metric::ALL.into_iter().find(|known| *known as u32 == metric);
            let Some((robot, metric)) = robot.checked_sub(1).map(RobotIndex).zip(metric) else { continue };
            let buckets_at = at + STRIP_BUCKETS;
            let counts = counts_at(buckets_at, buckets_at + COARSE.buckets() * 4)?;
            snapshot.strips.insert((robot, metric), Counts { max: u64_at(at + STRIP_MAX)?, counts });
        }
        Some(snapshot)
    }
}

/// Takes the statistics of a process that has ended: what it counted, and its file is gone. `None` if it left none.
pub fn take(address: &Address, name: &str) -> Option<StatsSnapshot> {
    let path = address.file(DIRECTORY).join(name);
    let counted = std::fs::read(&path).ok().and_then(|bytes| StatsSnapshot::parse(&bytes));
    let _ = std::fs::remove_file(path);
    counted
}

/// What all processes of the fleet have counted so far, by the name of the file, sorted.
///
/// # Errors
/// When the fleet is gone, or a file cannot be read.
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
        let bytes = match std::fs::read(entry.path()) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => continue,
            Err(e) => return Err(failed(e)),
        };
        let name = entry.file_name().to_string_lossy().into_owned();
        if let Some(snapshot) = StatsSnapshot::parse(&bytes).filter(|_| !name.contains(".draft")) {
            all.push((name, snapshot));
        }
    }
    all.sort_by(|(a, _), (b, _)| a.cmp(b));
    Ok(all)
}

/// The robots' statistics by slot, all lives of a robot together, and the world's. Files of others are left out.
pub fn by_robot(stats: &[(String, StatsSnapshot)]) -> (BTreeMap<RobotIndex, StatsSnapshot>, Option<StatsSnapshot>) {
    let (mut robots, mut world) = (BTreeMap::<RobotIndex, StatsSnapshot>::new(), None);
    for (name, snapshot) in stats {
        if let Some(instance) = instance_of(name) {
            robots.entry(instance.index).or_default().merge(snapshot);
        } else if name == WORLD {
            world = Some(snapshot.clone());
        }
    }
    (robots, world)
}

/// Whose agent a file of statistics belongs to.
pub fn instance_of(name: &str) -> Option<RobotInstance> {
    let (slot, incarnation) = name.strip_prefix("agent-")?.split_once('-')?;
    Some(RobotInstance { index: RobotIndex(slot.parse().ok()?), incarnation: incarnation.parse().ok()? })
}
