//! The fields of the outcome, held against their definitions.

use super::*;

#[test]
fn outcome_fields_follow_their_definitions() {
    let outcome = assemble(failures()).outcome;
    assert_eq!((outcome.arrived, outcome.arrived_all, outcome.succeeded), (20, false, 18));
    assert_eq!((outcome.makespan_s, outcome.deadlocked, outcome.livelocked), (None, 2, 1));
    assert_eq!(outcome.mean_time_s, Some(10.0 + 0.5 * 9.5), "over those that arrived");

    let mut facts = single();
    facts.outcome.robots[2].joined_tick = 500;
    let outcome = assemble(facts).outcome;
    assert_eq!(outcome.makespan_s, Some(21.0), "of the fleet, since the first tick");
    assert_eq!(outcome.flowtime_s, Some(31.5), "of the robots, since they joined");

    let mut facts = single();
    facts.outcome.robots[2].arrived = false;
    facts.outcome.robots[2].time_s = None;
    facts.outcome.robots[2].gone = Some(Gone::Left);
    let report = assemble(facts);
    assert!(report.outcome.arrived_all, "a robot that left on request owes nothing");
    assert_eq!((report.exit_code, report.outcome.makespan_s), (0, Some(10.5)));

    let mut facts = single();
    facts.outcome.robots.remove(1);
    let report = assemble(facts);
    assert_eq!((report.robots, report.exit_code), (3, 1), "a robot that never joined has not arrived");
    assert_eq!(report.per_robot[1].gone, Some(Gone::NeverJoined));
}

#[test]
fn lost_time_goals_and_reversals_follow_their_definitions() {
    let outcome = assemble(single()).outcome;
    assert_eq!((outcome.time_lost_s_mean, outcome.time_lost_s_max), (Some(0.6), Some(1.1)));
    assert_eq!((outcome.goals_done, outcome.throughput_per_s), (3, Some(0.25)), "3 in 600 ticks at 50 Hz");
    // 0, 1 and 2 reversals on 10, 10.1 and 10.2 m: of the fleet, all by all, and not the mean of the robots'.
    assert_eq!(outcome.reversals_per_m, Some(3.0 / (10.0 + 10.1 + 10.2)));
    let robots = assemble(single()).per_robot;
    assert_eq!((robots[2].reversals, robots[2].reversals_per_m), (2, Some(2.0 / 10.2)));
    assert_eq!(robots[0].reversals_per_m, Some(0.0));

    // A patrol, a robot that stands and whose planner gave up, and one of which nothing can be said.
    let mut facts = single();
    facts.outcome.goals_done = 90;
    facts.robots[0].rounds = None;
    for fate in &mut facts.outcome.robots {
        (fate.arrived, fate.time_s, fate.path_ratio, fate.time_lost_s) = (false, None, None, None);
    }
    let stuck = &mut facts.outcome.robots[1];
    (stuck.stall, stuck.plan, stuck.end_speed_mps) = (Some(Stall::Oscillating), PlanState::GaveUp, Some(0.4));
    let still = &mut facts.outcome.robots[2];
    (still.path_length_m, still.reversals) = (0.0, 0);
    let report = assemble(facts.clone());
    assert_eq!((report.outcome.time_lost_s_mean, report.outcome.time_lost_s_max), (None, None));
    assert_eq!(report.outcome.throughput_per_s, Some(7.5));
    let robot = &report.per_robot[1];
    assert_eq!(
        (robot.state, robot.stall),
        (RobotState::GaveUp, Some(Stall::Oscillating)),
        "one does not hide the other"
    );
    assert_eq!((robot.end_speed_mps, report.outcome.oscillating), (Some(0.4), 1));
    assert_eq!(report.per_robot[2].reversals_per_m, None);
    let text = render(&report, Style { width: 80, color: false });
    assert!(text.contains("  goals           90 reached, 7.500 per s\n"), "{text}");
    assert!(!text.contains("lost"), "{text}");

    facts.outcome.goals_done = 0;
    let text = render(&assemble(facts.clone()), Style { width: 80, color: false });
    assert!(text.contains("  goals           0 reached, 0.000 per s\n"), "a flow that stands still: {text}");

    facts.outcome.ticks = 0;
    (facts.outcome.robots[0].path_length_m, facts.outcome.robots[1].path_length_m) = (0.0, 0.0);
    let outcome = assemble(facts).outcome;
    assert_eq!((outcome.throughput_per_s, outcome.reversals_per_m), (None, None));
}
