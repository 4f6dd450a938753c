//! Fixed facts, and what becomes of them.

mod expectations;
mod outcome;
mod reference;

use super::judge::{exit_code, impaired_because, starved_because, verdict};
use super::text::{Style, render};
use super::*;
use model::{
    BodyKind, Bounds, Class, Clock, Dynamics, Event, EventKind, Expect, FaultSource, Fleet, GoalSource, Limits, Metric,
    ParamValues, Partner, Physics, Processes, Radio, Restart, Robot, RobotOutcome, Scheduling, Silence, Stall, Stop,
    StragglerPolicy, Task, TaskEnd, TaskId, TimelineAction, TimelineEvent, Touch,
};

fn robot(slot: usize) -> Robot {
    Robot {
        id: format!("r{slot:02}"),
        kind: BodyKind::Point,
        limits: Limits {
            speed_mps_max: 1.0,
            reverse_mps_max: 0.0,
            turning_radius_m_min: 0.0,
            turn_radps_max: 1.0,
            accel_mps2_max: 1.0,
            turn_accel_radps2_max: 1.0,
        },
        arm: None,
        wheels: None,
        dynamics: Dynamics::default(),
        radius_m: 0.25,
        start: [slot as f64, 0.0].into(),
        start_yaw_rad: 0.0,
        goals: vec![[slot as f64, 10.0].into()],
        goal_yaw_rad: None,
        goal_yaw_tolerance_rad: 0.1,
        rounds: Some(1),
        goal_motion: None,
        goal_tolerance_m: 0.1,
        planner: "apf".into(),
        params: ParamValues::new(),
        filter: model::FilterKind::None,
        sensor_range_m: 3.0,
        radio_range_m: 5.0,
        radio_hysteresis_m: 0.5,
        sees_robots: true,
        knows_map: false,
        restart: Restart::NEVER,
        agent: None,
    }
}

fn scenario(robots: usize, mode: Mode) -> Scenario {
    Scenario {
        name: "crossing".into(),
        description: String::new(),
        bounds: Bounds { x_m: [-10.0, 10.0], y_m: [-10.0, 10.0] },
        physics: Physics::Kinematic,
        clock: Clock { mode, tick_hz: 50.0, seed: 7, ticks_max: 3000, stop: Stop::Arrived },
        fleet: Fleet {
            max_robots: robots,
            straggler: StragglerPolicy::Wait,
            straggler_limit_s: 10.0,
            stuck_limit_s: 60.0,
            command_timeout_s: 0.25,
            start_limit_s: 10.0,
        },
        processes: Processes::default(),
        radio: Radio::PERFECT,
        obstacles: Vec::new(),
        robots: (0..robots).map(robot).collect(),
        template: robot(0),
        map: None,
        templates_of_others: Vec::new(),
        events: Vec::new(),
        expect: Expect::default(),
        warnings: Vec::new(),
    }
}

/// All of them arrive, a little one after the other.
fn outcome(robots: usize) -> Outcome {
    let fate = |slot: usize| RobotOutcome {
        robot: RobotIndex::of(slot),
        arrived: true,
        time_s: Some(10.0 + 0.5 * slot as f64),
        arrived_tick: Some(500 + 25 * slot as u64),
        path_length_m: 10.0 + 0.1 * slot as f64,
        path_ratio: Some(1.0 + 0.01 * slot as f64),
        time_lost_s: Some(0.1 + 0.5 * slot as f64),
        reversals: slot as u32,
        goals_done: 1,
        ldj: Some(8.0),
        ..RobotOutcome::default()
    };
    Outcome {
        ticks: 600,
        trajectory_hash: 0x0123_4567_89ab_cdef,
        robots: (0..robots).map(fate).collect(),
        min_clearance_m: Some(0.312),
        goals_done: robots as u64,
        events: (0..robots).map(|robot| joined(0, robot as u32)).collect(),
        ..Outcome::default()
    }
}

