//! The report for people.

pub use super::layout::Style;

use super::judge;
use super::layout::{Column, Page, table};
use super::{
    Blame, LatencyFacts, LatencyReport, Percentiles, ProcessScheduling, Report, RobotReport, SchedulingReport, Verdict,
};
use crate::exit;
use crate::numbers::{clearance, fixed, plural};
use model::{Cause, Mode, PerMetric, Physics, PlanState, RobotState, Stall};

/// So many robots are listed one by one.
const ROBOTS_MAX: usize = 20;
/// So many events are listed one by one.
const EVENTS_MAX: usize = 12;

/// The report as text; no line is longer than the width of the style.
pub fn render(report: &Report, style: Style) -> String {
    let mut page = Page::new(style.width);
    headline(&mut page, report);
    outcome(&mut page, report);
    if let Some(latency) = &report.latency {
        latency_table(&mut page, latency);
    }
    resources(&mut page, report);
    events(&mut page, report);
    robots(&mut page, report);
    let text = page.into_text();
    if style.color { paint(&text, report) } else { text }
}

fn word_of(report: &Report) -> &'static str {
    match report.exit_code {
        exit::OK => "ok",
        exit::TIME_OUT => "time ran out",
        exit::INTERRUPTED => "interrupted",
        _ => "failed",
    }
}

/// Colours the first word, which says how it went.
fn paint(text: &str, report: &Report) -> String {
    let color = match report.exit_code {
        exit::OK => "\x1b[1;32m",
        exit::INTERRUPTED => "\x1b[1;33m",
        _ => "\x1b[1;31m",
    };
    // On a narrow page the words may have been wrapped; then they stay as they are.
    match text.strip_prefix(word_of(report)) {
        Some(rest) => format!("{color}{}\x1b[0m{rest}", word_of(report)),
        None => text.to_string(),
    }
}

fn headline(page: &mut Page, report: &Report) {
    let outcome = &report.outcome;
    let contacts = outcome.robot_contacts + outcome.obstacle_contacts;
    let arrived = match (outcome.arrived, report.robots) {
        (1, 1) => "the robot arrived".to_string(),
        (arrived, robots) if arrived == robots => format!("all {robots} robots arrived"),
        (arrived, robots) => format!("{arrived} of {robots} robots arrived"),
    };
    let when = match outcome.makespan_s {
        Some(makespan_s) => format!("in {makespan_s:.2} s"),
        None if report.interrupted || !report.failures.is_empty() => {
            format!("until {:.2} s of {}", report.sim_time_s, seconds(report.sim_time_s_max))
        }
        None => format!("in {}", seconds(report.sim_time_s)),
    };
    let contacts = match contacts {
        0 => "no contact".to_string(),
        n => format!("{n} contact{}", plural(n)),
    };
    let rounds: Vec<u32> =
        report.per_robot.iter().filter(|robot| robot.patrols).filter_map(|robot| robot.rounds).collect();
    let rounds = match rounds[..] {
        [] => String::new(),
        [one] => format!(", 1 on patrol: {one} round{}", plural(one.into())),
        _ => format!(", {} on patrol: {} rounds", rounds.len(), rounds.iter().sum::<u32>()),
    };
    page.words(&format!("{}: {}: {arrived} {when}, {contacts}{rounds}", word_of(report), report.scenario), 4);
    let mode = report.mode.word();
    let physics = match report.physics {
        Physics::Kinematic => String::new(),
        physics => format!(", {}", physics.word()),
    };
    let rtf = report.rtf.map_or_else(String::new, |rtf| format!(" (x{rtf:.2})"));
    page.words(
        &format!(
            "{mode} at {} Hz{physics}, {}, filter {}, seed {}; {:.2} s simulated in {:.2} s{rtf}",
            report.tick_hz, report.planner, report.filter, report.seed, report.sim_time_s, report.wall_time_s
        ),
        0,
    );
    for failure in &report.failures {
        page.words(&format!("- {failure}"), 2);
    }
    // What an interrupted run did not reach is no news.
    for unmet in report.unmet.iter().filter(|_| !report.interrupted) {
        page.words(&format!("- {unmet}"), 2);
    }
    if report.verdict == Verdict::Impaired {
        page.words("impaired: a robot lacked something that it needed; this is not the result of the scenario", 2);
        for reason in &report.impaired_because {
            page.words(&format!("- {reason}"), 2);
        }
        page.words("hint: `shoal doctor` checks limits, shared memory and processes of this machine", 6);
    }
    if !report.starved_because.is_empty() {
        let blame = report.latency.as_ref().and_then(|latency| latency.measured.blame).filter(|blame| blame.late > 0);
        let (what, hint) = starved_words(report.mode, blame);
        page.words(&format!("starved: {what}"), 2);
        for reason in &report.starved_because {
            page.words(&format!("- {reason}"), 2);
        }
        if let Some(blame) = blame {
            page.words(&format!("- late periods, and what delayed them: {}", blame_words(&blame)), 2);
        }
        if let Some(worst) = report.latency.as_ref().and_then(worst_words) {
            page.words(&format!("- worst: {worst}"), 2);
        }
        page.words(&format!("hint: {hint}"), 6);
    }
}

