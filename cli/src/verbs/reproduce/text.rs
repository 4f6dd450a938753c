//! Rows as a table whose cells have as many lines as they need.

use super::Summary;
use crate::exit::Failure;
use crate::out;
use report::Page;
use reproduce::row::Row;
use std::path::Path;

const GAP: usize = 2;
const HEADS: [&str; 5] = ["item", "oracle or paper", "ours", "tolerance", "ok"];
/// How a cell begins whose lines are all indented.
const INDENT: &str = "  ";
/// Of the room that there is, what each column may have: the item most.
const SHARES: [usize; 4] = [37, 23, 23, 17];

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
    // Rows about the same thing stand together below its name.
    let groups: Vec<Option<&str>> = (0..rows.len())
        .map(|i| {
            let own = subject(rows.get(i)?);
            let shared = |j: usize| rows.get(j).and_then(subject) == own;
            own.filter(|_| shared(i + 1) || i > 0 && shared(i - 1))
        })
        .collect();
    let cells: Vec<[String; 5]> = rows.iter().zip(&groups).map(|(row, group)| cells(row, *group)).collect();
    let widths = widths(&cells, page.width());
    let mut lines = laid_out(&HEADS.map(str::to_owned), &widths);
    let mut above = None;
    for ((cells, row), group) in cells.iter().zip(rows).zip(groups) {
        if let Some(group) = group.filter(|group| above != Some(*group)) {
            lines.extend(wrap(group, page.width()));
        }
        above = group;
        lines.extend(laid_out(cells, &widths));
        if !row.ok && !row.note.is_empty() {
            lines.extend(
                wrap(&format!("note: {}", row.note), page.width() - 4).iter().map(|line| format!("    {line}")),
            );
        }
    }
    lines.iter().for_each(|line| page.line(line));
    page.gap();
    page.words(&sentence(summary), 2);
    page.gap();
    let text = page.into_text();
    if color { text.replace(" NO\n", " \x1b[1;31mNO\x1b[0m\n") } else { text }
}

/// `57 rows, 56 hold, 1 does not: ...`
pub(super) fn sentence(summary: &Summary) -> String {
    let Summary { paper, rows, hold, fail, complete, .. } = summary;
    let rows = if *rows == 1 { "1 row".to_owned() } else { format!("{rows} rows") };
    let result = match fail.len() {
        0 => "all hold".to_owned(),
        1 => format!("{hold} hold, 1 does not: {}", fail[0]),
        n => format!("{hold} hold, {n} do not: {}", fail.join("; ")),
    };
    format!("{paper}: {rows}, {result}{}", if *complete { "" } else { " (not all rows: broken off)" })
}

/// What a row is about: the item up to the colon.
fn subject(row: &Row) -> Option<&str> {
    row.item.split_once(": ").map(|(subject, _)| subject)
}

fn cells(row: &Row, group: Option<&str>) -> [String; 5] {
    let expected = match (&row.oracle_value, &row.paper_value) {
        (Some(oracle), Some(paper)) => format!("{oracle} (paper: {paper})"),
        (Some(oracle), None) => oracle.clone(),
        (None, Some(paper)) => format!("paper: {paper}"),
        (None, None) => "-".to_owned(),
    };
    let ok = if row.ok { "ok" } else { "NO" };
    let item = match group.and_then(|group| row.item.strip_prefix(group)?.strip_prefix(": ")) {
        Some(rest) => format!("{INDENT}{rest}"),
        None => row.item.clone(),
    };
    [item, expected, row.ours.clone(), row.tolerance.clone(), ok.to_owned()]
}

/// Widths of the columns: what they want, if there is room, else their share and what others do not want.
fn widths(cells: &[[String; 5]], width: usize) -> [usize; 5] {
    let wanted: [usize; 5] = std::array::from_fn(|i| {
        cells.iter().map(|row| row[i].chars().count()).max().unwrap_or(0).max(HEADS[i].chars().count())
    });
    let room = width.saturating_sub(4 * GAP + 2);
    let mut widths: [usize; 4] = std::array::from_fn(|i| wanted[i].min(room * SHARES[i] / 100));
    let mut spare = room.saturating_sub(widths.iter().sum());
    // What is left goes to whoever lacks most, a column at a time.
    while spare > 0 {
        let Some(lacking) = (0..4).filter(|i| widths[*i] < wanted[*i]).max_by_key(|i| wanted[*i] - widths[*i]) else {
            break;
        };
        widths[lacking] += 1;
        spare -= 1;
    }
    [widths[0], widths[1], widths[2], widths[3], 2]
}

/// The lines of a row.
fn laid_out(cells: &[String; 5], widths: &[usize; 5]) -> Vec<String> {
    let columns: [Vec<String>; 5] = std::array::from_fn(|i| match cells[i].strip_prefix(INDENT) {
        Some(rest) => wrap(rest, widths[i].max(3) - 2).iter().map(|line| format!("  {line}")).collect(),
        None => wrap(&cells[i], widths[i].max(1)),
    });
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
    use super::*;

    fn row(item: &str, ours: &str, ok: bool) -> Row {
        Row {
            paper: "some-paper".to_owned(),
            item: item.to_owned(),
            paper_value: (!ok).then(|| "35 %".to_owned()),
            oracle_value: ok.then(|| "12.5 s".to_owned()),
            ours: ours.to_owned(),
            tolerance: "± 0.3 s".to_owned(),
            ok,
            note: "the maps of the paper are lost".to_owned(),
        }
    }

    #[test]
    fn a_table_fits_the_terminal() {
        let rows = [
            row("apf_cross4 recommended-point: arrival of robot 0", "12.5 s", true),
            row("apf_cross4 recommended-point: arrival of robot 1", "12.45 s", true),
            row(
                "scenario 2, one of the obstacles on an orbit round the target",
                "arrives with 17 of 20 seeds, drives 14.25 m on average",
                false,
            ),
            row("averyveryveryveryveryveryverylongwordwithoutanyspace", "(0.123456, -1.234567) m", true),
        ];
        let summary = Summary {
            paper: "some-paper",
            citation: "A. Author, \"A title of some length that does not fit a line\", A journal, 2017",
            rows: 4,
            hold: 3,
            fail: vec![rows[2].item.clone()],
            complete: true,
        };
        for width in [40, 80] {
            let text = render(&rows, &summary, width, false);
            assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
        }
        insta::assert_snapshot!(render(&rows, &summary, 80, false));
        assert!(render(&rows, &summary, 80, true).contains("\x1b[1;31mNO\x1b[0m"));
    }
}
