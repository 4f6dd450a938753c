//! Latency histograms and counters that survive whoever writes them.
//!
//! A process counts into a mapped file on tmpfs; anybody may read the file at any time, and the writer does not
//! notice. A SIGKILL loses nothing that was counted. Counting takes a few nanoseconds and no system call, no lock and
//! no allocation.
//!
//! A file has, besides counters:
//! - a *histogram* per metric (8 KiB): within 0.8 % of every value, see `stats/scale.rs`;
//! - *strips*, coarse histograms (0.8 KiB, within 6.3 %) of a metric by robot: whose poses an agent used, whose commands
//!   the world obeyed. An agent has [`PAIRS_MAX`] of them, whatever the size of the fleet; a robot that has not been
//!   heard for the longest time makes room for a new one, and [`Counter::UsesDropped`] says how many uses are therefore
//!   in no strip.
//!
//! Why not hdrhistogram: its counts live in memory of its own and cannot be mapped. Percentiles are read from the buckets as
//! they are: filling one of its histograms first cost a view of 64 robots a third of its time.
//!
//! Values from 2^36 ns (68 s) on go to the last bucket, and a bucket stops counting at 2^32 - 1; maxima are exact.

mod scale;
mod snapshot;

use crate::map::Mapping;
use crate::{Address, BusError, Result};
use model::{Cause, Metric, RobotIndex};
use scale::{COARSE, FINE, MAX_BITS, Scale};
use std::sync::atomic::Ordering::{Relaxed, Release};

pub use snapshot::{Percentiles, StatsSnapshot, by_robot, instance_of, read_all, take};

/// What is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u32)]
pub enum Counter {
    /// Periods of a `realtime` loop, or ticks answered.
    Periods,
    /// Periods that were over before their work was.
    DeadlineMisses,
    /// Time spent ready to run without a processor, ns, as of the last look at the scheduler's counters.
    WaitedNs,
    /// Time between the first and the last of these looks, ns.
    WatchedNs,
    /// Uses of poses that are in no strip.
    UsesDropped,
}

impl Counter {
    /// All of them.
    pub const ALL: [Counter; 5] =
        [Counter::Periods, Counter::DeadlineMisses, Counter::WaitedNs, Counter::WatchedNs, Counter::UsesDropped];
}

/// Which strips a file has.
#[derive(Clone, Copy, Debug)]
pub struct Strips<'a> {
    /// Metrics that are kept by robot.
    pub metrics: &'a [Metric],
    /// How many robots the fleet can hold.
    pub robots: u32,
    /// How many strips there are at most.
    pub room: usize,
}

impl Strips<'_> {
    /// None.
    pub const NONE: Strips<'static> = Strips { metrics: &[], robots: 0, room: 0 };

    /// Those of an agent: the age of the poses it uses, by neighbour.
    pub fn of_agent(robots: u32) -> Strips<'static> {
        Strips { metrics: &[Metric::PoseAge], robots, room: PAIRS_MAX.min(robots as usize) }
    }

    /// Those of the world: how old the command of each robot is, and the odometry it was computed from.
    pub fn of_world(robots: u32) -> Strips<'static> {
        Strips { metrics: &[Metric::CommandAge, Metric::Reaction], robots, room: 2 * robots as usize }
    }
}

/// So many neighbours an agent keeps apart.
pub const PAIRS_MAX: usize = 32;

/// Name of the statistics of the world.
pub const WORLD: &str = "world";
const DIRECTORY: &str = "stats";
const MAGIC: u64 = u64::from_le_bytes(*b"shoalSt3");

// A file: magic, which metrics it has (a bit each), how many strips, the counters; then per metric its maximum and its
// buckets; then the strips.
const PRESENT: usize = 8;
const STRIPS: usize = 16;
const COUNTERS: usize = 64;
const COUNTERS_ROOM: usize = 16;
// Late periods by cause.
const LATE: usize = COUNTERS + COUNTERS_ROOM * 8;
const LATE_ROOM: usize = 8;
const HISTOGRAMS: usize = LATE + LATE_ROOM * 8;
const HISTOGRAM_SIZE: usize = 64 + FINE.buckets() * 4;
const _: () = assert!(Counter::ALL.len() <= COUNTERS_ROOM && Cause::ALL.len() <= LATE_ROOM && Metric::ALL.len() <= 32);

