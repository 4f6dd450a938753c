//! The summary for people.

use crate::row::Row;
use crate::summary::{FailedRun, PlannerRow, Summary};
use report::numbers::{fixed, plural};
use report::{Column, Page, table};
use std::collections::{BTreeMap, BTreeSet};

/// How to lay out and paint a summary.
#[derive(Clone, Copy, Debug)]
pub struct Style {
    /// Width and colour.
    pub page: report::layout::Style,
    /// Failures that are listed; the others are counted.
    pub failures_max: usize,
}

impl Style {
    /// For a file: every failure, no colour.
    pub fn file(width: usize) -> Style {
        Style { page: report::layout::Style { width, color: false }, failures_max: usize::MAX }
    }
}

/// Where there is no room, columns with larger numbers go first.
const ROWS: [Column; 13] = [
    Column::left("planner", 0, 18),
    Column::left("varied", 0, 26),
    Column::right("success", 0),
    Column::right("95 %", 4),
    Column::right("arrived", 6),
    Column::right("contacts", 1),
    Column::right("makespan", 0),
    Column::right("95 %", 3),
    Column::right("ratio", 2),
    Column::right("95 %", 7),
    Column::right("diff s", 8),
    Column::right("goals/s", 0),
    Column::right("lost s", 9),
];

const PLANNERS: [Column; 5] = [
    Column::left("planner", 0, 18),
    Column::left("varied", 0, 26),
    Column::right("clean scenarios", 0),
    Column::right("success", 1),
    Column::right("ratio", 0),
];

/// The summary as text; no line is longer than the width of the style.
pub fn render(summary: &Summary, style: &Style) -> String {
    let mut page = Page::new(style.page.width);
    headline(&mut page, summary);
    let mut rows = &summary.rows[..];
    let mut shows_lost = false;
    while let Some(first) = rows.first() {
        let (these, others) = rows.split_at(rows.iter().take_while(|row| row.scenario == first.scenario).count());
        shows_lost |= scenario(&mut page, these);
        rows = others;
    }
    if summary.planners.len() > 1 || summary.rows.len() > summary.planners.len() {
        planners(&mut page, summary);
    }
    legend(&mut page, summary, shows_lost);
    failures(&mut page, &summary.failures, style.failures_max);
    assertions(&mut page, summary);
    let text = page.into_text();
    if style.page.color { paint(&text, summary) } else { text }
}

fn word_of(summary: &Summary) -> &'static str {
    match summary.assertions.iter().all(|checked| checked.holds) {
        true => "done",
        false => "failed",
    }
}

/// Colours the first word, which says how it went.
fn paint(text: &str, summary: &Summary) -> String {
    let word = word_of(summary);
    let color = if word == "done" { "\x1b[1;32m" } else { "\x1b[1;31m" };
    match text.strip_prefix(word) {
        Some(rest) => format!("{color}{word}\x1b[0m{rest}"),
        None => text.to_string(),
    }
}

fn headline(page: &mut Page, summary: &Summary) {
    let counted = |n: usize, what: &str| format!("{n} {what}{}", plural(n as u64));
    let names: BTreeSet<_> = summary.planners.iter().map(|row| &row.planner).collect();
    let axes = [
        (summary.rows.len() / summary.planners.len().max(1), "scenario"),
        (names.len(), "planner"),
        (summary.planners.len() / names.len().max(1), "setting"),
        (summary.seeds.len(), "seed"),
    ];
    // Every sweep has scenarios and seeds; of the others only those that it compares are named.
    let is_named = |(n, what): &&(usize, &str)| *n > 1 || matches!(*what, "scenario" | "seed");
    let axes: Vec<String> = axes.iter().filter(is_named).map(|(n, what)| counted(*n, what)).collect();
    let (word, runs, mode) = (word_of(summary), counted(summary.runs, "run"), summary.mode.word());
    let axes = axes.join(" x ");
    page.words(&format!("{word}: {runs} in {mode}: {axes}; {} succeeded", summary.successes), 4);
    let failed = summary.assertions.iter().filter(|checked| !checked.holds).count();
    if failed > 0 {
        page.words(&format!("- {failed} of {} failed; see the end", counted(summary.assertions.len(), "assertion")), 2);
    }
}

/// The rows of a scenario. Whether there was room for the time that is lost.
fn scenario(page: &mut Page, rows: &[Row]) -> bool {
    page.gap();
    page.words(&rows[0].scenario, 2);
    let cells: Vec<Vec<String>> = rows.iter().map(cells).collect();
    let lines = table(&ROWS, &cells, 2, page.width());
    for line in &lines {
        page.line(line);
    }
    let alike = rows.iter().filter(|row| row.trajectories == 1 && row.runs > 1).count();
    if alike > 0 {
        let which = if alike == rows.len() { "here".to_owned() } else { format!("in {alike} of {} rows", rows.len()) };
        let why = "the runs of such a row are one run, and its intervals mean nothing";
        page.words(&format!("! the seed changes nothing {which}: {why}"), 2);
    }
    lines[0].ends_with("lost s")
}

