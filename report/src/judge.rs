//! What the numbers mean: were they shaped by the machine, were the expectations met, which exit code.

use super::{EventReport, LatencyReport, Report, Verdict};
use crate::exit;
use crate::numbers::{self, plural};
use crate::tasks::{self, Tasks};
use model::{Event, EventName, Gone, Metric, Mode, Scenario};

/// `realtime`: a larger share of missed periods is the machine's doing.
pub const MISSED_SHARE_MAX: f64 = 0.001;
/// `realtime`: so is a p99 of the wake-up lateness above this share of the period.
pub const WAKE_SHARE_MAX: f64 = bus::blame::WAKE_SHARE_MAX;
/// `realtime`: so is a process that waited for a processor for a larger share of the wall time.
pub const RUN_QUEUE_SHARE_MAX: f64 = 0.1;
/// So many contacts are named when none was expected.
const CONTACTS_NAMED_MAX: usize = 4;
/// So many impairments are given as reasons; the events hold all.
const IMPAIRMENTS_NAMED_MAX: usize = 8;

/// Why the machine, not the method, shaped the result; empty if it did not.
///
/// `run_queue_wait` is the longest wait of an agent or the world for a processor, as a share of the wall time.
pub fn starved_because(
    mode: Mode,
    dt_s: f64,
    latency: Option<&LatencyReport>,
    run_queue_wait: Option<f64>,
) -> Vec<String> {
    let mut reasons = Vec::new();
    match mode {
        Mode::Single => {}
        Mode::Lockstep => {
            let stragglers = latency.map_or(0, |latency| latency.stragglers);
            if stragglers > 0 {
                reasons.push(format!("a straggler was held or dropped {stragglers} time{}", plural(stragglers)));
            }
        }
        Mode::Realtime => {
            if let Some(latency) = latency.filter(|latency| latency.gaps > 0) {
                let LatencyReport { gaps, gaps_ms, .. } = latency;
                reasons.push(format!("time stood still {gaps} time{}, {gaps_ms} ms in all", plural(*gaps)));
            }
            let counts =
                latency.and_then(|LatencyReport { measured, .. }| measured.deadline_misses.zip(measured.periods));
            if let Some((missed, periods)) = counts.filter(|&(_, periods)| periods > 0) {
                let share = missed as f64 / periods as f64;
                if share > MISSED_SHARE_MAX {
                    let (share, bound) = (percent(share), percent(MISSED_SHARE_MAX));
                    reasons.push(format!("{missed} of {periods} periods were missed ({share}, more than {bound})"));
                }
            }
            if let Some(wake) =
                latency.and_then(|latency| latency.measured.metrics[Metric::Wake]).filter(|wake| wake.n > 0)
            {
                let share = wake.p99 / (dt_s * 1e6);
                if share > WAKE_SHARE_MAX {
                    let (share, bound) = (percent(share), percent(WAKE_SHARE_MAX));
                    reasons.push(format!(
                        "p99 wake-up lateness was {:.0} us ({share} of the period, more than {bound})",
                        wake.p99
                    ));
                }
            }
            if let Some(share) = run_queue_wait.filter(|&share| share > RUN_QUEUE_SHARE_MAX) {
                let (share, bound) = (percent(share), percent(RUN_QUEUE_SHARE_MAX));
                reasons.push(format!("a process waited for a processor {share} of the time (more than {bound})"));
            }
        }
    }
    reasons
}