// A strip: the index of the robot plus one (0: free) and the metric, the maximum, the buckets; whole lines of 64 bytes.
const STRIP_METRIC: usize = 4;
const STRIP_MAX: usize = 8;
const STRIP_BUCKETS: usize = 16;
const STRIP_SIZE: usize = (STRIP_BUCKETS + COARSE.buckets() * 4).next_multiple_of(64);

/// The largest that the files of a fleet can be, all together.
pub(crate) fn bytes_needed(robots: u64) -> u64 {
    let agent = HISTOGRAMS + Metric::ALL.len() * HISTOGRAM_SIZE + PAIRS_MAX * STRIP_SIZE + 4096;
    (robots + 2) * agent as u64 + robots * 2 * STRIP_SIZE as u64
}

/// The file that one process counts into.
pub struct StatsWriter {
    map: Mapping,
    /// Where the histogram of each metric begins, if the file has it.
    at: [Option<usize>; Metric::ALL.len()],
    strips: Index,
}

/// Which strip belongs to whom. The file says the same; this finds it without a search.
struct Index {
    /// Where the first strip begins.
    at: usize,
    /// Of each metric its place among the metrics that are kept by robot.
    place: [Option<usize>; Metric::ALL.len()],
    metrics: usize,
    /// By robot and place: the index of the strip plus one, or 0 without one.
    of: Vec<u16>,
    /// By strip: the robot and place that it belongs to, and when it was last used, ns.
    used: Vec<(usize, u64)>,
    room: usize,
}

impl StatsWriter {
    /// Makes the file of this name, in place of an older one.
    ///
    /// # Errors
    /// When shared memory is full or not accessible.
    pub fn create(address: &Address, name: &str, histograms: &[Metric], strips: Strips<'_>) -> Result<StatsWriter> {
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
        let index = Index::new(len, strips);
        len += index.room * STRIP_SIZE;
        let map = Mapping::create(address, &format!("{DIRECTORY}/{name}"), len, |map| {
            map.u64_at(PRESENT).store(present, Relaxed);
            map.u64_at(STRIPS).store(index.room as u64, Relaxed);
            map.u64_at(0).store(MAGIC, Release);
        })?;
        Ok(StatsWriter { map, at, strips: index })
    }

    /// Counts one measurement. A metric that the file was not made for is left out.
    pub fn record(&mut self, metric: Metric, ns: u64) {
        self.count(metric, ns, 1);
    }

    /// Counts `n` measurements of one stall: the longest, and each of the others shorter by `step_ns`. So many periods
    /// began while their loop was away, and this is how long each had to wait.
    pub fn record_stall(&mut self, metric: Metric, longest_ns: u64, step_ns: u64, n: u64) {
        let step_ns = step_ns.max(1);
        // Those beyond the last bucket in one piece: the loop below is bounded by what the scale holds.
        let beyond = longest_ns.saturating_sub((1 << MAX_BITS) - 1).div_ceil(step_ns).min(n);
        if beyond > 0 {
            self.count(metric, longest_ns, beyond);
        }
        for k in beyond..n {
            self.count(metric, longest_ns.saturating_sub(k * step_ns), 1);
        }
    }

    fn count(&mut self, metric: Metric, ns: u64, n: u64) {
        let Some(at) = self.at[metric as usize] else { return };
        self.count_at(at, at + 64, FINE, ns, n);
    }

    /// Counts one measurement in the strip of a robot, at time `now_ns`. A metric that the file does not keep by robot
    /// is left out.
    pub fn record_of(&mut self, robot: RobotIndex, metric: Metric, ns: u64, now_ns: u64) {
        let Some(strip) = self.strip_of(robot, metric, now_ns) else { return };
        let at = self.strips.at + strip * STRIP_SIZE;
        self.count_at(at + STRIP_MAX, at + STRIP_BUCKETS, COARSE, ns, 1);
    }