fn event(tick: u64, robot: u32, kind: EventKind) -> Event {
    Event { tick, robot: Some(RobotIndex(robot)), kind }
}

fn contact(tick: u64, robot: u32, other: u32) -> Event {
    let touch = Touch { t_s: tick as f64 * 0.02, at_m: [1.5, -0.5] };
    event(tick, robot, EventKind::Contact { with: Partner::Robot(RobotIndex(other)), touch })
}

fn joined(tick: u64, robot: u32) -> Event {
    event(tick, robot, EventKind::Joined { incarnation: 0 })
}

fn not_started(robot: u32, why: &str) -> Event {
    event(0, robot, EventKind::NotStarted { why: why.to_owned() })
}

fn deaf(robot: u32, why: &str) -> Event {
    event(100, robot, EventKind::Deaf { why: why.to_owned() })
}

fn percentiles(p50: f64) -> Option<Percentiles> {
    Some(Percentiles { p50, p90: 2.0 * p50, p99: 4.0 * p50, p999: 8.0 * p50, max: 20.0 * p50, n: 12_345 })
}

fn with_processes(mut facts: RunFacts) -> RunFacts {
    let mut process = |name: String, instance: Option<RobotInstance>, pid: u32| {
        facts.processes.push(ProcessFacts {
            instance,
            cpu_s: 0.25,
            pss_kib: Some(2000 + u64::from(pid)),
            run_queue_wait_s: Some(0.01 * f64::from(pid % 7)),
            ..ProcessFacts::new(name, pid)
        });
    };
    process("daemon".into(), None, 100);
    process(ProcessFacts::WORLD.into(), None, 101);
    for (slot, robot) in facts.robots.iter().enumerate() {
        process(
            robot.id.clone(),
            Some(RobotInstance { index: RobotIndex::of(slot), incarnation: 0 }),
            102 + slot as u32,
        );
    }
    facts.startup_ms = Some(84.6);
    facts.shm_bytes = Some(3_400_000);
    let metrics = PerMetric::of(|metric| percentiles(typical_us(metric)));
    facts.latency = Some(LatencyFacts { metrics, ..LatencyFacts::default() });
    facts
}

fn typical_us(metric: Metric) -> f64 {
    match metric {
        Metric::PoseAge => 8200.0,
        Metric::Wake => 55.0,
        Metric::Plan => 3.25,
        Metric::CommandAge => 10_100.0,
        Metric::Reaction => 18_900.0,
        _ => 21.5,
    }
}

/// Late periods of which the rest was delayed by something else.
fn late<const N: usize>(late: u64, causes: [(Cause, u64); N]) -> Blame {
    Blame { late, by_cause: PerCause::of(|cause| causes.iter().find(|(of, _)| *of == cause).map_or(0, |(_, n)| *n)) }
}

fn single() -> RunFacts {
    RunFacts::new(scenario(3, Mode::Single), outcome(3), 0.05)
}

fn lockstep() -> RunFacts {
    with_processes(RunFacts::new(scenario(3, Mode::Lockstep), outcome(3), 1.5))
}

fn realtime(robots: usize) -> RunFacts {
    let mut facts = with_processes(RunFacts::new(scenario(robots, Mode::Realtime), outcome(robots), 12.01));
    let latency = facts.latency.as_mut().unwrap();
    (latency.periods, latency.deadline_misses) = (Some(600 * (robots as u64 + 1)), Some(0));
    latency.blame = Some(Blame::default());
    latency.per_robot = (0..robots).map(loop_of).collect();
    facts
}

fn loop_of(slot: usize) -> LoopLatency {
    LoopLatency {
        id: format!("r{slot:02}"),
        index: Some(RobotIndex::of(slot)),
        metrics: PerMetric::of(|metric| {
            matches!(metric, Metric::PoseAge | Metric::Wake).then(|| percentiles(typical_us(metric))).flatten()
        }),
        periods: 600,
        deadline_misses: Some(0),
        blame: Some(Blame::default()),
        run_queue_wait: Some(0.01),
    }
}

