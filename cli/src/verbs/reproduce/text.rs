//! Headline claims, then rows as a table whose cells have as many lines as they need.

use super::Summary;
use crate::exit::Failure;
use crate::out;
use report::Page;
use reproduce::row::{Row, Verdict};
use std::path::Path;

const GAP: usize = 2;
/// How a cell begins whose lines are all indented.
const INDENT: &str = "  ";
/// Narrower than this a table has neither the authors' values nor the tolerances.
const WIDE: usize = 120;
/// Columns of the longest verdict, `DIFFERS`.
const VERDICT: usize = 7;

/// Prints the rows of a paper, and their summary.
pub(super) fn print(rows: &[Row], summary: &Summary) -> Result<(), Failure> {
    out::data(&render(rows, summary, out::stdout_width(), out::stdout_colored()))
}

/// Prints what follows after the last paper.
pub(super) fn conclude(papers: &[Summary], figures: Option<(&Path, usize)>) -> Result<(), Failure> {
    let mut page = Page::new(out::stdout_width());
    if papers.len() > 1 {
        papers.iter().for_each(|summary| page.words(&sentence(summary), 2));
    }
    if let Some((folder, count)) = figures.filter(|(_, count)| *count > 0) {
        page.words(&format!("{count} files of figures in {}", folder.display()), 2);
    }
    out::data(&page.into_text())
}

pub(super) fn render(rows: &[Row], summary: &Summary, width: usize, color: bool) -> String {
    let mut page = Page::new(width);
    page.words(&format!("{}: {}", summary.paper, summary.citation), 2);
    page.gap();
    for headline in &summary.headlines {
        page.words_after(&format!("  {:<VERDICT$} ", short(headline.verdict)), &headline.sentence, 4 + VERDICT);
    }
    page.gap();
    page.words(
        &format!(
            "Verdicts: `paper`, as the paper prints it; `spec`, as its specification has it; `DIFFERS`, as neither. No value of the \
             paper in most rows: {}. `--explain ROW` shows one row in full, with its tolerance.",
            summary.silence
        ),
        0,
    );
    page.gap();
    let columns = columns(rows, page.width());
    // Rows about the same thing stand together below its name.
    let groups: Vec<Option<&str>> = (0..rows.len())
        .map(|i| {
            let own = subject(rows.get(i)?);
            let shared = |j: usize| rows.get(j).and_then(subject) == own;
            own.filter(|_| shared(i + 1) || i > 0 && shared(i - 1))
        })
        .collect();
    let cell = |row: &Row, group: Option<&str>| columns.iter().map(|column| column.cell(row, group)).collect();
    let cells: Vec<Vec<String>> = rows.iter().zip(&groups).map(|(row, group)| cell(row, *group)).collect();
    let heads: Vec<String> = columns.iter().map(|column| column.head().to_owned()).collect();
    let widths = widths(&columns, &cells, page.width());
    let mut lines = laid_out(&heads, &widths);
    let (mut above, mut noted) = (None, "");
    for ((cells, row), group) in cells.iter().zip(rows).zip(groups) {
        if let Some(group) = group.filter(|group| above != Some(*group)) {
            lines.extend(wrap(group, page.width()));
        }
        above = group;
        lines.extend(laid_out(cells, &widths));
        // A note that holds for row after row is said once.
        if !row.note.is_empty() && row.note != noted {
            let note = wrap(&format!("note: {}", row.note), page.width() - 4);
            lines.extend(note.iter().map(|line| format!("    {line}")));
        }
        noted = &row.note;
    }
    lines.iter().for_each(|line| page.line(line));
    page.gap();
    page.words(&sentence(summary), 2);
    page.gap();
    let text = page.into_text();
    if color { text.replace(" DIFFERS\n", " \x1b[1;31mDIFFERS\x1b[0m\n") } else { text }
}

