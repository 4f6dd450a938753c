//! `shoal metrics`: what can be seen of a running fleet, in the text format of Prometheus. It reads what `shoal ps` and
//! `shoal latency` read, and /proc.

mod exposition;

use super::{fleet, latency, ps};
use crate::args::MetricsArgs;
use crate::exit::Failure;
use crate::out;
use bus::clean::FleetEntry;
use bus::{Gate, clean, clock};
use exposition::{Exposition, Kind};
use model::{Metric, ProcessState};
use protocol::operator_to_daemon::Status;
use report::{LatencyFacts, LoopLatency};

/// A process, and what the kernel says it has used.
#[derive(Clone, Debug, PartialEq)]
struct Used {
    /// `daemon`, `world`, or the name of a robot.
    process: String,
    cpu_s: Option<f64>,
    resident_bytes: Option<u64>,
}

/// A fleet at one moment.
struct Sight {
    fleet: String,
    status: Status,
    contacts: u64,
    latency: LatencyFacts,
    used: Vec<Used>,
    shm_bytes: u64,
}

/// Prints it.
///
/// # Errors
/// When no fleet is running, it must be named, or it has just ended.
pub fn run(options: &MetricsArgs) -> Result<(), Failure> {
    let entry = fleet::choose_entry(&options.fleet)?;
    let address = &entry.address;
    let sight = look(&entry).map_err(|failure| match address.root().exists() {
        true => failure,
        false => Failure::environment(format!("fleet `{}`: the run has ended", address.id()))
            .hint("`shoal ps` lists running fleets"),
    })?;
    out::data(&text(&sight))
}

fn look(entry: &FleetEntry) -> Result<Sight, Failure> {
    let (address, status) = (&entry.address, ps::seen(entry)?);
    let of_robots = status.robots.iter().filter_map(|robot| Some((robot.id.clone(), robot.pid?)));
    let of_fleet = [("daemon".to_owned(), status.daemon_pid), ("world".to_owned(), status.world_pid)];
    let used = of_fleet.into_iter().chain(of_robots).filter(|(_, pid)| *pid != 0).map(|(process, pid)| Used {
        process,
        cpu_s: clock::schedstat_of(pid).map(|stat| stat.ran_ns as f64 * 1e-9),
        resident_bytes: resident_bytes(pid),
    });
    Ok(Sight {
        fleet: address.id().to_owned(),
        used: used.collect(),
        contacts: Gate::open(address)?.progress().contacts,
        latency: latency::facts(address)?,
        shm_bytes: clean::usage(address),
        status,
    })
}

/// Memory of a process that is present, bytes; `None` for one that has ended.
fn resident_bytes(pid: u32) -> Option<u64> {
    #[expect(clippy::disallowed_methods, reason = "the verb reads /proc")]
    let statm = std::fs::read_to_string(format!("/proc/{pid}/statm")).ok()?;
    let pages: u64 = statm.split_ascii_whitespace().nth(1)?.parse().ok()?;
    Some(pages * rustix::param::page_size() as u64)
}