/// A robot that joined late with another method, one that was killed, a task, a jam, and two contacts.
fn failures() -> RunFacts {
    let mut facts = realtime(25);
    facts.outcome.ticks = 3000;
    facts.wall_time_s = 60.0;
    for slot in [3, 7] {
        facts.outcome.robots[slot].contacts = 2;
    }
    facts.outcome.robot_contacts = 2;
    facts.outcome.min_clearance_m = Some(-0.041);
    for slot in 20..25 {
        let fate = &mut facts.outcome.robots[slot];
        (fate.arrived, fate.time_s, fate.path_ratio, fate.time_lost_s) = (false, None, None, None);
        fate.stall = match slot {
            20 | 21 => Some(Stall::Deadlocked),
            22 => Some(Stall::Livelocked),
            _ => None,
        };
    }
    facts.outcome.robots[24].gone = Some(Gone::Dead);
    facts.outcome.robots[1].tasks_done = 1;
    facts.robots[2].planner = "straight".into();
    let task = Task::to([4.0, -2.0]);
    facts.outcome.events.extend([
        contact(210, 3, 7),
        event(250, 1, EventKind::Task { source: GoalSource::Operator(TaskId(0)), task, given_up: 0 }),
        event(300, 24, EventKind::Killed { source: FaultSource::Timeline }),
        event(400, 2, EventKind::Joined { incarnation: 1 }),
        contact(455, 3, 7),
        event(500, 0, EventKind::Arrived),
    ]);
    let held = EventKind::Held { silence: Silence::Stopped };
    facts.outcome.events.extend((0..12).map(|i| event(600 + i, 4, held.clone())));
    facts
}

fn interrupted() -> RunFacts {
    let mut facts = lockstep();
    facts.interrupted = true;
    facts.outcome.ticks = 505;
    for slot in [1, 2] {
        let fate = &mut facts.outcome.robots[slot];
        (fate.arrived, fate.time_s, fate.path_ratio, fate.time_lost_s) = (false, None, None, None);
    }
    facts
}

fn starved() -> RunFacts {
    let mut facts = realtime(15);
    let latency = facts.latency.as_mut().unwrap();
    latency.deadline_misses = Some(120);
    latency.blame = Some(self::late(812, [(Cause::Scheduler, 790), (Cause::Neither, 22)]));
    for (robot, late) in latency.per_robot.iter_mut().zip([20, 600, 0, 190, 2]) {
        robot.blame = Some(self::late(late, [(Cause::Scheduler, late)]));
    }
    latency.metrics[Metric::Wake] = percentiles(1500.0);
    facts.processes[3].run_queue_wait_s = Some(2.5);
    facts
}

#[test]
fn text_for_people() {
    for (name, facts) in [
        ("single", single()),
        ("lockstep", lockstep()),
        ("realtime", realtime(15)),
        ("failures", failures()),
        ("interrupted", interrupted()),
        ("starved", starved()),
    ] {
        let report = assemble(facts);
        for width in [80, 40] {
            let text = render(&report, Style { width, color: false });
            assert!(text.lines().all(|line| line.chars().count() <= width), "{name} at {width}:\n{text}");
            insta::assert_snapshot!(format!("text_{name}_{width}"), text);
        }
        let painted = render(&report, Style { width: 80, color: true });
        assert!(painted.starts_with("\x1b[1;3") && painted.matches('\x1b').count() == 2, "{painted}");
    }
}

#[test]
fn whoever_delayed_most_is_named_first() {
    let mut facts = starved();
    let latency = facts.latency.as_mut().unwrap();
    latency.blame = Some(late(130, [(Cause::Scheduler, 10), (Cause::Planner, 120)]));
    let text = render(&assemble(facts), Style { width: 80, color: false });
    assert!(text.contains("starved: the planner was too slow for its periods"), "{text}");
    assert!(text.contains("and what delayed them: 130 (scheduler 10, planner 120)"), "{text}");
    let most = |scheduler, neither| late(9, [(Cause::Scheduler, scheduler), (Cause::Neither, neither)]).most();
    assert_eq!([most(0, 0), most(4, 5), most(5, 5)], [None, Some((Cause::Neither, 5)), Some((Cause::Scheduler, 5))]);
}