/// What `starved` means here, and what to do about it.
fn starved_words(mode: Mode, blame: Option<Blame>) -> (&'static str, &'static str) {
    match (mode, blame.and_then(|blame| blame.most())) {
        (Mode::Realtime, Some((Cause::Planner, _))) => (
            "the planner was too slow for its periods, and that shaped this result",
            "a lower clock.tick_hz, a faster method, or `--mode lockstep`, which waits for planners",
        ),
        (Mode::Realtime, _) => (
            "the machine, not the method, shaped this result",
            "fewer robots, a lower clock.tick_hz, a quieter machine, a real-time class (`[processes]` of a scenario), or \
             `--mode lockstep`",
        ),
        _ => (
            "the machine, not the method, shaped this result",
            "see the events for who and when; `shoal doctor` checks the machine",
        ),
    }
}

/// `812 (scheduler 790, neither 22)`.
pub fn blame_words(blame: &Blame) -> String {
    let parts: Vec<String> =
        (blame.by_cause.iter().filter(|(_, n)| **n > 0)).map(|(cause, n)| format!("{} {n}", cause.word())).collect();
    if parts.is_empty() { blame.late.to_string() } else { format!("{} ({})", blame.late, parts.join(", ")) }
}

/// The loops with the most late periods: `r03 50 of 600 (planner 50), world 3 of 600 (scheduler 3)`.
fn worst_words(latency: &LatencyReport) -> Option<String> {
    const NAMED_MAX: usize = 3;
    let mut late: Vec<(&str, Blame, u64)> = (latency.measured.per_robot.iter().chain(&latency.measured.world))
        .filter_map(|of| Some((of.id.as_str(), of.blame.filter(|blame| blame.late > 0)?, of.periods)))
        .collect();
    late.sort_by_key(|(_, blame, _)| std::cmp::Reverse(blame.late));
    let words = late.iter().take(NAMED_MAX).map(|(id, blame, periods)| {
        let cause = blame.most().map_or_else(String::new, |(cause, n)| format!(" ({} {n})", cause.word()));
        format!("{id} {} of {periods}{cause}", blame.late)
    });
    (!late.is_empty()).then(|| words.collect::<Vec<_>>().join(", "))
}

