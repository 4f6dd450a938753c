//! From what is known about a run to its report. Definitions of the fields: docs, "metrics".

use super::{
    EventReport, LatencyReport, OutcomeReport, ProcessFacts, ProcessScheduling, Report, ResourcesReport, RobotReport,
    RunFacts, SCHEMA, SchedulingReport, judge,
};
use model::{
    Class, Event, EventKind, FilterKind, Gone, Mode, PlanState, Processes, Robot, RobotIndex, RobotOutcome, RobotState,
    Scheduling, Stall,
};
use std::collections::BTreeMap;

/// Makes the report.
pub fn assemble(facts: RunFacts) -> Report {
    let clock = facts.scenario.clock;
    let (fates, outcome) = outcome_of(&facts);
    let latency = facts.latency.clone().map(|latency| {
        let (gaps, gaps_ms) = gaps_of(&facts);
        LatencyReport { measured: latency, stragglers: facts.stragglers, gaps, gaps_ms }
    });
    let resources = resources_of(&facts);
    let starved_because =
        judge::starved_because(clock.mode, clock.dt_s(), latency.as_ref(), resources.run_queue_wait_max);
    let events = events_of(&facts);
    let impaired_because = judge::impaired_because(&events);
    let sim_time_s = facts.outcome.ticks as f64 * clock.dt_s();
    let mut report = Report {
        schema: SCHEMA.to_string(),
        scenario: facts.scenario.name.clone(),
        mode: clock.mode,
        planner: planner_of(&facts),
        filter: filter_word(&facts.scenario.robots),
        physics: facts.scenario.physics,
        seed: clock.seed,
        robots: fates.len(),
        tick_hz: clock.tick_hz,
        ticks: facts.outcome.ticks,
        sim_time_s,
        wall_time_s: facts.wall_time_s,
        rtf: Some(sim_time_s / facts.wall_time_s).filter(|rtf| rtf.is_finite()),
        trajectory_hash: format!("{:016x}", facts.outcome.trajectory_hash),
        verdict: judge::verdict(&starved_because, &impaired_because),
        exit_code: 0,
        outcome,
        per_robot: fates.iter().enumerate().map(|(slot, fate)| robot_report(&facts, slot, fate)).collect(),
        latency,
        resources,
        events,
        starved_because,
        impaired_because,
        unmet: Vec::new(),
        failures: facts.failures,
        interrupted: facts.interrupted,
        sim_time_s_max: clock.ticks_max as f64 * clock.dt_s(),
        events_lost: facts.outcome.events_lost,
        record: facts.record,
        warnings: facts.scenario.warnings.iter().map(ToString::to_string).collect(),
    };
    report.unmet = judge::unmet(&facts.scenario, &facts.outcome.events, &report);
    let timed_out = report.ticks >= clock.ticks_max && !report.outcome.arrived_all;
    let failed = !report.failures.is_empty();
    report.exit_code = judge::exit_code(failed, report.interrupted, report.unmet.is_empty(), timed_out);
    report
}

