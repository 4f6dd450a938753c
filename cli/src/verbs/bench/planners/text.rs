//! The tables.

use super::{CELL_S_MAX, Measured, TARGET_CELL, Target, Verdict};
use report::{Column, Page, table};

/// Below this width the tables stand on their ends.
const WIDE: usize = 76;

/// What a table shows of a cell.
type Figure = fn(&Measured) -> f64;

/// The tables, and what is to be said about them.
pub(super) fn render(cells: &[Measured], verdicts: &[Verdict], width: usize) -> String {
    let mut page = Page::new(width);
    let mut names: Vec<&str> = cells.iter().map(|cell| cell.planner).collect();
    names.dedup();
    let most = cells.iter().map(|cell| cell.plans).max().unwrap_or(0);
    let figures: [(&str, Figure); 2] = [
        ("median time of a plan, us; by obstacles | neighbours", |cell| cell.p50_us),
        ("99 of 100 plans take at most, us", |cell| cell.p99_us),
    ];
    for (title, figure) in figures {
        page.words(title, 0);
        let rows: Vec<Vec<String>> = (names.iter())
            .map(|name| {
                let in_table = |c: &&Measured| (c.neighbors, c.obstacles) != TARGET_CELL;
                let own = cells.iter().filter(|cell| cell.planner == *name).filter(in_table);
                let mut row: Vec<String> =
                    std::iter::once((*name).to_owned()).chain(own.map(|c| short(figure(c)))).collect();
                row.resize(9, "-".to_owned());
                row
            })
            .collect();
        if page.width() < WIDE {
            stacked(&mut page, &rows);
        } else {
            side_by_side(&mut page, &rows);
        }
        page.gap();
    }
    if !verdicts.is_empty() {
        let (neighbors, obstacles) = TARGET_CELL;
        page.words(&format!("{neighbors} neighbours, {obstacles} obstacles in sight"), 0);
        let columns = [
            Column::left("method", 0, 24),
            Column::right("p50 us", 0),
            Column::right("p99 us", 0),
            Column::left("target", 0, 34),
            Column::right("holds", 0),
        ];
        let row = |verdict: &Verdict| {
            let cell = cells.iter().find(|cell| {
                (cell.planner, cell.neighbors, cell.obstacles)
                    == (verdict.planner, verdict.neighbors, verdict.obstacles)
            });
            let figure = |of: Figure| cell.map_or("-".to_owned(), |cell| short(of(cell)));
            let target = match verdict.target {
                Target::MedianUs(limit) => format!("p50 < {limit} us"),
                Target::SliceUs(limit) => {
                    format!("longest {} < {} ms", short(verdict.measured_us * 1e-3), limit * 1e-3)
                }
            };
            let holds = if verdict.holds { "yes" } else { "NO" };
            [verdict.planner.to_owned(), figure(|c| c.p50_us), figure(|c| c.p99_us), target, holds.to_owned()]
        };
        let rows: Vec<[String; 5]> = verdicts.iter().map(row).collect();
        if page.width() < WIDE {
            for row in &rows {
                let [name, p50, p99, target, holds] = row.each_ref();
                let holds = if holds == "yes" { "holds" } else { "does NOT hold" };
                page.words(&format!("{name}: p50 {p50} us, p99 {p99} us; {target}: {holds}"), 2);
            }
        } else {
            let rows: Vec<Vec<String>> = rows.into_iter().map(Vec::from).collect();
            table(&columns, &rows, 2, page.width()).iter().for_each(|line| page.line(line));
        }
        page.gap();
    }
    let build = if cfg!(debug_assertions) { " This is a debug build: a release build is faster." } else { "" };
    page.words(&format!("{most} plans a cell.{build}"), 0);
    for name in names {
        let own = || cells.iter().filter(|cell| cell.planner == name);
        let fewest = own().map(|cell| cell.plans).min().unwrap_or(0);
        if fewest < most {
            page.words(&format!("{name}: {fewest} at least; it ran for {CELL_S_MAX} s a cell."), 2);
        }
        // Of those that plan in slices: elsewhere in the tables the longest is the machine's doing.
        let longest = own().filter_map(|cell| cell.cpu_max_us).reduce(f64::max);
        if let Some(longest) = longest {
            page.words(
                &format!("{name}: it plans in slices, the longest of all cells {} ms.", short(longest * 1e-3)),
                2,
            );
        }
    }
    page.into_text()
}

/// A line for each method.
fn side_by_side(page: &mut Page, rows: &[Vec<String>]) {
    let heads = ["10 | 0", "4", "16", "64", "100 | 0", "4", "16", "64"].map(|head| Column::right(head, 0));
    let columns: Vec<Column> = std::iter::once(Column::left("method", 0, 24)).chain(heads).collect();
    table(&columns, rows, 2, page.width()).iter().for_each(|line| page.line(line));
}

/// A line for each method and number of obstacles, below the method's name.
fn stacked(page: &mut Page, rows: &[Vec<String>]) {
    let columns = ["", "0", "4", "16", "64"].map(|head| Column::right(head, 0));
    let of = |(obstacles, cells): (&str, &[String])| {
        std::iter::once(format!("{obstacles} |")).chain(cells.iter().cloned()).collect()
    };
    let halves: Vec<Vec<String>> =
        rows.iter().flat_map(|row| [("10", &row[1..5]), ("100", &row[5..9])].map(of)).collect();
    let lines = table(&columns, &halves, 2, page.width());
    page.line(&lines[0]);
    for (name, pair) in rows.iter().map(|row| &row[0]).zip(lines[1..].chunks(2)) {
        page.line(name);
        pair.iter().for_each(|line| page.line(line));
    }
}

/// Three digits.
fn short(us: f64) -> String {
    match us {
        us if us >= 99.95 => format!("{us:.0}"),
        us if us >= 9.995 => format!("{us:.1}"),
        us => format!("{us:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::places;
    use super::*;
    use planners::METHODS;

    #[test]
    fn the_tables_fit_the_terminal() {
        let cells: Vec<Measured> = METHODS
            .iter()
            .flat_map(|method| places().map(move |(n, o)| (method, n, o)))
            .map(|(method, neighbors, obstacles)| Measured {
                planner: method.name,
                neighbors,
                obstacles,
                plans: 3000,
                p50_us: 0.25,
                p99_us: 1234.5,
                max_us: 50_000.0,
                cpu_max_us: Some(50_000.0),
                first_us: 10.0,
            })
            .collect();
        let verdicts: Vec<Verdict> = cells.iter().filter_map(Verdict::of).collect();
        assert_eq!(verdicts.len(), METHODS.len());
        for width in [40, 60, 80] {
            let text = render(&cells, &verdicts, width);
            assert!(text.lines().all(|line| line.chars().count() <= width && !line.contains('…')), "{text}");
            assert!(METHODS.iter().all(|method| text.contains(method.name)), "{text}");
            let said = if width < WIDE { text.matches("hold").count() } else { text.matches("yes").count() };
            assert!(said >= 1, "{text}");
        }
    }
}