fn outcome(page: &mut Page, report: &Report) {
    let outcome = &report.outcome;
    page.gap();
    page.words("outcome", 0);
    let mut arrived = format!("{} of {}, {} without contact", outcome.arrived, report.robots, outcome.succeeded);
    let stalled = [
        (outcome.deadlocked, Stall::Deadlocked),
        (outcome.livelocked, Stall::Livelocked),
        (outcome.oscillating, Stall::Oscillating),
    ];
    for (count, stall) in stalled.into_iter().filter(|(count, _)| *count > 0) {
        arrived += &format!(", {count} {}", stall.word());
    }
    page.row("arrived", &arrived);
    for state in [PlanState::Planning, PlanState::GaveUp] {
        let robots = report.per_robot.iter().filter(|robot| robot.planner_state == state && !robot.arrived);
        let names: Vec<&str> = robots.map(|robot| robot.id.as_str()).collect();
        if !names.is_empty() {
            let what = if state == PlanState::GaveUp { "gave up" } else { "still planning" };
            page.row("no plan", &format!("{}: {what}", judge::some_of(names)));
        }
    }
    if let (Some(mean_s), Some(flowtime_s)) = (outcome.mean_time_s, outcome.flowtime_s) {
        let makespan =
            outcome.makespan_s.map_or_else(String::new, |makespan_s| format!("makespan {makespan_s:.2} s, "));
        page.row("time", &format!("{makespan}mean {mean_s:.2} s, flowtime {flowtime_s:.2} s"));
    }
    if let (Some(mean_s), Some(max_s)) = (outcome.time_lost_s_mean, outcome.time_lost_s_max) {
        let lost = format!("mean {} s, at most {} s over the fastest free path", fixed(mean_s, 2), fixed(max_s, 2));
        page.row("time lost", &lost);
    }
    // Where every robot has one goal, this is what `arrived` says; a flow that stands still has reached none.
    let flows = outcome.goals_done > outcome.arrived as u64 || report.per_robot.iter().any(|robot| robot.patrols);
    if let Some(throughput) = outcome.throughput_per_s.filter(|_| flows) {
        page.row("goals", &format!("{} reached, {} per s", outcome.goals_done, fixed(throughput, 3)));
    }
    let ratio = match (outcome.path_ratio_mean, outcome.path_ratio_max) {
        (Some(mean), Some(max)) => format!(", {mean:.3} x the shortest (worst {max:.3})"),
        _ => String::new(),
    };
    page.row("path", &format!("{:.2} m{ratio}", outcome.path_length_m));
    page.row(
        "contacts",
        &format!("{} with robots, {} with obstacles", outcome.robot_contacts, outcome.obstacle_contacts),
    );
    let clearances: Vec<String> =
        [(outcome.min_clearance_m, "to robots"), (outcome.min_obstacle_clearance_m, "to obstacles")]
            .into_iter()
            .filter_map(|(clearance_m, to)| clearance_m.map(|clearance_m| format!("{} {to}", clearance(clearance_m))))
            .collect();
    if !clearances.is_empty() {
        page.row("least clearance", &clearances.join(", "));
    }
    if let Some(share) = outcome.filter_interventions {
        let by = outcome.filter_change_mean.map_or_else(String::new, |mean| {
            format!(", by {} % of the greatest speed on average", fixed(100.0 * mean, 1))
        });
        page.row("filter", &format!("changed {} % of the commands{by}", fixed(100.0 * share, 1)));
    }
    if let Some(ldj) = outcome.ldj_mean {
        let reversals =
            outcome.reversals_per_m.map_or_else(String::new, |per_m| format!(", {} reversals per m", fixed(per_m, 3)));
        page.row("smoothness", &format!("{} (LDJ, 0 is best){reversals}", fixed(ldj, 2)));
    }
    page.row("trajectory hash", &report.trajectory_hash);
}

fn latency_table(page: &mut Page, latency: &LatencyReport) {
    page.gap();
    latency_lines(page, "latency, us", &latency.measured.metrics);
    period_lines(page, &latency.measured);
    page.row("stragglers", &latency.stragglers.to_string());
}