/// Why the result is not that of the scenario: robots that lacked something that they needed. Empty if none did.
pub fn impaired_because(events: &[EventReport]) -> Vec<String> {
    // Robots with one cause are one reason.
    let mut causes: Vec<(&EventReport, Vec<&str>)> = Vec::new();
    for event in events.iter().filter(|event| event.kind.impairs()) {
        let robot = event.robot.as_deref().unwrap_or("?");
        let same = |first: &EventReport| (first.kind, &first.detail) == (event.kind, &event.detail);
        match causes.iter_mut().find(|(first, _)| same(first)) {
            Some((_, robots)) => robots.push(robot),
            None => causes.push((event, vec![robot])),
        }
    }
    let more = causes.split_off(causes.len().min(IMPAIRMENTS_NAMED_MAX)).len();
    let mut reasons: Vec<String> = (causes.into_iter())
        .map(|(first, robots)| {
            let were = if robots.len() == 1 { "was" } else { "were" };
            let cause = if first.detail.is_empty() { String::new() } else { format!(": {}", first.detail) };
            format!("{} {were} {} at {:.2} s{cause}", some_of(robots), first.kind, first.t_s)
        })
        .collect();
    if more > 0 {
        reasons.push(format!("and {more} more cause{} (see the events)", plural(more as u64)));
    }
    reasons
}

/// The verdict for these reasons. A result that is not that of the scenario says nothing about machine and method.
pub fn verdict(starved_because: &[String], impaired_because: &[String]) -> Verdict {
    match (impaired_because, starved_because) {
        ([], []) => Verdict::Valid,
        ([], _) => Verdict::Starved,
        _ => Verdict::Impaired,
    }
}

/// The expectations of a scenario that were not met, in words that say what was expected and what was found. `events` is the
/// log, of which the report says less.
pub fn unmet(scenario: &Scenario, events: &[Event], report: &Report) -> Vec<String> {
    let (expect, outcome) = (&scenario.expect, &report.outcome);
    let mut unmet = Vec::new();

    match expect.arrived_min {
        None if !outcome.arrived_all => {
            let late = (report.per_robot.iter())
                .filter(|robot| !robot.arrived && !robot.patrols && robot.gone != Some(Gone::Left))
                .map(|robot| robot.id.as_str());
            unmet.push(format!(
                "expected all robots to arrive, {} of {} did; missing: {}",
                outcome.arrived,
                report.robots,
                some_of(late.collect())
            ));
        }
        Some(least) if outcome.arrived < least => {
            unmet.push(format!("expected at least {least} robots to arrive, {} did", outcome.arrived));
        }
        _ => {}
    }

    let contacts = outcome.robot_contacts + outcome.obstacle_contacts;
    if contacts > expect.contacts_max {
        let expected = match expect.contacts_max {
            0 => "no contact".to_string(),
            most => format!("at most {most} contact{}", plural(most)),
        };
        let named: Vec<String> = contacts_of(&report.events).take(CONTACTS_NAMED_MAX).collect();
        let mut text = format!("expected {expected}, got {contacts}");
        if !named.is_empty() {
            let more = if contacts as usize > named.len() { ", ..." } else { "" };
            text = format!("{text}: {}{more}", named.join(", "));
        }
        unmet.push(text);
    }

    if let Some(longest_s) = expect.makespan_s_max {
        match outcome.makespan_s {
            Some(makespan_s) if makespan_s <= longest_s => {}
            Some(makespan_s) => {
                unmet.push(format!("expected all to arrive within {longest_s} s, the last took {makespan_s:.2} s"));
            }
            None => unmet.push(format!("expected all to arrive within {longest_s} s, not all did")),
        }
    }

    if let Some(least_m) = expect.clearance_m_min {
        let clearances = [(outcome.min_clearance_m, "robots"), (outcome.min_obstacle_clearance_m, "obstacles")];
        for (clearance_m, to) in clearances {
            if let Some(clearance_m) = clearance_m.filter(|&clearance_m| clearance_m < least_m) {
                unmet.push(format!(
                    "expected a clearance of {least_m} m, got {} to {to}",
                    numbers::clearance(clearance_m)
                ));
            }
        }
    }

    if let Some([from_s, to_s]) = expect.no_contact_s {
        let within = |event: &&EventReport| {
            event.kind == EventName::Contact && event.touch_s.is_some_and(|touch_s| (from_s..=to_s).contains(&touch_s))
        };
        let touched: Vec<&EventReport> = report.events.iter().filter(within).collect();
        if !touched.is_empty() {
            let named: Vec<String> = contacts_of(touched.iter().copied()).take(CONTACTS_NAMED_MAX).collect();
            let more = if touched.len() > named.len() { ", ..." } else { "" };
            let (count, named) = (touched.len(), named.join(", "));
            unmet.push(format!("expected no contact from {from_s} s to {to_s} s, got {count}: {named}{more}"));
        }
    }

    if let Some(longest_s) = expect.rejoin_s_max {
        unmet.extend(absences(report).filter_map(|(robot, from_s, back_s)| match back_s {
            Some(back_s) if back_s - from_s <= longest_s => None,
            Some(back_s) => {
                let took_s = back_s - from_s;
                Some(format!(
                    "expected `{robot}` to rejoin within {longest_s} s of {from_s:.2} s, it took {took_s:.2} s"
                ))
            }
            None => Some(format!("expected `{robot}` to rejoin within {longest_s} s of {from_s:.2} s, it did not")),
        }));
    }

    if let Some(by_s) = expect.tasks_done_by_s {
        let Tasks { given, done, late } = tasks::given_until(by_s, scenario, events);
        if done < given {
            let late = some_of(late);
            unmet.push(format!(
                "expected all tasks to be done by {by_s} s, {done} of {given} were; not those of {late}"
            ));
        }
    }
    unmet
}

