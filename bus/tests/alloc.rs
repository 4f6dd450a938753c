//! Statistics ask for no memory once their file is made, on time or late.

#[path = "../../tests/counting.rs"]
mod counting;

#[path = "it/home.rs"]
#[expect(dead_code, reason = "no other process joins")]
mod home;

use counting::calls;
use home::Home;
use model::{Metric, RobotIndex};
use shoal_bus::blame::{Period, Watch};
use shoal_bus::{Counter, StatsWriter, Strips, stats};

#[test]
fn counting_asks_for_no_memory() {
    const PERIOD_NS: u64 = 20_000_000;
    const ROBOTS: u32 = 100;
    let home = Home::new();
    let metrics = [Metric::PoseAge, Metric::Wake];
    let mut writer = StatsWriter::create(&home.0, "agent-0-0", &metrics, Strips::of_agent(ROBOTS)).unwrap();
    let mut watch = Watch::of_agent();
    let before = calls();
    let mut due_ns = PERIOD_NS;
    for n in 0..1000 {
        // Every tenth period is late, every fiftieth stalls for five; the robots in range change all the time.
        let late_ns = if n % 10 == 0 { PERIOD_NS / 2 } else { 50_000 };
        let (woken_ns, stall_ns) = (due_ns + late_ns, if n % 50 == 0 { 5 * PERIOD_NS } else { 0 });
        let done_ns = woken_ns + 20_000 + stall_ns;
        let period =
            Period { period_ns: PERIOD_NS, due_ns, woken_ns, done_ns, work_ns: 2000 + stall_ns, ..Period::default() };
        for slot in (0..20).map(|k| (n as u32 + k) % ROBOTS) {
            writer.record(Metric::PoseAge, 10_000_000);
            writer.record_of(RobotIndex(slot), Metric::PoseAge, 10_000_000, woken_ns);
        }
        watch.judge(&mut writer, period);
        due_ns += PERIOD_NS * period.missed().max(1);
    }
    assert_eq!(calls() - before, 0);
    drop(writer);
    let (_, found) = &stats::read_all(&home.0).unwrap()[0];
    let periods = due_ns / PERIOD_NS - 1;
    // Each stall was over in the sixth period from its start: five were missed, four of which never began.
    assert_eq!((found.counter(Counter::Periods), found.counter(Counter::DeadlineMisses)), (periods, 20 * 5));
    assert_eq!(found.percentiles(Metric::Wake).unwrap().n, periods);
    assert!(found.late().iter().map(|(_, n)| n).sum::<u64>() >= 100 + 20 * 4, "{:?}", found.late());
    let pairs: u64 = found.by_robot(Metric::PoseAge).iter().map(|(_, age)| age.n).sum();
    assert_eq!(pairs + found.counter(Counter::UsesDropped), 20 * 1000);
}