/// How many periods were missed and late, where there are any.
pub fn period_lines(page: &mut Page, latency: &LatencyFacts) {
    if let (Some(missed), Some(periods)) = (latency.deadline_misses, latency.periods) {
        page.row("missed periods", &format!("{missed} of {periods}"));
    }
    if let Some(blame) = &latency.blame {
        page.row("late periods", &blame_words(blame));
    }
}

/// A table of distributions, those without values left out.
pub fn latency_lines(page: &mut Page, head: &'static str, metrics: &PerMetric<Option<Percentiles>>) {
    let rows: Vec<Vec<String>> = (metrics.iter())
        .filter_map(|(metric, percentiles)| {
            let mut row = vec![metric.word().to_string()];
            row.extend(percentile_cells(&percentiles.filter(|percentiles| percentiles.n > 0)?));
            Some(row)
        })
        .collect();
    let columns: Vec<Column> = std::iter::once(Column::left(head, 0, 16)).chain(percentile_columns()).collect();
    for line in table(&columns, &rows, 2, page.width()) {
        page.line(&line);
    }
}

/// The columns of a distribution.
pub fn percentile_columns() -> [Column; 6] {
    [
        Column::right("p50", 0),
        Column::right("p90", 3),
        Column::right("p99", 0),
        Column::right("p99.9", 4),
        Column::right("max", 1),
        Column::right("n", 2),
    ]
}

/// What is in them.
pub fn percentile_cells(percentiles: &Percentiles) -> [String; 6] {
    let Percentiles { p50, p90, p99, p999, max, n } = *percentiles;
    [micros(p50), micros(p90), micros(p99), micros(p999), micros(max), n.to_string()]
}

fn resources(page: &mut Page, report: &Report) {
    let resources = &report.resources;
    let mut rows: Vec<(&str, String)> = Vec::new();
    if let Some(startup_ms) = resources.startup_ms {
        rows.push(("startup", format!("{startup_ms:.0} ms")));
    }
    if let Some(cpu_s) = resources.cpu_s {
        rows.push(("processor", format!("{cpu_s:.2} s")));
    }
    if let (Some(mean), Some(max)) = (resources.agent_pss_kib_mean, resources.agent_pss_kib_max) {
        rows.push(("agent memory", format!("{mean:.0} KiB, at most {max} KiB (PSS)")));
    }
    if let Some(bytes) = resources.shm_bytes {
        rows.push(("shared memory", bytes_text(bytes)));
    }
    if let Some(SchedulingReport { world, agents }) = &resources.scheduling {
        rows.push(("world runs", scheduling_words(world)));
        rows.push(("agents run", scheduling_words(agents)));
    }
    if rows.is_empty() {
        return;
    }
    page.gap();
    page.words("resources", 0);
    for (label, value) in rows {
        page.row(label, &value);
    }
}

/// `on processors 0-1, as fifo 10`.
fn scheduling_words(of: &ProcessScheduling) -> String {
    let mut parts = Vec::new();
    if let Some(cpus) = &of.cpus {
        parts.push(format!("on processor{} {}", plural(cpus.len() as u64), model::cpu_list(cpus)));
    }
    if let Some(class) = &of.class {
        let priority = of.priority.map_or_else(String::new, |priority| format!(" {priority}"));
        parts.push(format!("as {class}{priority}"));
    }
    if parts.is_empty() { "inherited from shoal".to_owned() } else { parts.join(", ") }
}

fn events(page: &mut Page, report: &Report) {
    let notable: Vec<_> = report.events.iter().filter(|event| event.kind.is_notable(event.tick)).collect();
    if notable.is_empty() && report.events_lost == 0 {
        return;
    }
    page.gap();
    page.words("events", 0);
    for event in notable.iter().take(EVENTS_MAX) {
        let robot = event.robot.as_deref().unwrap_or("all");
        let detail = if event.detail.is_empty() { String::new() } else { format!(": {}", event.detail) };
        page.row(&format!("{:.2} s", event.t_s), &format!("{robot} {}{detail}", event.kind));
    }
    if notable.len() > EVENTS_MAX {
        page.words(&format!("  ... and {} more (see --report)", notable.len() - EVENTS_MAX), 2);
    }
    if report.events_lost > 0 {
        page.words(&format!("  ... and {} that the log had no room for", report.events_lost), 2);
    }
}

