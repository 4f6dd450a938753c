//! What holds for every paper, whatever is in it.

use shoal_reproduce::row::{Form, Paper};
use shoal_reproduce::{Item, PAPERS, Row, Rows, Verdict};
use std::collections::BTreeSet;
use std::ops::ControlFlow;

#[test]
fn figures_have_data_and_are_those_that_the_documentation_lists() {
    for paper in PAPERS {
        let series = (paper.series)();
        for series in &series {
            assert!(!series.lines.is_empty(), "{}", series.name);
            for (name, points) in &series.lines {
                assert!(!points.is_empty(), "{}: {name}", series.name);
                assert!(points.iter().flatten().all(|x| x.is_finite()), "{}: {name}", series.name);
                if series.form == Form::Arrows {
                    assert!(points.len().is_multiple_of(2), "{}: {name}: an arrow without an end", series.name);
                }
                if series.form == Form::Surface {
                    assert!(name.parse::<f64>().is_ok() && points.len() == series.lines[0].1.len(), "{}", series.name);
                }
            }
        }
        let names: BTreeSet<&str> = series.iter().map(|series| series.name.as_str()).collect();
        assert_eq!(names.len(), series.len(), "{}: names are different", paper.name);
        assert_eq!(names, listed(paper), "{}", paper.name);
    }
}

/// The figures of a paper that docs/methods.md lists.
fn listed(paper: &Paper) -> BTreeSet<&'static str> {
    let text = include_str!("../../../docs/methods.md");
    let title = format!("\n### Figures of {}\n", paper.name);
    let begin = text.find(&title).unwrap_or_else(|| panic!("no section `{}`", title.trim())) + title.len();
    let section = &text[begin..];
    let section = &section[..section.find("\n#").unwrap_or(section.len())];
    let files = section.lines().filter_map(|line| line.strip_prefix("| `")?.split(" | ").next());
    let files: Vec<&str> = files.flat_map(|cell| cell.trim_end_matches('`').split("`, `")).collect();
    let names: BTreeSet<&str> = files.iter().copied().collect();
    assert_eq!(names.len(), files.len(), "{}: a figure is listed twice", paper.name);
    // Fleets of processes are run by the command line only.
    names.into_iter().filter(|name| !name.contains("-processes-")).collect()
}

#[test]
fn a_break_is_obeyed() {
    for paper in PAPERS {
        let mut left = 3;
        let mut stop = |_: &str| {
            left -= 1;
            if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut rows = Rows::new(paper, &mut stop);
        assert!((paper.rows)(&mut rows).is_break(), "{}", paper.name);
        assert!(!rows.finish().is_empty(), "{}", paper.name);
    }
}

/// What each paper comes to: rows with the verdicts `paper`, `specification`, `differs`, and the same of its headline
/// claims. A change of these numbers is a change of what the project says about a paper.
const VERDICTS: [(&str, [usize; 3], [usize; 3]); 5] = [
    ("decentralized-apf", [1, 168, 1], [1, 0, 1]),
    ("rpoa", [5, 187, 5], [4, 0, 3]),
    ("liquid", [8, 232, 1], [8, 0, 1]),
    ("pso-via-points", [3, 145, 2], [3, 0, 0]),
    ("amr-apf", [6, 498, 14], [5, 0, 2]),
];

fn check(paper: &'static Paper) {
    let mut steps = 0;
    let mut count_step = |_: &str| {
        steps += 1;
        ControlFlow::Continue(())
    };
    let mut collected = Rows::new(paper, &mut count_step);
    assert!((paper.rows)(&mut collected).is_continue(), "{}", paper.name);
    let rows = collected.finish();
    assert_eq!(steps, paper.steps, "{}: what its progress goes by", paper.name);
    let (_, all, headlines) =
        VERDICTS.into_iter().find(|(name, ..)| *name == paper.name).expect("every paper is listed");
    let count = |of: &dyn Fn(&Row) -> bool| {
        [Verdict::Paper, Verdict::Specification, Verdict::Differs]
            .map(|verdict| rows.iter().filter(|row| row.verdict == verdict && of(row)).count())
    };
    let differ: Vec<&Row> = rows.iter().filter(|row| !row.holds()).collect();
    assert_eq!(
        (count(&|_| true), count(&|row| row.headline.is_some())),
        (all, headlines),
        "{}: {differ:#?}",
        paper.name
    );

    // Every row that differs is named with its reason, and every name is that of a row that differs.
    assert!(differ.iter().all(|row| row.named && !row.note.is_empty()), "{differ:#?}");
    let named: BTreeSet<&str> = differ.iter().map(|row| row.item.as_str()).collect();
    // Fleets of processes are run by the command line only.
    let in_one_thread = paper.differs.iter().map(|(item, _)| *item).filter(|item| !item.contains("as processes"));
    assert_eq!(named, in_one_thread.collect(), "{}", paper.name);

    let items: BTreeSet<&str> = rows.iter().map(|row| row.item.as_str()).collect();
    assert_eq!(items.len(), rows.len(), "{}: a row repeats another one", paper.name);
    for row in &rows {
        let name = format!("{}: {row:#?}", paper.name);
        assert!(![&row.source, &row.method, &row.why, &row.tolerance].iter().any(|text| text.is_empty()), "{name}");
        // A row has the verdict `paper` only by a tolerance of what the paper prints.
        assert!(row.verdict != Verdict::Paper || row.printed.is_some() && row.paper_tolerance.is_some(), "{name}");
        assert!(row.verdict != Verdict::Specification || row.specification.is_some(), "{name}");
        // Where the paper prints something else, the note says why.
        let unmet = row.printed.is_some() && row.verdict != Verdict::Paper;
        assert!(!unmet || !row.note.is_empty(), "{name}");
    }
}

#[test]
fn the_verdicts_of_decentralized_apf_and_liquid() {
    check(&shoal_reproduce::decentralized_apf::PAPER);
    check(&shoal_reproduce::liquid::PAPER);
}

#[test]
fn the_verdicts_of_rpoa() {
    check(&shoal_reproduce::rpoa::PAPER);
}

#[test]
fn the_verdicts_of_pso_via_points() {
    check(&shoal_reproduce::pso_via_points::PAPER);
}

#[test]
fn the_verdicts_of_amr_apf() {
    check(&shoal_reproduce::amr_apf::PAPER);
}

/// A row of whose reason nothing is known is not named, whatever its note says.
#[test]
fn a_row_that_differs_without_a_reason_is_not_named() {
    let mut quiet = |_: &str| ControlFlow::Continue(());
    let mut rows = Rows::new(&shoal_reproduce::rpoa::PAPER, &mut quiet);
    rows.number(Item::new("a").note("a note"), 1.0, 1.2, 0.1, "s");
    rows.number(Item::new("b").against_paper("1 s", "± 0.1 s", false), 1.0, 1.05, 0.1, "s");
    rows.number(Item::new("c").against_paper("1 s", "± 0.1 s", true), 2.0, 1.05, 0.1, "s");
    rows.number(Item::new("d").printed("1 s"), 1.0, 1.0, 0.1, "s");
    rows.no_evidence(Item::new("e").printed("1 s"), None, "starved", false);
    let rows = rows.finish();
    let verdicts: Vec<Verdict> = rows.iter().map(|row| row.verdict).collect();
    use Verdict::{Differs, NoEvidence, Paper, Specification};
    assert_eq!(verdicts, [Differs, Specification, Paper, Specification, NoEvidence]);
    assert!(rows.iter().all(|row| !row.named));
    assert_eq!(rows[2].tolerance, "± 0.1 s");
}
