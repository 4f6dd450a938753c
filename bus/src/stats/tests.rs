#![expect(clippy::disallowed_methods, reason = "tests look at files")]

use super::*;
use model::{PerCause, RobotIndex, RobotInstance};
use proptest::prelude::*;

/// Writes as `write` does, and reads as everybody does.
fn written(metrics: &[Metric], strips: Strips<'_>, write: impl FnOnce(&mut StatsWriter)) -> StatsSnapshot {
    let address = Address::create().unwrap();
    let mut writer = StatsWriter::create(&address, "agent-1", metrics, strips).unwrap();
    write(&mut writer);
    drop(writer);
    let all = read_all(&address);
    crate::clean::sweep(&address);
    let mut all = all.unwrap();
    assert_eq!((all.len(), all[0].0.as_str()), (1, "agent-1"));
    assert!(read_all(&address).unwrap_err().is_missing());
    all.remove(0).1
}

/// The value below which this share of all values lies, by sorting them.
fn exact(sorted: &[u64], quantile: f64) -> u64 {
    sorted[((quantile * sorted.len() as f64).ceil() as usize).max(1) - 1]
}

fn check(found: Percentiles, mut values: Vec<u64>, share: f64, least: f64) -> Result<(), TestCaseError> {
    values.sort_unstable();
    prop_assert_eq!((found.n, found.max), (values.len() as u64, values[values.len() - 1]));
    for (quantile, found) in [(0.5, found.p50), (0.9, found.p90), (0.99, found.p99), (0.999, found.p999)] {
        let exact = exact(&values, quantile);
        let error = found.abs_diff(exact) as f64;
        prop_assert!(error <= (exact as f64 * share).max(least), "{quantile}: {found} for {exact}");
    }
    Ok(())
}

fn values() -> impl Strategy<Value = Vec<u64>> {
    proptest::collection::vec((0_u32..36).prop_flat_map(|bits| 0_u64..=1 << bits), 1..400)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 64, ..ProptestConfig::default() })]

    /// Through the file, merged from two writers, and read by somebody else.
    #[test]
    fn percentiles_are_within_one_percent(values in values(), split in 0_usize..400) {
        let address = Address::create().unwrap();
        let (left, right) = values.split_at(split.min(values.len()));
        for (name, part) in [("left", left), ("right", right)] {
            let mut writer = StatsWriter::create(&address, name, &[Metric::Step], Strips::NONE).unwrap();
            part.iter().for_each(|&ns| writer.record(Metric::Step, ns));
        }
        let all = read_all(&address);
        crate::clean::sweep(&address);
        let mut merged = StatsSnapshot::default();
        all.unwrap().iter().for_each(|(_, snapshot)| merged.merge(snapshot));
        // Half a bucket.
        check(merged.percentiles(Metric::Step).unwrap(), values, 1.0 / 128.0, 1.0)?;
    }

    #[test]
    fn strips_keep_robots_apart(values in values(), split in 0_usize..400) {
        let (left, right) = values.split_at(split.min(values.len()));
        let found = written(&[], Strips::of_agent(8), |writer| {
            for (robot, part) in [(3, left), (7, right)] {
                part.iter().for_each(|&ns| writer.record_of(RobotIndex(robot), Metric::PoseAge, ns, 1));
            }
        }).by_robot(Metric::PoseAge);
        let parts = [(3, left), (7, right)].into_iter().filter(|(_, part)| !part.is_empty());
        prop_assert_eq!(found.len(), parts.clone().count());
        for ((robot, found), (expected, part)) in found.into_iter().zip(parts) {
            prop_assert_eq!(robot, RobotIndex(expected));
            check(found, part.to_vec(), 0.064, 513.0)?;
        }
    }

    /// One stall counts like each of its periods on its own.
    #[test]
    fn a_stall_counts_for_every_period_in_it(
        longest in 0_u64..1 << 38, step in (0_u32..36).prop_flat_map(|bits| 1_u64..=1 << bits), n in 0_u64..1000,
    ) {
        let n = n.min(longest / step + 1);
        let found = written(&[Metric::Wake], Strips::NONE, |writer| {
            writer.record_stall(Metric::Wake, longest, step, n);
        });
        let expected = written(&[Metric::Wake], Strips::NONE, |writer| {
            (0..n).for_each(|k| writer.record(Metric::Wake, longest - k * step));
        });
        prop_assert_eq!(found.percentiles(Metric::Wake), expected.percentiles(Metric::Wake));
    }
}

#[test]
fn counters_add_up_and_what_was_not_measured_is_none() {
    let snapshot = written(&[Metric::Wake, Metric::Plan], Strips::NONE, |writer| {
        writer.add(Counter::Periods, 2);
        writer.add(Counter::Periods, 3);
        writer.add(Counter::DeadlineMisses, 9);
        writer.add_late(Cause::Planner, 4);
        writer.record(Metric::Reaction, 1);
        writer.record_of(RobotIndex(0), Metric::PoseAge, 1, 1);
        writer.record(Metric::Plan, u64::MAX);
    });
    assert_eq!((snapshot.counter(Counter::Periods), snapshot.counter(Counter::DeadlineMisses)), (5, 9));
    assert_eq!(snapshot.late(), PerCause::of(|cause| if cause == Cause::Planner { 4 } else { 0 }));
    assert_eq!((snapshot.percentiles(Metric::Wake), snapshot.percentiles(Metric::Reaction)), (None, None));
    assert_eq!(snapshot.by_robot(Metric::PoseAge), []);
    assert_eq!(snapshot.percentiles(Metric::Plan).unwrap().max, u64::MAX);
}