#[test]
fn json_for_programs() {
    insta::assert_json_snapshot!("json_realtime", assemble(realtime(2)));
    insta::assert_json_snapshot!("json_single", assemble(single()));
}

#[test]
fn processors_and_classes_are_told_where_there_are_processes() {
    let scheduled = |mut facts: RunFacts| {
        facts.scenario.processes = Processes {
            world: Scheduling { cpus: vec![0], class: Some(Class::Fifo { priority: 20 }) },
            agents: Scheduling { cpus: vec![0, 1, 3], class: None },
            ..Processes::default()
        };
        assemble(facts)
    };
    let report = scheduled(lockstep());
    let told = serde_json::to_value(&report.resources.scheduling).unwrap();
    assert_eq!(told["world"], serde_json::json!({ "cpus": [0], "class": "fifo", "priority": 20 }));
    assert_eq!(told["agents"], serde_json::json!({ "cpus": [0, 1, 3], "class": null, "priority": null }));
    let text = render(&report, Style { width: 80, color: false });
    assert!(text.contains("on processor 0, as fifo 20") && text.contains("on processors 0-1,3"), "{text}");
    assert_eq!(scheduled(single()).resources.scheduling, None);
    assert_eq!(assemble(lockstep()).resources.scheduling, None);
}

#[test]
fn every_field_of_the_contract_is_there() {
    let json = serde_json::to_value(assemble(failures())).unwrap();
    let check = |at: &serde_json::Value, fields: &str| {
        for field in fields.split_whitespace() {
            assert!(at.get(field).is_some(), "`{field}` is missing in {at}");
        }
    };
    check(
        &json,
        "schema scenario mode planner filter seed robots tick_hz ticks sim_time_s wall_time_s rtf trajectory_hash \
         verdict exit_code outcome per_robot latency resources events",
    );
    check(
        &json["outcome"],
        "arrived arrived_all succeeded makespan_s flowtime_s mean_time_s path_length_m path_ratio_mean robot_contacts \
         obstacle_contacts min_clearance_m min_obstacle_clearance_m deadlocked livelocked oscillating ldj_mean filter_interventions \
         time_lost_s_mean time_lost_s_max goals_done throughput_per_s reversals_per_m \
         crossings right_of_way_violations",
    );
    check(
        &json["per_robot"][0],
        "id planner incarnation pid arrived time_s path_length_m path_ratio contacts tasks_done state final_distance_m \
         time_lost_s stall end_speed_mps reversals reversals_per_m",
    );
    check(
        &json["latency"],
        "pose_age_us wake_us plan_us step_us command_age_us reaction_us periods deadline_misses stragglers",
    );
    check(&json["latency"]["wake_us"], "p50 p90 p99 p999 max n");
    check(&json["resources"], "startup_ms cpu_s agent_pss_kib_mean agent_pss_kib_max shm_bytes");
    check(&json["events"][0], "tick t_s kind robot detail at_m touch_s");
    assert_eq!(json["schema"], "shoal.report/1");
    assert_eq!(json["planner"], "mixed");
    assert_eq!(json["verdict"], "valid");
}

#[test]
fn a_report_can_be_read_again() {
    for facts in [single(), lockstep(), failures(), starved()] {
        let report = assemble(facts);
        let text = serde_json::to_string(&report).unwrap();
        let again: Report = serde_json::from_str(&text).unwrap();
        // Numbers may move by one unit in the last place.
        assert_eq!((again.per_robot.len(), again.events.len()), (report.per_robot.len(), report.events.len()));
        assert_eq!(
            (again.unmet, again.starved_because, again.mode),
            (report.unmet, report.starved_because, report.mode)
        );
    }
}

