//! The summary of fabricated runs: figures that can be computed by hand, and its text.

use crate::support::{plan, record, records};
use report::layout;
use shoal_sweep::summary::{self, Summary};
use shoal_sweep::text::{self, Style};
use shoal_sweep::{Assertion, Plan, Record};

/// One scenario, a baseline and another planner, eight seeds.
fn eight() -> Plan {
    let plan = plan();
    let planners = vec!["straight".to_owned(), "decentralized-apf".to_owned()];
    Plan { scenarios: plan.scenarios[..1].to_vec(), planners, seeds: (0..8).collect(), ..plan }
}

/// Runs of that plan: the baseline needs 10 s, 11 s and so on; the other one 1 s more, fails with seed 2, and touches with
/// seed 5. The baseline fails with seed 7.
fn fabricated(plan: &Plan) -> Vec<Record> {
    let template = record(plan, 0);
    let fabricate = |index: usize| {
        let run = plan.run(index);
        let (seed, is_baseline) = (run.seed, run.planner == Some("straight"));
        let succeeds = if is_baseline { seed != 7 } else { seed != 2 && seed != 5 };
        let arrives = is_baseline && succeeds || !is_baseline && seed != 2;
        let makespan_s = 10.0 + seed as f64 + if is_baseline { 0.0 } else { 1.0 };
        Record {
            run: index,
            planner: run.planner.map(str::to_owned),
            varied: run.varied_map(),
            seed,
            success: succeeds,
            robots_due: 2,
            arrived: if arrives { 2 } else { 1 },
            deadlocked: usize::from(!arrives),
            robot_contacts: u64::from(!is_baseline && seed == 5) * 3,
            obstacle_contacts: 0,
            makespan_s: arrives.then_some(makespan_s),
            time_lost_s_mean: arrives.then_some(if is_baseline { 1.0 } else { 2.0 + seed as f64 }),
            goals_done: 4,
            throughput_per_s: Some(if is_baseline { 0.5 } else { 0.25 * seed.pow(2) as f64 }),
            reversals_per_m: (seed > 0).then_some(if is_baseline { 0.0 } else { 1.0 / seed as f64 }),
            crossings: if is_baseline { 0 } else { 5 },
            right_of_way_violations: if is_baseline { 0 } else { 2 },
            trajectory_hash: format!("{index:016x}"),
            ..template.clone()
        }
    };
    (0..plan.runs()).map(fabricate).collect()
}

fn summary(assertions: &[&str]) -> Summary {
    let plan = eight();
    let assertions: Vec<Assertion> = assertions.iter().map(|text| Assertion::parse(text).unwrap()).collect();
    summary::summarize(&plan, &fabricated(&plan), Some("straight"), &assertions)
}

#[test]
fn figures_are_those_of_the_runs() {
    let summary = summary(&[]);
    assert_eq!((summary.runs, summary.successes, summary.failures.len()), (32, 26, 6));
    let [straight, other] = [&summary.rows[0], &summary.rows[2]];
    assert_eq!((straight.successes, straight.arrived, straight.against_baseline.is_none()), (7, 15, true));
    assert_eq!(straight.makespan_s_median, Some(13.0), "of 10 to 16");
    // 11, 12, 14, 15, 17, 18: seed 5 arrived, but touched.
    assert_eq!((other.successes, other.makespan_s_median, other.robot_contacts), (6, Some(14.5), 3));
    let paired = other.against_baseline.as_ref().unwrap();
    // Seeds 0, 1, 3, 4, 6: 11, 12, 14, 15, 17 against 10, 11, 13, 14, 16.
    assert_eq!((paired.pairs, paired.only_this, paired.only_baseline), (5, 1, 2));
    assert_eq!((paired.difference_s_median, paired.makespan_ratio), (Some(1.0), Some(14.0 / 13.0)));
    assert_eq!(paired.difference_s_median_95, Some([1.0, 1.0]));
    let [low, high] = paired.makespan_ratio_95.unwrap();
    assert!((17.0 / 16.0..=14.0 / 13.0).contains(&low) && (14.0 / 13.0..=1.1).contains(&high), "[{low}, {high}]");
    assert_eq!((summary.planners[0].makespan_ratio_mean, summary.planners[0].clean), (Some(1.0), 0));
    let failure = &summary.failures[1];
    assert_eq!(failure.cause, "1 of 2 arrived (1 deadlocked)");
    let expected = "shoal run pair.toml --mode single --planner straight --seed 7 --set defaults.speed_mps_max=1.5 --set \
                    clock.tick_hz=20";
    assert_eq!(failure.command, expected);
}

