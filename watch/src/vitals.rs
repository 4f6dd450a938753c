//! How everybody does: states and tasks as the daemon tells them, and times of the last second as the statistics have them.

use bus::{Counter, StatsSnapshot, clock};
use model::{Metric, Mode, PerCause, RobotIndex};
use protocol::operator_to_daemon::{EventRecord, Status};
use report::{LatencyReport, Verdict, judge, measured};
use serde::Serialize;
use std::collections::BTreeMap;

/// A fleet at one moment.
#[derive(Clone, Debug, Serialize)]
pub struct Vitals {
    /// What the daemon says; if it does not answer, what it said last.
    pub status: Status,
    /// Why the daemon does not answer, if it does not.
    pub unanswered: Option<String>,
    /// What happened since the last look, as far as it is kept.
    pub events: Vec<EventRecord>,
    /// The times.
    pub pulse: Pulse,
}

/// What was measured between two looks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pulse {
    /// Between the two, s; 0 at the first look, of which everything so far is told.
    pub window_s: f64,
    /// All loops together.
    pub fleet: Load,
    /// The world's.
    pub world: Load,
    /// The robots', by slot.
    pub robots: BTreeMap<RobotIndex, Load>,
    /// Who used whose poses.
    pub links: Vec<Link>,
    /// The verdict if the run ended now.
    pub verdict: Verdict,
    /// Why it is not `valid`.
    pub because: Vec<String>,
}

/// How a process did.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Load {
    /// Share of a processor that it used; `None` at the first look and for what does not run.
    pub cpu: Option<f64>,
    /// Memory that is present, bytes.
    pub resident_bytes: Option<u64>,
    /// Age of the poses that it used, median and 99 %, us.
    pub pose_age_us: Option<[f64; 2]>,
    /// How late it woke, median and 99 %, us.
    pub wake_us: Option<[f64; 2]>,
    /// From waking to its command, median and 99 %, us.
    pub step_us: Option<[f64; 2]>,
    /// Periods that were to be run, or ticks answered.
    pub periods: u64,
    /// Periods that were missed.
    pub missed: u64,
    /// Periods that were missed since it started.
    pub missed_ever: u64,
    /// Late periods, by cause.
    pub late: PerCause<u64>,
}

/// A robot that used another one's poses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Link {
    /// Who used them.
    pub by: RobotIndex,
    /// Whose they were.
    pub of: RobotIndex,
    /// Their median age, us.
    pub age_us: f64,
}

/// A process at one look.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Used {
    pub(crate) pid: u32,
    pub(crate) ran_ns: u64,
    pub(crate) resident_bytes: Option<u64>,
}

impl Used {
    /// What the kernel says of a process.
    pub(crate) fn by(pid: u32) -> Option<Used> {
        let ran_ns = clock::schedstat_of(pid)?.ran_ns;
        #[expect(clippy::disallowed_methods, reason = "memory is read from /proc")]
        let statm = std::fs::read_to_string(format!("/proc/{pid}/statm")).ok();
        let pages = statm.and_then(|statm| statm.split_ascii_whitespace().nth(1)?.parse::<u64>().ok());
        Some(Used { pid, ran_ns, resident_bytes: pages.map(|pages| pages * rustix::param::page_size() as u64) })
    }
}

/// All that was read at one look.
#[derive(Clone, Debug, Default)]
pub(crate) struct Look {
    pub(crate) at_ns: u64,
    pub(crate) stats: Vec<(String, StatsSnapshot)>,
    pub(crate) robots: BTreeMap<RobotIndex, Used>,
    pub(crate) world: Option<Used>,
}

impl Load {
    fn of(now: &StatsSnapshot, before: Option<&StatsSnapshot>) -> Load {
        let window = before.map_or_else(|| now.clone(), |before| now.since(before));
        let pair = |metric| window.percentiles(metric).map(|found| [found.p50, found.p99].map(|ns| ns as f64 * 1e-3));
        Load {
            cpu: None,
            resident_bytes: None,
            pose_age_us: pair(Metric::PoseAge),
            wake_us: pair(Metric::Wake),
            step_us: pair(Metric::Step),
            periods: window.counter(Counter::Periods),
            missed: window.counter(Counter::DeadlineMisses),
            missed_ever: now.counter(Counter::DeadlineMisses),
            late: window.late(),
        }
    }

    fn with_use(mut self, now: Option<&Used>, before: Option<&Used>, window_ns: u64) -> Load {
        self.resident_bytes = now.and_then(|used| used.resident_bytes);
        let same = now.zip(before).filter(|(now, before)| now.pid == before.pid && window_ns > 0);
        self.cpu = same.map(|(now, before)| now.ran_ns.saturating_sub(before.ran_ns) as f64 / window_ns as f64);
        self
    }
}