#[test]
fn robots_that_were_added_have_names_too() {
    let mut facts = single();
    facts.outcome.robots.push(RobotOutcome {
        robot: RobotIndex(3),
        arrived: true,
        time_s: Some(1.0),
        ..RobotOutcome::default()
    });
    facts.outcome.events.push(joined(9, 3));
    facts.robots.push(RobotFacts { id: "scout".into(), rounds: Some(1), planner: "straight".into() });
    let report = assemble(facts);
    assert_eq!((report.robots, report.planner.as_str()), (4, "mixed"));
    assert_eq!(report.per_robot[3].id, "scout");
    assert_eq!(report.events.last().unwrap().robot.as_deref(), Some("scout"));
}

#[test]
fn the_newest_life_gives_the_pid() {
    let mut facts = lockstep();
    let mut again = facts.processes[3].clone();
    again.pid = 999;
    again.instance = Some(RobotInstance { index: RobotIndex(1), incarnation: 1 });
    facts.processes.insert(0, again);
    assert_eq!(assemble(facts).per_robot[1].pid, Some(999));
}

#[test]
fn exit_codes() {
    let check = |interrupted, met, timed_out, expected| {
        assert_eq!(exit_code(false, interrupted, met, timed_out), expected, "{interrupted} {met} {timed_out}");
    };
    check(false, true, false, 0);
    check(false, true, true, 0); // fewer had to arrive than all
    check(false, false, true, 4);
    check(false, false, false, 1);
    check(true, true, false, 130);
    check(true, false, false, 130);
    check(true, false, true, 130);
}

#[test]
fn exit_codes_of_whole_runs() {
    let check = |facts: RunFacts, expected: i32| assert_eq!(assemble(facts).exit_code, expected);
    check(single(), 0);
    check(starved(), 0);
    check(interrupted(), 130);
    check(failures(), 4);

    let mut contact = single();
    contact.outcome.obstacle_contacts = 1;
    check(contact.clone(), 1);
    contact.scenario.expect.contacts_max = 1;
    check(contact, 0);

    let mut enough = failures();
    (enough.scenario.expect.arrived_min, enough.scenario.expect.contacts_max) = (Some(20), 2);
    check(enough.clone(), 0);
    enough.scenario.expect.arrived_min = Some(21);
    check(enough, 4);
}

fn periods(missed: u64, of: u64) -> LatencyFacts {
    LatencyFacts { periods: Some(of), deadline_misses: Some(missed), ..LatencyFacts::default() }
}

#[test]
fn starvation() {
    let latency = |missed: u64, wake_p99: f64, stragglers: u64| {
        let mut measured = periods(missed, 10_000);
        measured.metrics[Metric::Wake] = Some(Percentiles { p99: wake_p99, n: 100, ..Percentiles::default() });
        LatencyReport { measured, stragglers, ..LatencyReport::default() }
    };
    let check = |mode, latency: Option<LatencyReport>, wait, starved: bool| {
        let reasons = starved_because(mode, 0.02, latency.as_ref(), wait);
        assert_eq!(verdict(&reasons, &[]) == Verdict::Starved, starved, "{mode:?} {latency:?} {wait:?}: {reasons:?}");
    };
    check(Mode::Realtime, Some(latency(10, 4000.0, 9)), Some(0.1), false); // all at their bounds
    check(Mode::Realtime, Some(latency(11, 0.0, 0)), None, true);
    check(Mode::Realtime, Some(latency(0, 4001.0, 0)), None, true);
    check(Mode::Realtime, Some(latency(0, 0.0, 0)), Some(0.101), true);
    check(Mode::Realtime, Some(LatencyReport { gaps: 1, gaps_ms: 3012, ..latency(0, 0.0, 0) }), None, true);
    check(Mode::Realtime, Some(LatencyReport::default()), None, false);
    check(Mode::Realtime, None, None, false);
    check(Mode::Lockstep, Some(latency(9999, 9e9, 0)), Some(0.9), false); // slow is not wrong
    check(Mode::Lockstep, Some(latency(0, 0.0, 1)), None, true);
    check(Mode::Single, None, Some(0.9), false);
}

