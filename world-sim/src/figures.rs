//! What the processes of a fleet have counted, for its record: read from their files, as `shoal latency` reads them.

use bus::{Address, Counter, Percentiles, StatsSnapshot};
use model::{Metric, PerMetric};
use record::{Counted, Figures, Spread};

/// Everything that was counted so far: the fleet, the world, and each robot. Nothing where the files cannot be read.
pub(crate) fn count(address: &Address) -> Vec<(Counted, Figures)> {
    let Ok(all) = bus::stats::read_all(address) else { return Vec::new() };
    let (robots, world) = bus::stats::by_robot(&all);
    let mut fleet = world.clone().unwrap_or_default();
    robots.values().for_each(|snapshot| fleet.merge(snapshot));
    let mut counted = vec![(Counted::Fleet, of(&fleet))];
    for (robot, snapshot) in robots {
        let mut figures = of(&snapshot);
        // What the world measures of each robot.
        for metric in Metric::ALL.into_iter().filter(|metric| metric.is_of_world()) {
            let kept = world.as_ref().map_or_else(Vec::new, |world| world.by_robot(metric));
            figures.spreads[metric] = kept.into_iter().find(|(who, _)| *who == robot).map(|(_, spread)| micros(spread));
        }
        counted.push((Counted::Robot(robot), figures));
    }
    counted.extend(world.map(|world| (Counted::World, of(&world))));
    counted
}

fn of(snapshot: &StatsSnapshot) -> Figures {
    let (waited, watched) = (snapshot.counter(Counter::WaitedNs), snapshot.counter(Counter::WatchedNs));
    Figures {
        periods: snapshot.counter(Counter::Periods),
        deadline_misses: snapshot.counter(Counter::DeadlineMisses),
        spreads: PerMetric::of(|metric| snapshot.percentiles(metric).map(micros)),
        late: snapshot.late(),
        run_queue_wait: (watched > 0).then(|| waited as f64 / watched as f64),
    }
}

fn micros(ns: Percentiles) -> Spread {
    let [p50, p90, p99, p999, max] = [ns.p50, ns.p90, ns.p99, ns.p999, ns.max].map(|ns| ns as f64 * 1e-3);
    Spread { n: ns.n, p50, p90, p99, p999, max }
}