#[test]
fn lost_time_throughput_and_reversals_are_means_of_the_runs() {
    let summary = summary(&[]);
    let [straight, other] = [&summary.rows[0], &summary.rows[2]];
    assert_eq!((straight.time_lost_s_mean, straight.throughput_per_s_mean), (Some(1.0), Some(0.5)));
    // All but seed 2 arrive: 2 to 9 s without 4 s, over seven runs.
    assert_eq!((other.time_lost_s_mean, other.goals_done), (Some(40.0 / 7.0), 32));
    assert_eq!(other.throughput_per_s_mean, Some(4.375), "of all eight, those that failed included");
    let reversals = other.reversals_per_m_mean.unwrap();
    assert!((reversals - 363.0 / 140.0 / 7.0).abs() < 1e-12, "1 + 1/2 + ... + 1/7, over seven runs: {reversals}");
    let holds = |text: &str| self::summary(&[text]).assertions[0].holds;
    assert!(holds("straight:time_lost<=1") && !holds("time_lost<=1") && holds("time_lost<=5.75"));
    assert!(holds("throughput>=0.5") && !holds("throughput>0.5"));
    assert_eq!((other.crossings, other.right_of_way_violations), (40, 16), "of eight runs");
    assert!(!holds("straight:right_of_way_violations==0"), "there was no crossing");
    assert!(
        holds("decentralized-apf:right_of_way_violations<=0.4")
            && !holds("decentralized-apf:right_of_way_violations<0.4")
    );
    assert!(holds("straight:reversals_per_m==0") && !holds("reversals_per_m<0.3") && holds("reversals_per_m<0.4"));
}

#[test]
fn assertions_name_the_rows() {
    let holds = |text: &str| summary(&[text]).assertions[0].holds;
    assert!(holds("success>=0.75") && !holds("success>0.75") && holds("straight:success>0.75"));
    assert!(holds("straight:contacts==0") && !holds("contacts==0") && holds("contacts<=3"));
    assert!(holds("makespan_ratio<=1.1") && !holds("makespan_ratio<=1"), "the baseline is not compared with itself");
    assert!(holds("decentralized-apf:makespan_ratio<=1.1") && !holds("decentralized-apf:makespan_ratio<1.05"));
    let failed = &summary(&["contacts==0"]).assertions[0].failed;
    assert_eq!(failed[0].words(), "pair.toml, decentralized-apf, clock.tick_hz=10: contacts is 3");
    assert_eq!(failed.len(), 2);
}

#[test]
fn the_text_of_a_summary() {
    let summary = summary(&["success>=0.8", "straight:contacts==0", "decentralized-apf:makespan_ratio<=1.05"]);
    insta::assert_snapshot!(text::render(&summary, &Style::file(80)));
}

#[test]
fn a_flow_has_a_throughput_and_a_wide_page_the_time_lost() {
    let plan = eight();
    let arriving = fabricated(&plan);
    let flowing: Vec<Record> = (arriving.iter().cloned())
        .map(|record| Record { robots_due: 0, arrived: 0, makespan_s: None, time_lost_s_mean: None, ..record })
        .collect();
    let text = |records: &[Record], width: usize| {
        let page = layout::Style { width, color: false };
        let summary = summary::summarize(&plan, records, Some("straight"), &[]);
        text::render(&summary, &Style { page, failures_max: 0 })
    };
    let row =
        |text: &str| text.lines().find(|line| line.trim_start().starts_with("decentralized-apf")).unwrap().to_owned();
    let flow = text(&flowing, 80);
    assert!(row(&flow).ends_with("4.375") && flow.contains(" goals/s: goals"), "{flow}");
    assert!(!flow.contains("lost"), "{flow}");
    let wide = text(&arriving, 140);
    assert!(row(&wide).ends_with("5.71") && wide.contains(" lost s: "), "{wide}");
    assert!(!wide.contains("goals/s") && !text(&arriving, 80).contains("lost"), "{wide}");
}

#[test]
fn the_text_fits_its_width() {
    let summary = summary(&["success>=0.8"]);
    for width in [24, 40, 60, 80, 120] {
        let page = layout::Style { width, color: false };
        let text = text::render(&summary, &Style { page, failures_max: 3 });
        // Commands are copied: a piece of one is never cut.
        let is_command = |line: &&str| line.starts_with("    shoal run") || line.starts_with("       --");
        let wide = text.lines().filter(|line| !is_command(line)).find(|line| line.chars().count() > width);
        assert_eq!(wide, None, "{width}:\n{text}");
        assert!(text.contains("and 3 more") || width < 40, "{text}");
    }
}

/// A real sweep: every figure is there, and the seeds make a difference.
#[test]
fn real_runs_have_real_figures() {
    let plan = plan();
    let records = records(&plan);
    let summary = summary::summarize(&plan, &records, None, &[]);
    assert_eq!(summary.rows.len(), 8);
    assert!(summary.rows.iter().all(|row| row.trajectories == 2 && row.robots_due > 0), "{summary:#?}");
    assert!(records.iter().all(|record| record.robots == record.per_robot.len() && record.cost.cpu_s > 0.0));
    let touching = records.iter().filter(|record| !record.success).count();
    assert!(touching > 0 && touching < records.len(), "{touching} of {}", records.len());
}