/// `rpoa: 57 rows: paper 4, specification 52, differs 1 (named)`
pub(super) fn sentence(summary: &Summary) -> String {
    let Summary { paper, rows, verdicts, differs_unnamed, no_evidence, complete, .. } = summary;
    let rows = if *rows == 1 { "1 row".to_owned() } else { format!("{rows} rows") };
    let mut text = format!(
        "{paper}: {rows}: paper {}, specification {}, differs {}",
        verdicts.paper, verdicts.specification, verdicts.differs
    );
    match (verdicts.differs, differs_unnamed.len()) {
        (0, _) => {}
        (_, 0) => text += " (each with its reason)",
        (_, n) => text += &format!(" ({n} without a reason: {})", differs_unnamed.join("; ")),
    }
    if !no_evidence.is_empty() {
        text += &format!(", no evidence {}: {}", no_evidence.len(), no_evidence.join("; "));
    }
    format!("{text}{}", if *complete { "" } else { " (not all rows: broken off)" })
}

/// What a row is about: the item up to the colon.
fn subject(row: &Row) -> Option<&str> {
    row.item.split_once(": ").map(|(subject, _)| subject)
}

fn short(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Paper => "paper",
        Verdict::Specification => "spec",
        Verdict::Differs => "DIFFERS",
        Verdict::NoEvidence => "none",
    }
}

/// A column of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Column {
    Item,
    Paper,
    Authors,
    Specification,
    Ours,
    Tolerance,
    Verdict,
}

impl Column {
    fn head(self) -> &'static str {
        match self {
            Column::Item => "item",
            Column::Paper => "paper",
            Column::Authors => "authors",
            Column::Specification => "specification",
            Column::Ours => "ours",
            Column::Tolerance => "tolerance",
            Column::Verdict => "verdict",
        }
    }

    /// Of the room that there is, what it may have at first: the item most.
    fn share(self) -> usize {
        match self {
            Column::Item => 34,
            Column::Specification | Column::Ours => 20,
            Column::Tolerance | Column::Paper => 14,
            Column::Authors => 10,
            Column::Verdict => 0,
        }
    }

    fn cell(self, row: &Row, group: Option<&str>) -> String {
        let or_dash = |value: &Option<String>| value.clone().unwrap_or_else(|| "-".to_owned());
        match self {
            Column::Item => match group.and_then(|group| row.item.strip_prefix(group)?.strip_prefix(": ")) {
                Some(rest) => format!("{INDENT}{rest}"),
                None => row.item.clone(),
            },
            Column::Paper => or_dash(&row.printed),
            Column::Authors => or_dash(&row.authors),
            Column::Specification => or_dash(&row.specification),
            Column::Ours => row.ours.clone(),
            Column::Tolerance => row.tolerance.clone(),
            Column::Verdict => short(row.verdict).to_owned(),
        }
    }
}

/// The columns that have something in them, as far as there is room.
fn columns(rows: &[Row], width: usize) -> Vec<Column> {
    use Column::{Authors, Item, Ours, Paper, Specification, Tolerance, Verdict};
    let all = [Item, Paper, Authors, Specification, Ours, Tolerance, Verdict];
    let shown = |column: &Column| match column {
        Paper => rows.iter().any(|row| row.printed.is_some()),
        Authors => width >= WIDE && rows.iter().any(|row| row.authors.is_some()),
        Tolerance => width >= WIDE,
        _ => true,
    };
    all.into_iter().filter(shown).collect()
}

/// Widths of the columns: what they want, if there is room, else their share and what others do not want.
fn widths(columns: &[Column], cells: &[Vec<String>], width: usize) -> Vec<usize> {
    let last = columns.len() - 1;
    let count = |text: &str| text.chars().count();
    let wanted = |i: usize| cells.iter().map(|row| count(&row[i])).max().unwrap_or(0).max(count(columns[i].head()));
    let wanted: Vec<usize> = (0..last).map(wanted).collect();
    let room = width.saturating_sub(last * GAP + VERDICT);
    let all: usize = columns.iter().map(|column| column.share()).sum();
    let mut widths: Vec<usize> = (0..last).map(|i| wanted[i].min(room * columns[i].share() / all)).collect();
    let mut spare = room.saturating_sub(widths.iter().sum());
    // What is left goes to whichever lacks most, a column at a time.
    while spare > 0 {
        let Some(lacking) = (0..last).filter(|i| widths[*i] < wanted[*i]).max_by_key(|i| wanted[*i] - widths[*i])
        else {
            break;
        };
        widths[lacking] += 1;
        spare -= 1;
    }
    widths.push(VERDICT);
    widths
}