/// One fate per robot that the scenario has or that was added, by slot.
fn outcome_of(facts: &RunFacts) -> (Vec<RobotOutcome>, OutcomeReport) {
    let mut known: BTreeMap<RobotIndex, &RobotOutcome> =
        facts.outcome.robots.iter().map(|fate| (fate.robot, fate)).collect();
    let slots = facts.robots.len().max(known.keys().next_back().map_or(0, |&last| last.at() + 1));
    let fates: Vec<RobotOutcome> = (0..slots)
        .map(RobotIndex::of)
        .map(|robot| {
            known.remove(&robot).cloned().unwrap_or_else(|| RobotOutcome {
                robot,
                gone: Some(Gone::NeverJoined),
                ..RobotOutcome::default()
            })
        })
        .collect();

    let arrived: Vec<&RobotOutcome> = fates.iter().filter(|fate| fate.arrived).collect();
    let owes = |fate: &&RobotOutcome| !patrols(facts, fate.robot) && fate.gone != Some(Gone::Left);
    let arrived_all = fates.iter().filter(owes).all(|fate| fate.arrived);
    let dt_s = facts.scenario.clock.dt_s();
    // A robot's time counts from when it joined, the fleet's from the first tick.
    let since_start_s = |fate: &&RobotOutcome| fate.time_s.map(|time_s| time_s + fate.joined_tick as f64 * dt_s);
    let times: Vec<f64> = arrived.iter().filter_map(|fate| fate.time_s).collect();
    let flowtime_s: f64 = times.iter().sum();
    let ratios: Vec<f64> = arrived.iter().filter_map(|fate| fate.path_ratio).collect();
    let lost_s: Vec<f64> = arrived.iter().filter_map(|fate| fate.time_lost_s).collect();
    let path_length_m: f64 = fates.iter().map(|fate| fate.path_length_m).sum();
    let reversals: u64 = fates.iter().map(|fate| u64::from(fate.reversals)).sum();
    let sim_time_s = facts.outcome.ticks as f64 * dt_s;
    let jerks: Vec<f64> = fates.iter().filter_map(|fate| fate.ldj).collect();
    let stalled = |stall| fates.iter().filter(|fate| fate.stall == Some(stall)).count();
    let filter = facts.outcome.filter;
    let share = |part: f64, whole: u64| (whole > 0).then(|| part / whole as f64);
    let report = OutcomeReport {
        arrived: arrived.len(),
        arrived_all,
        succeeded: arrived.iter().filter(|fate| fate.contacts == 0).count(),
        makespan_s: max(arrived.iter().filter_map(since_start_s)).filter(|_| arrived_all),
        flowtime_s: (!times.is_empty()).then_some(flowtime_s),
        mean_time_s: mean(&times),
        path_length_m,
        path_ratio_mean: mean(&ratios),
        path_ratio_max: max(ratios.iter().copied()),
        time_lost_s_mean: mean(&lost_s),
        time_lost_s_max: max(lost_s.iter().copied()),
        goals_done: facts.outcome.goals_done,
        throughput_per_s: per(facts.outcome.goals_done as f64, sim_time_s),
        robot_contacts: facts.outcome.robot_contacts,
        obstacle_contacts: facts.outcome.obstacle_contacts,
        min_clearance_m: facts.outcome.min_clearance_m,
        min_obstacle_clearance_m: facts.outcome.min_obstacle_clearance_m,
        deadlocked: stalled(Stall::Deadlocked),
        livelocked: stalled(Stall::Livelocked),
        oscillating: stalled(Stall::Oscillating),
        ldj_mean: mean(&jerks),
        filter_interventions: share(filter.changed as f64, filter.commands),
        filter_change_mean: share(filter.change, filter.changed),
        reversals_per_m: per(reversals as f64, path_length_m),
        crossings: facts.outcome.crossings,
        right_of_way_violations: facts.outcome.right_of_way_violations,
    };
    (fates, report)
}

/// The filter of the robots; `mixed` if not all have the same.
fn filter_word(robots: &[Robot]) -> String {
    let mut filters = robots.iter().map(|robot| robot.filter);
    let first = filters.next().unwrap_or(FilterKind::None);
    if filters.all(|filter| filter == first) { first.word() } else { "mixed" }.to_string()
}

/// Whether a robot goes round forever.
fn patrols(facts: &RunFacts, robot: RobotIndex) -> bool {
    facts.robots.get(robot.at()).is_some_and(|robot| robot.rounds.is_none())
}

fn robot_report(facts: &RunFacts, slot: usize, fate: &RobotOutcome) -> RobotReport {
    let newest = (facts.processes.iter())
        .filter(|process| process.instance.is_some_and(|instance| instance.index.at() == slot))
        .max_by_key(|process| process.instance.map(|instance| instance.incarnation));
    let rounds = facts.robots.get(slot).map_or(Some(1), |robot| robot.rounds);
    RobotReport {
        rounds: (rounds != Some(1)).then_some(fate.rounds_done),
        patrols: rounds.is_none(),
        id: name_of(facts, RobotIndex::of(slot)),
        planner: facts.robots.get(slot).map_or_else(String::new, |robot| robot.planner.clone()),
        incarnation: fate.incarnation,
        pid: newest.map(|process| process.pid),
        arrived: fate.arrived,
        time_s: fate.time_s,
        path_length_m: fate.path_length_m,
        path_ratio: fate.path_ratio,
        time_lost_s: fate.time_lost_s,
        contacts: fate.contacts,
        tasks_done: fate.tasks_done,
        goals_done: fate.goals_done,
        deadlocked: fate.stall == Some(Stall::Deadlocked),
        state: state_of(fate),
        stall: fate.stall,
        end_speed_mps: fate.end_speed_mps,
        final_distance_m: fate.final_distance_m,
        planner_state: fate.plan,
        ldj: fate.ldj,
        reversals: fate.reversals,
        reversals_per_m: per(f64::from(fate.reversals), fate.path_length_m),
        gone: fate.gone,
    }
}

