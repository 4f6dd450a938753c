//! From the statistics that the processes of a fleet leave in shared memory to latencies: at the end of a run, and while
//! it goes on. Pure.

use crate::{Blame, LatencyFacts, LoopLatency, Percentiles, ProcessFacts};
use bus::{Counter, Metric, StatsSnapshot};
use model::Seat;
use std::collections::BTreeMap;

/// The robots' statistics by slot, all lives of a robot together, and the world's. Files of others are left out.
pub fn by_robot(stats: &[(String, StatsSnapshot)]) -> (BTreeMap<u32, StatsSnapshot>, Option<StatsSnapshot>) {
    let (mut robots, mut world) = (BTreeMap::<u32, StatsSnapshot>::new(), None);
    for (name, snapshot) in stats {
        if let Some(seat) = seat_of(name) {
            robots.entry(seat.slot).or_default().merge(snapshot);
        } else if name == bus::stats::WORLD {
            world = Some(snapshot.clone());
        }
    }
    (robots, world)
}

/// Whose agent a file of statistics belongs to.
pub fn seat_of(name: &str) -> Option<Seat> {
    let (slot, incarnation) = name.strip_prefix("agent-")?.split_once('-')?;
    Some(Seat { slot: slot.parse().ok()?, incarnation: incarnation.parse().ok()? })
}

/// How the loops of a fleet did. `name` knows the robots by slot; without one a slot names itself.
pub fn latency(
    stats: &[(String, StatsSnapshot)],
    name: &dyn Fn(u32) -> Option<String>,
    realtime: bool,
) -> LatencyFacts {
    let (robots, world) = by_robot(stats);
    let mut merged = world.clone().unwrap_or_default();
    robots.values().for_each(|snapshot| merged.merge(snapshot));

    let of_world = |metric| -> BTreeMap<u32, Percentiles> {
        let kept = world.iter().flat_map(|world| world.by_robot(metric));
        kept.map(|(slot, percentiles)| (slot, micros(percentiles))).collect()
    };
    let (command_ages, reactions) = (of_world(Metric::CommandAge), of_world(Metric::Reaction));
    let per_robot = robots.iter().map(|(&slot, snapshot)| LoopLatency {
        id: name(slot).unwrap_or_else(|| format!("slot-{slot}")),
        slot: Some(slot),
        command_age_us: command_ages.get(&slot).copied(),
        reaction_us: reactions.get(&slot).copied(),
        ..of_loop(snapshot, realtime)
    });
    let at = |metric| percentiles(&merged, metric);
    LatencyFacts {
        pose_age_us: at(Metric::PoseAge),
        wake_us: at(Metric::Wake),
        plan_us: at(Metric::Plan),
        step_us: at(Metric::Step),
        command_age_us: at(Metric::CommandAge),
        reaction_us: at(Metric::Reaction),
        periods: realtime.then(|| merged.counter(Counter::Periods)),
        deadline_misses: realtime.then(|| merged.counter(Counter::DeadlineMisses)),
        blame: realtime.then(|| blame(&merged)),
        per_robot: per_robot.collect(),
        world: world.as_ref().map(|world| LoopLatency {
            id: ProcessFacts::WORLD.to_owned(),
            command_age_us: percentiles(world, Metric::CommandAge),
            reaction_us: percentiles(world, Metric::Reaction),
            ..of_loop(world, realtime)
        }),
    }
}

/// A metric of a snapshot, microseconds.
pub fn percentiles(snapshot: &StatsSnapshot, metric: Metric) -> Option<Percentiles> {
    snapshot.percentiles(metric).map(micros)
}

/// Nanoseconds to microseconds.
pub fn micros(p: bus::Percentiles) -> Percentiles {
    let [p50, p90, p99, p999, max] = [p.p50, p.p90, p.p99, p.p999, p.max].map(|ns| ns as f64 * 1e-3);
    Percentiles { p50, p90, p99, p999, max, n: p.n }
}