impl Pulse {
    /// What was measured between two looks at a fleet; without an earlier one, everything so far.
    pub(crate) fn between(before: Option<&Look>, now: &Look, mode: Mode, tick_hz: f64) -> Pulse {
        let window_ns = before.map_or(0, |before| now.at_ns.saturating_sub(before.at_ns));
        let (robots, world) = bus::stats::by_robot(&now.stats);
        let (robots_before, world_before) = before.map(|before| bus::stats::by_robot(&before.stats)).unzip();
        let (robots_before, world_before) = (robots_before.unwrap_or_default(), world_before.flatten());
        let mut merged = StatsSnapshot::default();
        let mut merged_before = StatsSnapshot::default();
        for (index, snapshot) in &robots {
            merged.merge(snapshot);
            // A robot that has started again from zero would make the sum of all smaller than it was.
            if let Some(earlier) = robots_before.get(index).filter(|earlier| counts_on(snapshot, earlier)) {
                merged_before.merge(earlier);
            }
        }
        let used = |index: &RobotIndex| (now.robots.get(index), before.and_then(|before| before.robots.get(index)));
        let loads = robots.iter().map(|(index, snapshot)| {
            let (of_now, of_before) = used(index);
            (*index, Load::of(snapshot, robots_before.get(index)).with_use(of_now, of_before, window_ns))
        });
        let links = robots.iter().flat_map(|(by, snapshot)| {
            let window = robots_before.get(by).map_or_else(|| snapshot.clone(), |before| snapshot.since(before));
            let of = window.by_robot(Metric::PoseAge).into_iter();
            of.map(|(of, age)| Link { by: *by, of, age_us: age.p50 as f64 * 1e-3 })
        });
        let facts = measured::latency(&now.stats, &|_| None, mode == Mode::Realtime);
        let loops = facts.per_robot.iter().chain(&facts.world);
        let wait = loops.filter_map(|of| of.run_queue_wait).reduce(f64::max);
        let report = LatencyReport { measured: facts, ..LatencyReport::default() };
        let because = judge::starved_because(mode, 1.0 / tick_hz, Some(&report), wait);
        let world_used = before.and_then(|before| before.world.as_ref());
        Pulse {
            window_s: window_ns as f64 * 1e-9,
            fleet: Load::of(&merged, before.map(|_| &merged_before)),
            world: world.map(|snapshot| Load::of(&snapshot, world_before.as_ref())).unwrap_or_default().with_use(
                now.world.as_ref(),
                world_used,
                window_ns,
            ),
            robots: loads.collect(),
            links: links.collect(),
            verdict: judge::verdict(&because, &[]),
            because,
        }
    }
}

/// Whether a snapshot holds all that an earlier one does.
fn counts_on(now: &StatsSnapshot, before: &StatsSnapshot) -> bool {
    now.counter(Counter::Periods) >= before.counter(Counter::Periods)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::{Address, StatsWriter, Strips, clean};

    /// Two looks at a robot that wakes at once for a while and then late, and hears another one.
    #[test]
    fn a_window_tells_of_what_came_in_it_and_not_of_what_was_before() {
        let address = Address::create().unwrap();
        let metrics = [Metric::Wake, Metric::PoseAge];
        let mut stats = StatsWriter::create(&address, "agent-0-0", &metrics, Strips::of_agent(4)).unwrap();
        let live = |stats: &mut StatsWriter, wake_ns: u64, heard: u32| {
            for _ in 0..100 {
                stats.record(Metric::Wake, wake_ns);
                stats.record(Metric::PoseAge, 1_000_000);
                stats.record_of(RobotIndex(heard), Metric::PoseAge, 1_000_000, 1);
                stats.add(Counter::Periods, 1);
            }
        };
        let look = |at_ns| Look { at_ns, stats: bus::stats::read_all(&address).unwrap(), ..Look::default() };
        live(&mut stats, 5_000_000, 1);
        let first = look(0);
        live(&mut stats, 20_000, 2);
        stats.add(Counter::DeadlineMisses, 3);
        let second = look(1_000_000_000);
        clean::sweep(&address);

        let all = Pulse::between(None, &second, Mode::Realtime, 50.0);
        let of = |pulse: &Pulse| pulse.robots[&RobotIndex(0)].clone();
        assert_eq!((all.window_s, of(&all).periods, of(&all).cpu), (0.0, 200, None));
        assert_eq!(all.verdict, Verdict::Starved);
        let recent = Pulse::between(Some(&first), &second, Mode::Realtime, 50.0);
        let robot = of(&recent);
        assert_eq!((recent.window_s, robot.periods, robot.missed, robot.missed_ever), (1.0, 100, 3, 3));
        let [p50, p99] = robot.wake_us.unwrap();
        assert!((19.0..21.0).contains(&p50) && (19.0..21.0).contains(&p99), "{p50} {p99}");
        assert_eq!(recent.links.iter().map(|link| link.of.0).collect::<Vec<_>>(), [2], "it heard another one before");
        assert_eq!(recent.fleet.periods, 100);
        // A new process of the robot counts from zero: what it counted is all there is.
        let restarted = Pulse::between(Some(&second), &first, Mode::Realtime, 50.0);
        assert_eq!((of(&restarted).periods, restarted.fleet.periods), (100, 100));
    }

    #[test]
    fn the_use_of_a_processor_is_of_one_process() {
        let used = |pid, ran_ns| Used { pid, ran_ns, resident_bytes: Some(4096) };
        let load = |now, before| Load::default().with_use(Some(&now), Some(&before), 1_000).cpu;
        assert_eq!(load(used(7, 900), used(7, 400)), Some(0.5));
        assert_eq!(load(used(8, 900), used(7, 400)), None);
        let own = Used::by(std::process::id()).unwrap();
        assert!(own.resident_bytes > Some(100_000));
        assert_eq!(Used::by(u32::MAX), None);
    }
}