fn state_of(outcome: &RobotOutcome) -> RobotState {
    match (outcome.plan, outcome.stall) {
        _ if outcome.arrived => RobotState::Arrived,
        _ if outcome.gone.is_some() => RobotState::Gone,
        // Why it does not get on, if it does not.
        (PlanState::Planning, _) => RobotState::Planning,
        (PlanState::GaveUp, _) => RobotState::GaveUp,
        (PlanState::Ready, Some(Stall::Deadlocked)) => RobotState::Deadlocked,
        (PlanState::Ready, Some(Stall::Livelocked)) => RobotState::Livelocked,
        (PlanState::Ready, Some(Stall::Oscillating)) => RobotState::Oscillating,
        (PlanState::Ready, None) => RobotState::UnderWay,
    }
}

fn resources_of(facts: &RunFacts) -> ResourcesReport {
    let agents = facts.processes.iter().filter(|process| process.instance.is_some());
    let shares: Vec<u64> = agents.filter_map(|agent| agent.pss_kib).collect();
    let waits = facts.processes.iter().filter(|process| process.in_loop()).filter_map(|p| p.run_queue_wait_s);
    let cpu_s: f64 = facts.processes.iter().map(|process| process.cpu_s).sum();
    ResourcesReport {
        startup_ms: facts.startup_ms,
        cpu_s: (!facts.processes.is_empty()).then_some(cpu_s),
        agent_pss_kib_mean: mean(&shares.iter().map(|&kib| kib as f64).collect::<Vec<_>>()),
        agent_pss_kib_max: shares.iter().copied().max(),
        shm_bytes: facts.shm_bytes,
        run_queue_wait_max: max(waits.map(|wait_s| wait_s / facts.wall_time_s)).filter(|share| share.is_finite()),
        scheduling: scheduling_of(facts),
    }
}

/// A process that cannot be scheduled as the scenario says does not start: so what it says is what was.
fn scheduling_of(facts: &RunFacts) -> Option<SchedulingReport> {
    let scenario = &facts.scenario;
    let Processes { world, agents, .. } = &scenario.processes;
    let is_inherited = *world == Scheduling::default() && *agents == Scheduling::default();
    if scenario.clock.mode == Mode::Single || is_inherited {
        return None;
    }
    let of = |scheduling: &Scheduling| ProcessScheduling {
        cpus: Some(scheduling.cpus.clone()).filter(|cpus| !cpus.is_empty()),
        class: scheduling.class.map(|class| class.word().to_owned()),
        priority: scheduling.class.and_then(Class::priority),
    };
    Some(SchedulingReport { world: of(world), agents: of(agents) })
}

/// How often time stood still, and for how long in all, ms.
fn gaps_of(facts: &RunFacts) -> (u64, u64) {
    let gap = |event: &Event| match event.kind {
        EventKind::Gap { lost_ms: ms } | EventKind::WorldRestarted { away_ms: ms, .. } => Some(ms),
        _ => None,
    };
    let gaps = facts.outcome.events.iter().filter_map(gap);
    (gaps.clone().count() as u64, gaps.sum())
}

fn events_of(facts: &RunFacts) -> Vec<EventReport> {
    let dt_s = facts.scenario.clock.dt_s();
    (facts.outcome.events.iter())
        .map(|event| {
            let contact = match event.kind {
                EventKind::Contact { with, touch } => Some((with, touch)),
                _ => None,
            };
            EventReport {
                tick: event.tick,
                t_s: event.tick as f64 * dt_s,
                kind: event.kind.name(),
                robot: event.robot.map(|robot| name_of(facts, robot)),
                detail: event.kind.detail(&|robot| name_of(facts, robot)),
                with: contact.map(|(with, _)| with.words(&|robot| name_of(facts, robot))),
                at_m: contact.map(|(_, touch)| touch.at_m),
                touch_s: contact.map(|(_, touch)| touch.t_s),
            }
        })
        .collect()
}

fn planner_of(facts: &RunFacts) -> String {
    let mut names = facts.robots.iter().map(|robot| robot.planner.as_str());
    match names.next() {
        None => "none".to_string(),
        Some(first) if names.all(|name| name == first) => first.to_string(),
        Some(_) => "mixed".to_string(),
    }
}

fn name_of(facts: &RunFacts, robot: RobotIndex) -> String {
    facts.robots.get(robot.at()).map_or_else(|| format!("slot-{robot}"), |robot| robot.id.clone())
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// A number per unit of something, of which there may be nothing.
fn per(number: f64, of: f64) -> Option<f64> {
    (of > 0.0).then(|| number / of)
}

fn max(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.reduce(f64::max)
}

impl ProcessFacts {
    /// Processor time and waiting of a process that is not part of the loop, or of one that nothing is known of yet.
    pub fn new(name: impl Into<String>, pid: u32) -> ProcessFacts {
        ProcessFacts { name: name.into(), instance: None, pid, cpu_s: 0.0, pss_kib: None, run_queue_wait_s: None }
    }
}
