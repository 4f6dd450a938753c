//! From the statistics that the processes of a fleet leave in shared memory to latencies: at the end of a run, and while
//! it goes on. Pure.

use crate::{Blame, LatencyFacts, LoopLatency, Percentiles, ProcessFacts};
use bus::stats::by_robot;
use bus::{Counter, StatsSnapshot};
use model::{PerMetric, RobotIndex};
use std::collections::BTreeMap;

/// How the loops of a fleet did. `name` knows the robots by slot; without one a slot names itself.
pub fn latency(
    stats: &[(String, StatsSnapshot)],
    name: &dyn Fn(RobotIndex) -> Option<String>,
    realtime: bool,
) -> LatencyFacts {
    let (robots, world) = by_robot(stats);
    let mut merged = world.clone().unwrap_or_default();
    robots.values().for_each(|snapshot| merged.merge(snapshot));

    let kept = |metric| world.iter().flat_map(move |world: &StatsSnapshot| world.by_robot(metric));
    let of_world = PerMetric::of(|metric| kept(metric).collect::<BTreeMap<RobotIndex, bus::Percentiles>>());
    let per_robot = robots.iter().map(|(&slot, snapshot)| {
        let mut found = of_loop(name(slot).unwrap_or_else(|| format!("slot-{slot}")), snapshot, realtime);
        found.index = Some(slot);
        for (metric, of_world) in of_world.iter().filter(|(metric, _)| metric.is_of_world()) {
            found.metrics[metric] = of_world.get(&slot).copied().map(micros);
        }
        found
    });
    LatencyFacts {
        metrics: metrics(&merged),
        periods: realtime.then(|| merged.counter(Counter::Periods)),
        deadline_misses: realtime.then(|| merged.counter(Counter::DeadlineMisses)),
        blame: realtime.then(|| Blame::of(merged.late())),
        per_robot: per_robot.collect(),
        world: world.as_ref().map(|world| of_loop(ProcessFacts::WORLD.to_owned(), world, realtime)),
    }
}

/// Every metric of a snapshot, microseconds.
fn metrics(snapshot: &StatsSnapshot) -> PerMetric<Option<Percentiles>> {
    PerMetric::of(|metric| snapshot.percentiles(metric).map(micros))
}

/// Nanoseconds to microseconds.
pub fn micros(p: bus::Percentiles) -> Percentiles {
    let [p50, p90, p99, p999, max] = [p.p50, p.p90, p.p99, p.p999, p.max].map(|ns| ns as f64 * 1e-3);
    Percentiles { p50, p90, p99, p999, max, n: p.n }
}

fn of_loop(id: String, snapshot: &StatsSnapshot, realtime: bool) -> LoopLatency {
    let (waited, watched) = (snapshot.counter(Counter::WaitedNs), snapshot.counter(Counter::WatchedNs));
    LoopLatency {
        id,
        index: None,
        metrics: metrics(snapshot),
        periods: snapshot.counter(Counter::Periods),
        deadline_misses: realtime.then(|| snapshot.counter(Counter::DeadlineMisses)),
        blame: realtime.then(|| Blame::of(snapshot.late())),
        run_queue_wait: (watched > 0).then(|| waited as f64 / watched as f64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::{Address, StatsWriter, Strips, clean};
    use model::{Cause, Metric, PerCause};

    fn late<const N: usize>(causes: [(Cause, u64); N]) -> Blame {
        let mut by_cause = PerCause::default();
        causes.into_iter().for_each(|(cause, n)| by_cause[cause] = n);
        Blame::of(by_cause)
    }

    #[test]
    fn lives_of_a_robot_count_together_and_the_world_says_what_it_knows_of_each() {
        let address = Address::create().unwrap();
        let agent = |name: &str, plan_ns: u64, late: Cause| {
            let mut stats =
                StatsWriter::create(&address, name, &[Metric::Plan, Metric::Wake], Strips::of_agent(4)).unwrap();
            stats.record(Metric::Plan, plan_ns);
            stats.add(Counter::Periods, 10);
            stats.add(Counter::DeadlineMisses, 1);
            stats.add_late(late, 2);
            stats.add(Counter::WaitedNs, 50);
            stats.add(Counter::WatchedNs, 1000);
        };
        agent("agent-2-0", 1000, Cause::Planner);
        agent("agent-2-1", 9000, Cause::Neither);
        agent("agent-0-0", 5000, Cause::Scheduler);
        let mut world =
            StatsWriter::create(&address, bus::stats::WORLD, &[Metric::Reaction], Strips::of_world(4)).unwrap();
        world.add(Counter::Periods, 10);
        world.add_late(Cause::World, 1);
        world.record(Metric::Reaction, 7_000);
        world.record_of(RobotIndex(2), Metric::Reaction, 7_000, 1);
        let stats = bus::stats::read_all(&address);
        clean::sweep(&address);

        let stats = stats.unwrap();
        let name = |slot: RobotIndex| (slot.0 == 0).then(|| "scout".to_owned());
        let facts = latency(&stats, &name, true);
        assert_eq!((facts.periods, facts.deadline_misses), (Some(40), Some(3)));
        let blame = late([(Cause::Scheduler, 2), (Cause::Planner, 2), (Cause::World, 1), (Cause::Neither, 2)]);
        assert_eq!(facts.blame, Some(blame));
        let robots: Vec<(&str, u64, u64)> = (facts.per_robot.iter())
            .map(|robot| (robot.id.as_str(), robot.periods, robot.metrics[Metric::Plan].unwrap().n))
            .collect();
        assert_eq!(robots, [("scout", 10, 1), ("slot-2", 20, 2)]);
        let second = &facts.per_robot[1];
        assert_eq!((second.metrics[Metric::Plan].unwrap().max, second.run_queue_wait), (9.0, Some(0.05)));
        assert_eq!(second.blame, Some(late([(Cause::Planner, 2), (Cause::Neither, 2)])));
        assert_eq!(
            (second.metrics[Metric::Reaction].unwrap().max, facts.per_robot[0].metrics[Metric::Reaction]),
            (7.0, None)
        );
        let world = facts.world.unwrap();
        assert_eq!(
            (
                world.id.as_str(),
                world.metrics[Metric::Reaction].unwrap().n,
                world.blame.unwrap().by_cause[Cause::World]
            ),
            ("world", 1, 1)
        );

        let facts = latency(&stats, &name, false);
        assert_eq!((facts.periods, facts.blame, facts.per_robot[0].blame), (None, None, None));
    }
}