fn of_loop(snapshot: &StatsSnapshot, realtime: bool) -> LoopLatency {
    let at = |metric| percentiles(snapshot, metric);
    let (waited, watched) = (snapshot.counter(Counter::WaitedNs), snapshot.counter(Counter::WatchedNs));
    LoopLatency {
        pose_age_us: at(Metric::PoseAge),
        wake_us: at(Metric::Wake),
        plan_us: at(Metric::Plan),
        step_us: at(Metric::Step),
        periods: snapshot.counter(Counter::Periods),
        deadline_misses: realtime.then(|| snapshot.counter(Counter::DeadlineMisses)),
        blame: realtime.then(|| blame(snapshot)),
        run_queue_wait: (watched > 0).then(|| waited as f64 / watched as f64),
        ..LoopLatency::default()
    }
}

fn blame(snapshot: &StatsSnapshot) -> Blame {
    let [scheduler, planner, world, input, neither] = snapshot.late();
    Blame { late: snapshot.late().iter().sum(), scheduler, planner, world, input, neither }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::{Address, Cause, StatsWriter, Strips, clean};

    #[test]
    fn lives_of_a_robot_count_together_and_the_world_says_what_it_knows_of_each() {
        let address = Address::create().unwrap();
        let agent = |name: &str, plan_ns: u64, late: Cause| {
            let mut stats =
                StatsWriter::create(&address, name, &[Metric::Plan, Metric::Wake], Strips::of_agent(4)).unwrap();
            stats.record(Metric::Plan, plan_ns);
            stats.add(Counter::Periods, 10);
            stats.add(Counter::DeadlineMisses, 1);
            stats.add(Counter::late(late), 2);
            stats.add(Counter::WaitedNs, 50);
            stats.add(Counter::WatchedNs, 1000);
        };
        agent("agent-2-0", 1000, Cause::Planner);
        agent("agent-2-1", 9000, Cause::Neither);
        agent("agent-0-0", 5000, Cause::Scheduler);
        let mut world =
            StatsWriter::create(&address, bus::stats::WORLD, &[Metric::Reaction], Strips::of_world(4)).unwrap();
        world.add(Counter::Periods, 10);
        world.add(Counter::late(Cause::World), 1);
        world.record(Metric::Reaction, 7_000);
        world.record_of(2, Metric::Reaction, 7_000, 1);
        let stats = bus::stats::read_all(&address);
        clean::sweep(&address);

        let stats = stats.unwrap();
        let name = |slot: u32| (slot == 0).then(|| "scout".to_owned());
        let facts = latency(&stats, &name, true);
        assert_eq!((facts.periods, facts.deadline_misses), (Some(40), Some(3)));
        let blame = Blame { late: 7, scheduler: 2, planner: 2, world: 1, input: 0, neither: 2 };
        assert_eq!(facts.blame, Some(blame));
        let robots: Vec<(&str, u64, u64)> = (facts.per_robot.iter())
            .map(|robot| (robot.id.as_str(), robot.periods, robot.plan_us.unwrap().n))
            .collect();
        assert_eq!(robots, [("scout", 10, 1), ("slot-2", 20, 2)]);
        let second = &facts.per_robot[1];
        assert_eq!((second.plan_us.unwrap().max, second.run_queue_wait), (9.0, Some(0.05)));
        assert_eq!(second.blame, Some(Blame { late: 4, planner: 2, neither: 2, ..Blame::default() }));
        assert_eq!((second.reaction_us.unwrap().max, facts.per_robot[0].reaction_us), (7.0, None));
        let world = facts.world.unwrap();
        assert_eq!((world.id.as_str(), world.reaction_us.unwrap().n, world.blame.unwrap().world), ("world", 1, 1));

        let facts = latency(&stats, &name, false);
        assert_eq!((facts.periods, facts.blame, facts.per_robot[0].blame), (None, None, None));
        assert_eq!(seat_of("agent-12-3"), Some(Seat { slot: 12, incarnation: 3 }));
        assert_eq!((seat_of("agent-12"), seat_of("world"), seat_of("agent-x-1")), (None, None, None));
    }
}