#[test]
fn a_spread_counts_every_value_once() {
    let snapshot = written(&[Metric::Wake], Strips::of_agent(4), |writer| {
        [0, 99, 101, 999_000, 1_001_000, u64::MAX].into_iter().for_each(|ns| writer.record(Metric::Wake, ns));
        [3_000, 900_000].into_iter().for_each(|ns| writer.record_of(RobotIndex(3), Metric::PoseAge, ns, 1));
    });
    let edges = [0, 100, 1_000_000, 1 << 35];
    assert_eq!(snapshot.spread(Metric::Wake, &edges), [2, 2, 1, 1]);
    assert_eq!(snapshot.spread_of(RobotIndex(3), Metric::PoseAge, &edges), [0, 2, 0, 0]);
    assert_eq!(
        (snapshot.spread(Metric::Plan, &edges), snapshot.spread_of(RobotIndex(2), Metric::PoseAge, &edges)),
        (vec![], vec![])
    );
}

#[test]
fn a_full_bucket_stays_full() {
    let snapshot = written(&[Metric::Wake], Strips::NONE, |writer| {
        // More of them than a bucket can count: an hour's stall of a loop of a million periods a second.
        writer.record_stall(Metric::Wake, 1 << 40, 1, (1 << 32) + 10);
        writer.record(Metric::Wake, 1 << 40);
        writer.record(Metric::Wake, 5);
    });
    let wake = snapshot.percentiles(Metric::Wake).unwrap();
    assert_eq!((wake.n, wake.max), (u64::from(u32::MAX) + 1, 1 << 40));
    assert!(wake.p50 >= (1 << 36) - (1 << 30), "the last bucket: {}", wake.p50);
}

#[test]
fn whoever_was_not_heard_for_longest_makes_room() {
    let robots = PAIRS_MAX as u32 + 2;
    let snapshot = written(&[], Strips::of_agent(robots), |writer| {
        // At time 1 there is room for all but the last two; at time 2 all but robots 1 and 2 are heard again.
        (0..robots).for_each(|robot| writer.record_of(RobotIndex(robot), Metric::PoseAge, 1000, 1));
        (0..PAIRS_MAX as u32).filter(|robot| ![1, 2].contains(robot)).for_each(|robot| {
            writer.record_of(RobotIndex(robot), Metric::PoseAge, 2000, 2);
        });
        // At time 3 a newcomer replaces one of those.
        writer.record_of(RobotIndex(robots - 1), Metric::PoseAge, 3000, 3);
    });
    let found = snapshot.by_robot(Metric::PoseAge);
    let kept: Vec<u32> = found.iter().map(|(robot, _)| robot.0).collect();
    let expected: Vec<u32> = (0..PAIRS_MAX as u32).filter(|&robot| robot != 1).chain([robots - 1]).collect();
    assert_eq!(kept, expected);
    assert_eq!((found[0].1.n, found[PAIRS_MAX - 1].1.n, found[PAIRS_MAX - 1].1.max), (2, 1, 3000));
    assert_eq!(snapshot.counter(Counter::UsesDropped), 2 + 1, "two found no room, and one use was robot 1's");
}

#[test]
fn damaged_files_are_none() {
    let address = Address::create().unwrap();
    let writer = StatsWriter::create(&address, "agent-1", &[Metric::Wake], Strips::of_agent(4)).unwrap();
    drop(writer);
    let path = address.file("stats/agent-1");
    let whole = std::fs::read(&path).unwrap();
    for len in [0, 7, 64, COUNTERS + 8, HISTOGRAMS + 1, whole.len() - 1] {
        std::fs::write(&path, &whole[..len]).unwrap();
        assert_eq!(read_all(&address).unwrap(), [], "{len}");
    }
    std::fs::write(&path, [&u64::MAX.to_ne_bytes(), &whole[8..]].concat()).unwrap();
    assert_eq!(read_all(&address).unwrap(), []);
    crate::clean::sweep(&address);
}

#[test]
fn what_a_process_that_has_ended_counted_is_taken_once() {
    let address = Address::create().unwrap();
    let mut writer = StatsWriter::create(&address, "agent-1", &[Metric::Wake], Strips::NONE).unwrap();
    writer.record(Metric::Wake, 1000);
    writer.add(Counter::Periods, 3);
    drop(writer);
    let taken = take(&address, "agent-1").unwrap();
    assert_eq!((taken.counter(Counter::Periods), taken.percentiles(Metric::Wake).unwrap().n), (3, 1));
    assert_eq!((take(&address, "agent-1"), read_all(&address).unwrap().len()), (None, 0));
    crate::clean::sweep(&address);
}

#[test]
fn a_file_says_whose_it_is() {
    assert_eq!(instance_of("agent-12-3"), Some(RobotInstance { index: RobotIndex(12), incarnation: 3 }));
    assert_eq!((instance_of("agent-12"), instance_of("world"), instance_of("agent-x-1")), (None, None, None));
}