/// Statistics are files that a process of the same user may remove, and an own agent may write none: what was not measured
/// says nothing against the run.
#[test]
fn a_realtime_run_without_statistics_keeps_its_verdict() {
    for latency in [None, Some(LatencyFacts::default())] {
        let report = assemble(RunFacts { latency, processes: Vec::new(), ..realtime(3) });
        assert_eq!((report.verdict, report.exit_code), (Verdict::Valid, 0), "{report:#?}");
        assert!(report.starved_because.is_empty() && report.impaired_because.is_empty(), "{report:#?}");
    }
    // What is known still counts.
    let mut facts = RunFacts { latency: None, ..realtime(3) };
    facts.processes[2].run_queue_wait_s = Some(0.5 * facts.wall_time_s);
    assert_eq!(assemble(facts).verdict, Verdict::Starved);
}

#[test]
fn shares_just_over_a_bound_do_not_read_like_the_bound() {
    let latency = LatencyReport { measured: periods(101, 100_000), ..LatencyReport::default() };
    let reasons = starved_because(Mode::Realtime, 0.02, Some(&latency), None);
    assert_eq!(reasons, ["101 of 100000 periods were missed (0.101 %, more than 0.1 %)"]);
}

#[test]
fn a_robot_that_lacked_something_spoils_the_verdict_whatever_the_timing_was() {
    let mut facts = realtime(3);
    facts.outcome.events.push(not_started(1, "cannot start `own`: Exec format error (os error 8)"));
    facts.outcome.events.push(deaf(2, "board `robot/0/0`: no files"));
    facts.latency.as_mut().unwrap().deadline_misses = Some(600);
    let report = assemble(facts);
    assert_eq!(report.verdict, Verdict::Impaired);
    assert_eq!(
        report.impaired_because,
        [
            "r01 was not-started at 0.00 s: cannot start `own`: Exec format error (os error 8)",
            "r02 was deaf at 2.00 s: board `robot/0/0`: no files"
        ]
    );
    assert!(!report.starved_because.is_empty(), "that it was late as well is still said");
    let text = render(&report, Style { width: 80, color: false });
    assert!(
        text.contains("impaired: ") && text.contains("- r01 was not-started") && text.contains("starved: "),
        "{text}"
    );

    // A death, a fault of the timeline, a straggler: events, no impairment.
    let mut facts = realtime(3);
    for kind in [
        EventKind::Died { signal: Some(9), code: None, words: String::new() },
        EventKind::Killed { source: FaultSource::Timeline },
        EventKind::Paused { source: FaultSource::Timeline, until_tick: Some(20) },
        EventKind::Held { silence: Silence::Overdue },
        EventKind::Dropped { silence: Silence::Overdue },
        EventKind::Restarted { incarnation: 1 },
    ] {
        facts.outcome.events.push(event(10, 1, kind));
    }
    let report = assemble(facts);
    assert_eq!((report.verdict, impaired_because(&report.events)), (Verdict::Valid, Vec::new()));

    let mut facts = realtime(20);
    facts.outcome.events.extend((0..20).map(|slot| not_started(slot, "no room")));
    let all = "r00, r01, r02, r03, r04, r05, r06, r07 and 12 more were not-started at 0.00 s: no room";
    assert_eq!(assemble(facts).impaired_because, [all]);
    let mut facts = realtime(20);
    facts.outcome.events.extend((0..20).map(|slot| Event { tick: 0, ..deaf(slot, &format!("cannot hear {slot}")) }));
    let reasons = assemble(facts).impaired_because;
    assert_eq!((reasons.len(), reasons[8].as_str()), (9, "and 12 more causes (see the events)"));
}