    fn count_at(&mut self, max_at: usize, buckets_at: usize, scale: Scale, ns: u64, n: u64) {
        let bucket = self.map.u32_at(buckets_at + 4 * scale.bucket_of(ns));
        // A load and a store, not a locked addition: only this process writes, and `&mut` says one thread at a time.
        bucket.store(bucket.load(Relaxed).saturating_add(u32::try_from(n).unwrap_or(u32::MAX)), Relaxed);
        let max = self.map.u64_at(max_at);
        if ns > max.load(Relaxed) {
            max.store(ns, Relaxed);
        }
    }

    /// The strip of a robot: the one that it has, a free one, or that of the robot unused for the longest time.
    fn strip_of(&mut self, robot: RobotIndex, metric: Metric, now_ns: u64) -> Option<usize> {
        let index = &mut self.strips;
        let key = robot.at() * index.metrics + index.place[metric as usize]?;
        let known = *index.of.get(key)?;
        if known > 0 {
            let strip = usize::from(known) - 1;
            index.used[strip].1 = now_ns;
            return Some(strip);
        }
        let strip = if index.used.len() < index.room {
            index.used.push((key, now_ns));
            index.used.len() - 1
        } else {
            let oldest = (0..index.room).min_by_key(|&strip| index.used[strip].1);
            let Some(oldest) = oldest.filter(|&strip| index.used[strip].1 < now_ns) else {
                self.add(Counter::UsesDropped, 1);
                return None;
            };
            let (before, _) = std::mem::replace(&mut index.used[oldest], (key, now_ns));
            index.of[before] = 0;
            oldest
        };
        index.of[key] = strip as u16 + 1;
        self.begin_strip(strip, robot, metric);
        Some(strip)
    }

    /// Gives a strip to a robot. What it held of another is counted as dropped.
    fn begin_strip(&mut self, strip: usize, robot: RobotIndex, metric: Metric) {
        let at = self.strips.at + strip * STRIP_SIZE;
        self.map.u32_at(at).store(0, Relaxed);
        let mut dropped = 0;
        for bucket in 0..COARSE.buckets() {
            dropped += u64::from(self.map.u32_at(at + STRIP_BUCKETS + 4 * bucket).swap(0, Relaxed));
        }
        self.map.u64_at(at + STRIP_MAX).store(0, Relaxed);
        self.map.u32_at(at + STRIP_METRIC).store(metric as u32, Relaxed);
        self.map.u32_at(at).store(robot.0 + 1, Release);
        if dropped > 0 {
            self.add(Counter::UsesDropped, dropped);
        }
    }

    /// Adds to a counter.
    pub fn add(&mut self, counter: Counter, n: u64) {
        self.add_at(COUNTERS + 8 * counter as usize, n);
    }

    /// Counts late periods (see [`crate::blame`]) with what delayed them.
    pub fn add_late(&mut self, cause: Cause, n: u64) {
        self.add_at(LATE + 8 * cause as usize, n);
    }

    fn add_at(&mut self, at: usize, n: u64) {
        let word = self.map.u64_at(at);
        word.store(word.load(Relaxed).wrapping_add(n), Relaxed);
    }
}

impl Index {
    fn new(at: usize, strips: Strips<'_>) -> Index {
        let mut place = [None; Metric::ALL.len()];
        for (number, metric) in strips.metrics.iter().enumerate() {
            place[*metric as usize] = Some(number);
        }
        let metrics = strips.metrics.len();
        let room = strips.room.min(usize::from(u16::MAX) - 1);
        Index {
            at,
            place,
            metrics,
            of: vec![0; strips.robots as usize * metrics],
            used: Vec::with_capacity(room),
            room,
        }
    }
}

#[cfg(test)]
mod tests;