fn text(sight: &Sight) -> String {
    let mut out = Exposition::default();
    let (fleet, status) = (("fleet", sight.fleet.as_str()), &sight.status);
    let info = [fleet, ("scenario", status.scenario.as_str()), ("mode", status.mode.word())];
    out.family("shoal_fleet_info", Kind::Gauge, "The fleet; always 1.").sample(&info, 1.0);
    out.family("shoal_ticks_total", Kind::Counter, "Ticks that the world has done.")
        .sample(&[fleet], status.tick as f64);
    out.family("shoal_simulated_time_seconds", Kind::Gauge, "Simulated time.").sample(&[fleet], status.time_s);
    let mut age = out.family("shoal_tick_age_seconds", Kind::Gauge, "Wall time since the newest tick.");
    if let Some(age_s) = status.tick_age_s {
        age.sample(&[fleet], age_s);
    }
    out.family("shoal_contacts_total", Kind::Counter, "Contacts between robots and with obstacles.")
        .sample(&[fleet], sight.contacts as f64);
    out.family("shoal_shared_memory_bytes", Kind::Gauge, "Shared memory of the fleet.")
        .sample(&[fleet], sight.shm_bytes as f64);
    let mut robots = out.family("shoal_robots", Kind::Gauge, "Robots by the state of their process.");
    for state in ProcessState::ALL {
        let count = status.robots.iter().filter(|robot| robot.state == *state).count();
        robots.sample(&[fleet, ("state", state.word())], count as f64);
    }
    let arrived = status.robots.iter().filter(|robot| robot.arrived).count();
    out.family("shoal_robots_arrived", Kind::Gauge, "Robots that are at their last goal.")
        .sample(&[fleet], arrived as f64);
    of_robots(
        &mut out,
        sight,
        "shoal_robot_goals_done_total",
        Kind::Counter,
        "Goals that the robot has reached.",
        |robot| robot.goals_done,
    );
    of_robots(
        &mut out,
        sight,
        "shoal_robot_goals_left",
        Kind::Gauge,
        "Goals that the robot has not reached.",
        |robot| robot.goals_left,
    );
    of_robots(
        &mut out,
        sight,
        "shoal_robot_restarts_total",
        Kind::Counter,
        "Restarts of the robot's process.",
        |robot| robot.restarts,
    );
    loops(&mut out, sight);
    for metric in Metric::ALL {
        quantiles(&mut out, sight, metric);
    }
    let mut cpu = out.family(
        "shoal_process_cpu_seconds_total",
        Kind::Counter,
        "Processor time of the process's main thread, in its present life.",
    );
    for used in &sight.used {
        if let Some(cpu_s) = used.cpu_s {
            cpu.sample(&[fleet, ("process", &used.process)], cpu_s);
        }
    }
    let mut memory =
        out.family("shoal_process_resident_memory_bytes", Kind::Gauge, "Memory of the process, shared pages included.");
    for used in &sight.used {
        if let Some(bytes) = used.resident_bytes {
            memory.sample(&[fleet, ("process", &used.process)], bytes as f64);
        }
    }
    out.into_text()
}

fn of_robots(
    out: &mut Exposition,
    sight: &Sight,
    name: &str,
    kind: Kind,
    help: &str,
    value: fn(&protocol::operator_to_daemon::RobotStatus) -> u32,
) {
    let mut family = out.family(name, kind, help);
    for robot in &sight.status.robots {
        family.sample(&[("fleet", &sight.fleet), ("robot", &robot.id)], value(robot).into());
    }
}

/// The loops of the robots, and that of the world.
fn all_loops(sight: &Sight) -> impl Iterator<Item = &LoopLatency> {
    sight.latency.per_robot.iter().chain(&sight.latency.world)
}

