//! `--explain`: one row in full.

use super::{Steps, compare, exit_code};
use crate::args::{Format, ReproduceArgs};
use crate::exit::{self, Failure};
use crate::out;
use daemon::signals::Interrupted;
use report::Page;
use reproduce::row::{Paper, Row};
use serde_json::json;

/// Maximum number of rows that are listed where a name fits several.
const LISTED_MAX: usize = 12;

/// Computes the rows of the papers, and explains the one that is meant. Fleets of processes run only if no other row is
/// meant.
pub(super) fn run(papers: &[&'static Paper], name: &str, options: &ReproduceArgs) -> Result<i32, Failure> {
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    let mut found: Vec<(&'static Paper, Row)> = Vec::new();
    for runs in [0, options.runs] {
        let mut steps = Steps::of(papers, runs);
        for paper in papers {
            let compared = compare(paper, runs, &mut steps, &interrupted);
            if interrupted.yes() {
                return Ok(exit::INTERRUPTED);
            }
            if let Some(failure) = compared.failure {
                return Err(failure);
            }
            let fits = |row: &Row| row.item.to_lowercase().contains(&name.to_lowercase());
            found.extend(compared.rows.into_iter().filter(fits).map(|row| (*paper, row)));
        }
        if !found.is_empty() || options.runs == 0 {
            break;
        }
    }
    if let Some(exact) = found.iter().position(|(_, row)| row.item == name) {
        found = vec![found.swap_remove(exact)];
    }
    let [(paper, row)] = &found[..] else { return Err(unclear(name, &found)) };
    match options.format {
        Format::Text => out::data(&text(paper, row, out::stdout_width()))?,
        Format::Json => out::json(&json!({
            "schema": "shoal.reproduce.row/1",
            "citation": paper.citation,
            "silence": paper.silence,
            "row": row,
        }))?,
    }
    Ok(exit_code(std::slice::from_ref(row)))
}

fn unclear(name: &str, found: &[(&'static Paper, Row)]) -> Failure {
    let name = name.escape_debug();
    if found.is_empty() {
        return Failure::usage(format!("no row contains `{name}`"))
            .hint("`shoal reproduce` lists the rows; give --explain a row, or a part of it that no other row has");
    }
    let items = found.iter().take(LISTED_MAX).map(|(paper, row)| format!("{} `{}`", paper.name, row.item));
    let more = if found.len() > LISTED_MAX { ", ..." } else { "" };
    let list = items.collect::<Vec<_>>().join(", ");
    Failure::usage(format!("{} rows contain `{name}`", found.len())).hint(format!("give one of {list}{more}"))
}

/// A row in full.
pub(super) fn text(paper: &Paper, row: &Row, width: usize) -> String {
    let mut page = Page::new(width);
    page.words(&row.item, 2);
    page.gap();
    let mut part = |name: &str, words: &str| {
        if !words.is_empty() {
            page.row(name, words);
        }
    };
    part("paper", &format!("{}: {}", row.paper, paper.citation));
    part("verdict", row.verdict.name());
    part("headline", row.headline.as_deref().unwrap_or_default());
    part("source", &row.source);
    let silent = format!("nothing ({})", paper.silence);
    part("paper prints", row.printed.as_deref().unwrap_or(&silent));
    part("authors", row.authors.as_deref().unwrap_or_default());
    part("specification", row.specification.as_deref().unwrap_or("nothing"));
    part("shoal", &row.ours);
    part("computed", &row.method);
    part("tolerance", &row.tolerance);
    let of_paper = row.paper_tolerance.as_deref().filter(|of_paper| *of_paper != row.tolerance);
    part("of the paper", of_paper.unwrap_or_default());
    part("because", &row.why);
    part("note", &row.note);
    page.into_text()
}