/// Robots whose process ended while they were in the world: which, when, and when they were back.
fn absences(report: &Report) -> impl Iterator<Item = (&str, f64, Option<f64>)> {
    report.events.iter().enumerate().filter_map(|(place, event)| {
        let ended = matches!(event.kind, EventName::Killed | EventName::Died | EventName::Replaced);
        let robot = event.robot.as_deref().filter(|_| ended)?;
        let mut later = report.events[place + 1..].iter().filter(|later| later.robot.as_deref() == Some(robot));
        let back = later.find(|later| matches!(later.kind, EventName::Restarted | EventName::Joined));
        Some((robot, event.t_s, back.map(|back| back.t_s)))
    })
}

/// The contacts in the log: `r03/r07 at 4.20 s`.
fn contacts_of<'a>(events: impl IntoIterator<Item = &'a EventReport>) -> impl Iterator<Item = String> {
    events.into_iter().filter_map(|event| {
        let (robot, other) = (event.robot.as_deref().unwrap_or("?"), event.with.as_deref()?);
        Some(format!("{robot}/{other} at {:.2} s", event.t_s))
    })
}

/// The exit code of a run of which there is a report. `failed`: the environment cut it short, or took something of it.
pub fn exit_code(failed: bool, interrupted: bool, expectations_met: bool, timed_out: bool) -> i32 {
    match (interrupted, expectations_met, timed_out) {
        _ if failed => exit::ENVIRONMENT,
        (true, _, _) => exit::INTERRUPTED,
        (false, true, _) => exit::OK,
        (false, false, true) => exit::TIME_OUT,
        (false, false, false) => exit::EXPECTATIONS,
    }
}

/// The first few names, and how many more.
pub fn some_of(names: Vec<&str>) -> String {
    const NAMED_MAX: usize = 8;
    let shown = names[..names.len().min(NAMED_MAX)].join(", ");
    match names.len().saturating_sub(NAMED_MAX) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// A share in per cent, with as many digits as it needs to differ from the bounds in this file.
fn percent(share: f64) -> String {
    let percent = share * 100.0;
    // 0.101 % must not read as 0.1 %.
    let decimals = if percent < 1.0 { 3 } else { 2 };
    format!("{} %", trim(format!("{percent:.decimals$}")))
}

fn trim(number: String) -> String {
    number.trim_end_matches('0').trim_end_matches('.').to_string()
}