fn cells(row: &Row) -> Vec<String> {
    let paired = row.against_baseline.as_ref();
    let interval = |interval: Option<[f64; 2]>, decimals: usize| match interval {
        Some([low, high]) => format!("{}..{}", fixed(low, decimals), fixed(high, decimals)),
        None => String::new(),
    };
    let number = |number: Option<f64>, decimals: usize| number.map_or_else(|| "-".to_owned(), |x| fixed(x, decimals));
    vec![
        planner(row.planner.as_deref()),
        varied(&row.varied),
        format!("{}/{}", row.successes, row.runs),
        interval(row.success_rate_95, 2),
        row.arrival_rate.map_or_else(|| "-".to_owned(), percent),
        (row.robot_contacts + row.obstacle_contacts).to_string(),
        number(row.makespan_s_median, 2),
        interval(row.makespan_s_median_95, 1),
        paired.map_or_else(String::new, |paired| number(paired.makespan_ratio, 3)),
        paired.map_or_else(String::new, |paired| interval(paired.makespan_ratio_95, 2)),
        paired.map_or_else(String::new, |paired| number(paired.difference_s_median, 2)),
        // Where all robots go round forever there is nothing else to compare.
        if row.robots_due == 0 { number(row.throughput_per_s_mean, 3) } else { String::new() },
        row.time_lost_s_mean.map_or_else(String::new, |lost_s| fixed(lost_s, 2)),
    ]
}

fn planner(name: Option<&str>) -> String {
    name.unwrap_or("(scenario's own)").to_owned()
}

/// Varied keys, by the last words of their paths, and their values.
pub(crate) fn varied(varied: &BTreeMap<String, String>) -> String {
    let last = |key: &str| key.rsplit('.').next().unwrap_or(key).to_owned();
    let short = |key: &String| {
        let alike = varied.keys().filter(|other| last(other) == last(key)).count();
        if alike > 1 { key.clone() } else { last(key) }
    };
    let pairs: Vec<String> = varied.iter().map(|(key, value)| format!("{}={value}", short(key))).collect();
    pairs.join(" ")
}

/// A share in per cent; one that is not whole is not shown as 100 %.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    let shown = if share < 1.0 { (percent * 10.0).floor() / 10.0 } else { percent };
    format!("{} %", fixed(shown, 1))
}

fn planners(page: &mut Page, summary: &Summary) {
    page.gap();
    page.words("all scenarios", 2);
    let cells = |row: &PlannerRow| {
        let ratio = match (row.makespan_ratio_mean, row.ratio_scenarios) {
            (Some(ratio), Some(n)) if n < row.scenarios => format!("{} ({n} of {})", fixed(ratio, 3), row.scenarios),
            (Some(ratio), Some(_)) => fixed(ratio, 3),
            (None, Some(_)) => "-".to_owned(),
            _ => String::new(),
        };
        vec![
            planner(row.planner.as_deref()),
            varied(&row.varied),
            format!("{} of {}", row.clean, row.scenarios),
            format!("{}/{}", row.successes, row.runs),
            ratio,
        ]
    };
    let cells: Vec<Vec<String>> = summary.planners.iter().map(cells).collect();
    for line in table(&PLANNERS, &cells, 2, page.width()) {
        page.line(&line);
    }
}

fn legend(page: &mut Page, summary: &Summary, shows_lost: bool) {
    page.gap();
    let ratio = match &summary.baseline {
        Some(baseline) => format!(
            " ratio: medians against those of `{baseline}`, over the seeds with which both succeed; over all scenarios: \
             the geometric mean."
        ),
        None => String::new(),
    };
    let lost = if shows_lost {
        " lost s: time over that of the shortest path at top speed, mean of those that arrived."
    } else {
        ""
    };
    let flows = summary.rows.iter().any(|row| row.robots_due == 0);
    let goals =
        if flows { " goals/s: goals reached per second of simulated time, where no robot is to arrive." } else { "" };
    page.words(
        &format!(
            "success: all robots arrived and nothing touched (95 %: Wilson); a scenario is clean if every run succeeds. \
             makespan: median of the successful runs, s (95 %: bootstrap).{ratio}{goals}{lost}"
        ),
        0,
    );
}

fn failures(page: &mut Page, failures: &[FailedRun], most: usize) {
    if failures.is_empty() {
        return;
    }
    page.gap();
    page.words(&format!("{} run{} failed:", failures.len(), plural(failures.len() as u64)), 2);
    for failure in &failures[..failures.len().min(most)] {
        page.words_after("  ", &format!("{}: {}", failure.run, failure.cause), 4);
        command(page, &failure.words);
    }
    if let Some(more) = failures.len().checked_sub(most).filter(|more| *more > 0) {
        page.words_after("  ", &format!("and {more} more: summary.txt in the directory of --out lists all"), 4);
    }
}

/// A command that can be copied: broken between its words, with a `\` where a line goes on.
fn command(page: &mut Page, words: &[String]) {
    let width = page.width();
    let mut line = "   ".to_owned();
    for (word, place) in words.iter().zip(0..) {
        let fits =
            line.chars().count() + 1 + word.chars().count() + if place + 1 < words.len() { 2 } else { 0 } <= width;
        if !fits && line.trim() != "" {
            page.line(&(line + " \\"));
            line = "      ".to_owned();
        }
        line.push(' ');
        line.push_str(word);
    }
    page.whole(&line);
}

fn assertions(page: &mut Page, summary: &Summary) {
    if summary.assertions.is_empty() {
        return;
    }
    page.gap();
    for checked in &summary.assertions {
        let word = if checked.holds { "holds" } else { "FAILED" };
        page.words(&format!("assertion {}: {word}", checked.assertion.text()), 2);
        for row in &checked.failed {
            page.words_after("  ", &format!("- {}", row.words()), 6);
        }
    }
}