/// The lines of a row.
fn laid_out(cells: &[String], widths: &[usize]) -> Vec<String> {
    let column = |(cell, width): (&String, &usize)| match cell.strip_prefix(INDENT) {
        Some(rest) => wrap(rest, (*width).max(3) - 2).iter().map(|line| format!("  {line}")).collect(),
        None => wrap(cell, (*width).max(1)),
    };
    let columns: Vec<Vec<String>> = cells.iter().zip(widths).map(column).collect();
    let height = columns.iter().map(Vec::len).max().unwrap_or(0);
    let line = |row: usize| {
        let parts = columns.iter().zip(widths).map(|(column, width)| {
            let part = column.get(row).map_or("", String::as_str);
            format!("{part:<width$}")
        });
        parts.collect::<Vec<_>>().join(&" ".repeat(GAP)).trim_end().to_owned()
    };
    (0..height).map(line).collect()
}

/// Words in lines of a width; a word that is too long is broken.
fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let mut word: Vec<char> = word.chars().collect();
        loop {
            let line = lines.last_mut().expect("there is a line");
            let used = line.chars().count();
            let space = usize::from(used > 0);
            if used + space + word.len() <= width {
                line.extend(std::iter::repeat_n(' ', space).chain(word));
                break;
            }
            if used > 0 {
                lines.push(String::new());
                continue;
            }
            let rest = word.split_off(width);
            line.extend(word);
            word = rest;
            lines.push(String::new());
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::super::{Headline, Verdicts};
    use super::*;

    fn row(item: &str, ours: &str, verdict: Verdict) -> Row {
        let differs = verdict == Verdict::Differs;
        Row {
            paper: "some-paper".to_owned(),
            item: item.to_owned(),
            headline: None,
            printed: differs.then(|| "35 %".to_owned()),
            authors: differs.then(|| "33.9 %".to_owned()),
            specification: (!differs).then(|| "12.5 s".to_owned()),
            ours: ours.to_owned(),
            tolerance: "± 0.3 s".to_owned(),
            paper_tolerance: None,
            verdict,
            named: differs,
            note: if differs { "the maps of the paper are lost".to_owned() } else { String::new() },
            source: "table 3".to_owned(),
            method: "one robot".to_owned(),
            why: "the specification's".to_owned(),
        }
    }

    #[test]
    fn a_table_fits_the_terminal() {
        let rows = [
            row("apf_cross4 recommended-point: arrival of robot 0", "12.5 s", Verdict::Specification),
            row("apf_cross4 recommended-point: arrival of robot 1", "12.45 s", Verdict::Specification),
            row(
                "scenario 2, one of the obstacles on an orbit round the target",
                "arrives with 17 of 20 seeds, drives 14.25 m on average",
                Verdict::Differs,
            ),
            row("averyveryveryveryveryveryverylongwordwithoutanyspace", "(0.123456, -1.234567) m", Verdict::Paper),
        ];
        let summary = Summary {
            paper: "some-paper",
            citation: "A. Author, \"A title of some length that does not fit a line\", A journal, 2017",
            silence: "its tables are lost",
            rows: 4,
            verdicts: Verdicts { paper: 1, specification: 2, differs: 1, no_evidence: 0 },
            headlines: vec![Headline {
                item: rows[2].item.clone(),
                verdict: Verdict::Differs,
                sentence: "With an obstacle on an orbit the robot arrives with 17 of 20 seeds, not with all."
                    .to_owned(),
            }],
            differs_named: vec![rows[2].item.clone()],
            differs_unnamed: Vec::new(),
            no_evidence: Vec::new(),
            complete: true,
        };
        for width in [40, 80, 140] {
            let text = render(&rows, &summary, width, false);
            assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
            assert_eq!(text.contains("33.9 %"), width > WIDE, "{text}");
        }
        insta::assert_snapshot!(render(&rows, &summary, 80, false));
        assert!(render(&rows, &summary, 80, true).contains("\x1b[1;31mDIFFERS\x1b[0m"));
    }
}