fn robots(page: &mut Page, report: &Report) {
    let mut order: Vec<&RobotReport> = report.per_robot.iter().collect();
    if order.len() > ROBOTS_MAX {
        // Those worth a look come first where not all can be shown.
        order.sort_by_key(|robot| robot.arrived && robot.contacts == 0);
    }
    let rows: Vec<Vec<String>> = order.iter().take(ROBOTS_MAX).map(|robot| robot_row(robot, report)).collect();
    if rows.is_empty() {
        return;
    }
    let columns = [
        Column::left("robot", 0, 14),
        Column::left("method", 5, 18),
        Column::right("time s", 0),
        Column::right("path m", 1),
        Column::right("ratio", 2),
        Column::right("lost s", 7),
        Column::right("contacts", 3),
        Column::right("tasks", 4),
        Column::right("pid", 6),
        Column::left("", 0, 12),
    ];
    page.gap();
    for line in table(&columns, &rows, 2, page.width()) {
        page.line(&line);
    }
    if order.len() > ROBOTS_MAX {
        page.words(&format!("  ... and {} more (see --report)", order.len() - ROBOTS_MAX), 2);
    }
}

fn robot_row(robot: &RobotReport, report: &Report) -> Vec<String> {
    let note = match (robot.gone, robot.state) {
        (Some(gone), _) => gone.word(),
        (None, RobotState::Arrived) => "",
        (None, RobotState::UnderWay) if robot.patrols => "goes round",
        (None, RobotState::UnderWay) => "on its way",
        (None, state) => state.word(),
    };
    let tasks = report.per_robot.iter().any(|robot| robot.tasks_done > 0);
    let lost = report.per_robot.iter().any(|robot| robot.time_lost_s.is_some());
    vec![
        robot.id.clone(),
        if report.planner == "mixed" { robot.planner.clone() } else { String::new() },
        robot.time_s.filter(|_| robot.arrived).map_or("-".to_string(), |time_s| format!("{time_s:.2}")),
        format!("{:.2}", robot.path_length_m),
        robot.path_ratio.map_or("-".to_string(), |ratio| format!("{ratio:.3}")),
        robot.time_lost_s.map_or_else(|| if lost { "-".to_string() } else { String::new() }, |lost_s| fixed(lost_s, 2)),
        robot.contacts.to_string(),
        if tasks { robot.tasks_done.to_string() } else { String::new() },
        robot.pid.map_or_else(String::new, |pid| pid.to_string()),
        note.to_string(),
    ]
}

/// A time for people: `60 s`, `12.34 s`.
fn seconds(time_s: f64) -> String {
    if time_s.fract().abs() < 1e-9 { format!("{time_s:.0} s") } else { format!("{time_s:.2} s") }
}

/// Microseconds with the digits that matter.
pub fn micros(us: f64) -> String {
    if us < 100.0 { format!("{us:.1}") } else { format!("{us:.0}") }
}

/// Bytes for people.
pub fn bytes_text(bytes: u64) -> String {
    const KIB: f64 = 1024.0;
    let bytes_f = bytes as f64;
    if bytes_f < KIB {
        format!("{bytes} B")
    } else if bytes_f < KIB * KIB {
        format!("{:.1} KiB", bytes_f / KIB)
    } else if bytes_f < KIB * KIB * KIB {
        format!("{:.1} MiB", bytes_f / KIB / KIB)
    } else {
        format!("{:.1} GiB", bytes_f / KIB / KIB / KIB)
    }
}