fn loops(out: &mut Exposition, sight: &Sight) {
    let labels = |of: &LoopLatency| [("fleet", sight.fleet.clone()), ("process", of.id.clone())];
    fn as_str<'a, const N: usize>(labels: &'a [(&'static str, String); N]) -> [(&'static str, &'a str); N] {
        labels.each_ref().map(|(key, value)| (*key, value.as_str()))
    }
    let mut periods =
        out.family("shoal_periods_total", Kind::Counter, "Periods of the process's loop, or ticks answered.");
    for of in all_loops(sight) {
        periods.sample(&as_str(&labels(of)), of.periods as f64);
    }
    let mut missed = out.family(
        "shoal_missed_periods_total",
        Kind::Counter,
        "Periods that were over before their work was; in realtime.",
    );
    for of in all_loops(sight) {
        if let Some(misses) = of.deadline_misses {
            missed.sample(&as_str(&labels(of)), misses as f64);
        }
    }
    let mut late = out.family("shoal_late_periods_total", Kind::Counter, "Late periods by their cause; in realtime.");
    for of in all_loops(sight) {
        for (cause, count) in of.blame.iter().flat_map(|blame| blame.by_cause.iter()) {
            let [fleet, process] = labels(of);
            let labels = [fleet, process, ("cause", cause.field().to_owned())];
            late.sample(&as_str(&labels), *count as f64);
        }
    }
}

fn quantiles(out: &mut Exposition, sight: &Sight, metric: Metric) {
    let name = format!("shoal_{}_seconds", metric.field().trim_end_matches("_us"));
    let mut family = out.family(&name, Kind::Summary, &format!("{}.", metric.help()));
    for of in all_loops(sight) {
        let Some(found) = of.metrics[metric] else { continue };
        let labels = [("fleet", sight.fleet.as_str()), ("process", of.id.as_str())];
        let quantiles =
            [("0.5", found.p50), ("0.9", found.p90), ("0.99", found.p99), ("0.999", found.p999), ("1", found.max)];
        for (quantile, micros) in quantiles {
            family.sample(&[labels[0], labels[1], ("quantile", quantile)], micros * 1e-6);
        }
        family.count(&labels, found.n);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::{Cause, Mode, PerCause, PerMetric, RobotIndex};
    use protocol::operator_to_daemon::RobotStatus;
    use report::{Blame, Percentiles};
    use shoal_tests::prometheus::parse;

    fn sight() -> Sight {
        let robot = |id: &str, state, incarnation| RobotStatus {
            id: id.to_owned(),
            state,
            incarnation,
            restarts: incarnation,
            goals_done: 2,
            goals_left: 1,
            ..RobotStatus::default()
        };
        let percentiles = Percentiles { p50: 10.0, p90: 20.0, p99: 30.0, p999: 40.0, max: 50.0, n: 7 };
        let of_loop = |id: &str| LoopLatency {
            id: id.to_owned(),
            index: Some(RobotIndex(0)),
            metrics: PerMetric::of(|metric| (metric != Metric::Reaction).then_some(percentiles)),
            periods: 100,
            deadline_misses: Some(3),
            blame: Some(Blame::of(PerCause::of(|cause| u64::from(cause == Cause::Planner)))),
            run_queue_wait: None,
        };
        Sight {
            fleet: "abcd234".to_owned(),
            status: Status {
                scenario: "a \"strange\\name\nof a scenario".to_owned(),
                mode: Mode::Realtime,
                tick: 512,
                time_s: 10.24,
                tick_age_s: Some(0.013),
                waits_for: Vec::new(),
                robots: vec![robot("r00", ProcessState::Running, 0), robot("r01", ProcessState::Dead, 3)],
                ..Status::default()
            },
            contacts: 4,
            latency: LatencyFacts {
                per_robot: vec![of_loop("r00"), of_loop("r01")],
                world: Some(of_loop("world")),
                ..LatencyFacts::default()
            },
            used: vec![Used { process: "r00".to_owned(), cpu_s: Some(1.5), resident_bytes: Some(1 << 20) }],
            shm_bytes: 1 << 22,
        }
    }

    #[test]
    fn what_is_printed_is_in_the_format() {
        let families = parse(&text(&sight())).unwrap_or_else(|problem| panic!("{problem}"));
        let value = |name: &str, labels: &[(&str, &str)]| {
            let found = families.iter().flat_map(|family| &family.samples).find(|sample| {
                let has = |(key, value): &(&str, &str)| sample.labels.iter().any(|(k, v)| k == key && v == value);
                sample.name == name && labels.iter().all(has)
            });
            found.unwrap_or_else(|| panic!("{name} {labels:?}")).value
        };
        assert_eq!(value("shoal_fleet_info", &[("scenario", "a \"strange\\name\nof a scenario")]), 1.0);
        assert_eq!(value("shoal_robots", &[("state", "dead")]), 1.0);
        assert_eq!(value("shoal_robots", &[("state", "paused")]), 0.0);
        assert_eq!(value("shoal_robot_restarts_total", &[("robot", "r01")]), 3.0);
        assert_eq!(value("shoal_late_periods_total", &[("process", "world"), ("cause", "planner")]), 1.0);
        assert!((value("shoal_plan_seconds", &[("process", "r00"), ("quantile", "0.99")]) - 30e-6).abs() < 1e-12);
        assert_eq!(value("shoal_plan_seconds_count", &[("process", "r00")]), 7.0);
        assert_eq!(value("shoal_process_resident_memory_bytes", &[("process", "r00")]), 1_048_576.0);
        // Every sample says of which fleet it is.
        for sample in families.iter().flat_map(|family| &family.samples) {
            assert!(sample.labels.contains(&("fleet".to_owned(), "abcd234".to_owned())), "{sample:?}");
        }
    }

    #[test]
    fn the_page_names_every_family() {
        let page = include_str!("../../../docs/metrics.md");
        for family in parse(&text(&sight())).unwrap_or_else(|problem| panic!("{problem}")) {
            let named = page.lines().find(|line| line.starts_with('|') && line.contains(&format!("`{}`", family.name)));
            let row = named.unwrap_or_else(|| panic!("docs/metrics.md does not name {}", family.name));
            assert!(row.contains(&format!("| {} |", family.kind)), "{row}");
        }
    }

    /// Dashboards know them: a name that changes is a change for users.
    #[test]
    fn the_names() {
        let text = text(&sight());
        let heads: Vec<&str> = text.lines().filter(|line| line.starts_with('#')).collect();
        insta::assert_snapshot!(heads.join("\n"));
    }
}
