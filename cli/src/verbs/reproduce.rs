//! `shoal reproduce`: what the papers report, held against what the planners do here.

mod explain;
mod fleets;
mod text;

use crate::args::{Format, ReproduceArgs};
use crate::exit::{self, Failure};
use crate::file::{Files, STANDARD};
use crate::out;
use crate::progress::Bar;
use daemon::signals::Interrupted;
use reproduce::row::{Paper, Row, Rows, Series, Verdict};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use view::series;

/// What is printed as JSON.
#[derive(Serialize)]
struct Document {
    schema: &'static str,
    papers: Vec<Summary>,
    rows: Vec<Row>,
    /// Files that were written, in the directory of `--out`.
    figures: Vec<String>,
    interrupted: bool,
    exit_code: i32,
}

/// One paper in numbers.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Summary {
    pub(super) paper: &'static str,
    pub(super) citation: &'static str,
    /// Why most rows have no value of the paper.
    pub(super) silence: &'static str,
    pub(super) rows: usize,
    pub(super) verdicts: Verdicts,
    /// The headline claims, in their order.
    pub(super) headlines: Vec<Headline>,
    /// Items of the rows that differ, the reason of which is named in their notes.
    pub(super) differs_named: Vec<String>,
    /// Items of the rows that differ, and nothing says why.
    pub(super) differs_unnamed: Vec<String>,
    /// Items of the rows without evidence.
    pub(super) no_evidence: Vec<String>,
    /// All of its rows are there.
    pub(super) complete: bool,
}

/// The number of rows with each verdict.
#[derive(Clone, Copy, Debug, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Verdicts {
    pub(super) paper: usize,
    pub(super) specification: usize,
    pub(super) differs: usize,
    pub(super) no_evidence: usize,
}

/// A headline claim and what came of it.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Headline {
    pub(super) item: String,
    pub(super) verdict: Verdict,
    pub(super) sentence: String,
}

/// Compares, prints, and says how to exit.
///
/// # Errors
/// With exit code 2 for an unknown paper or row, with 3 when fleets cannot run or figures cannot be written.
pub fn run(options: &ReproduceArgs) -> Result<i32, Failure> {
    let papers = choose(options.paper.as_deref())?;
    if let Some(row) = &options.explain {
        return explain::run(&papers, row, options);
    }
    let folder = options.out.as_deref().map(Folder::prepare).transpose()?;
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    let mut document = Document {
        schema: "shoal.reproduce/2",
        papers: Vec::new(),
        rows: Vec::new(),
        figures: Vec::new(),
        interrupted: false,
        exit_code: exit::OK,
    };
    let (mut failed, mut unwritten) = (None, None);
    let mut steps = Steps::of(&papers, options.runs);
    for paper in papers {
        let compared = compare(paper, options.runs, &mut steps, &interrupted);
        document.papers.push(summary(paper, &compared.rows, compared.complete));
        if options.format == Format::Text {
            steps.bar.finish();
            text::print(&compared.rows, &document.papers[document.papers.len() - 1])?;
        }
        document.rows.extend(compared.rows);
        failed = compared.failure;
        if let (Some(folder), false, None, None) = (&folder, interrupted.yes(), &failed, &unwritten) {
            steps.next(paper, "figures");
            for series in (paper.series)().iter().chain(&compared.series) {
                match folder.write(series) {
                    Ok(names) => document.figures.extend(names),
                    // The rows are worth more than the figures: the comparison goes on.
                    Err(failure) => unwritten = unwritten.or(Some(failure)),
                }
            }
        }
        if interrupted.yes() || failed.is_some() {
            break;
        }
    }
    let failed = failed.or(unwritten);
    document.interrupted = interrupted.yes();
    document.exit_code = match (&failed, document.interrupted) {
        (_, true) => exit::INTERRUPTED,
        (Some(failure), _) => failure.code,
        (None, _) => exit_code(&document.rows),
    };
    match options.format {
        Format::Json => out::json(&document)?,
        Format::Text => {
            text::conclude(&document.papers, folder.as_ref().map(|f| (f.0.as_path(), document.figures.len())))?;
        }
    }
    match failed {
        Some(failure) if !document.interrupted => Err(failure),
        _ => Ok(document.exit_code),
    }
}

/// 1 if a row differs and nothing names the reason, or if the machine left a row without evidence.
fn exit_code(rows: &[Row]) -> i32 {
    let unexpected = |row: &Row| matches!(row.verdict, Verdict::Differs | Verdict::NoEvidence) && !row.named;
    if rows.iter().any(unexpected) { exit::EXPECTATIONS } else { exit::OK }
}

/// The papers that are meant.
fn choose(name: Option<&str>) -> Result<Vec<&'static Paper>, Failure> {
    let Some(name) = name else { return Ok(reproduce::PAPERS.to_vec()) };
    if let Some(paper) = reproduce::PAPERS.iter().find(|paper| paper.name == name) {
        return Ok(vec![paper]);
    }
    let known: Vec<&str> = reproduce::PAPERS.iter().map(|paper| paper.name).collect();
    let list = known.join(", ");
    let hint = match planners::params::nearest(name, known) {
        Some(near) => format!("known papers: {list} (did you mean `{near}`?)"),
        None => format!("known papers: {list}"),
    };
    Err(Failure::usage(format!("unknown paper `{}`", name.escape_debug())).hint(hint))
}

/// What became of one paper.
struct Compared {
    rows: Vec<Row>,
    /// Figures of its fleets.
    series: Vec<Series>,
    complete: bool,
    /// Why its fleets could not run.
    failure: Option<Failure>,
}

/// How far the comparison is, in experiments.
struct Steps {
    bar: Bar,
    done: u64,
    total: u64,
}

impl Steps {
    /// Nothing has been compared yet; of fleets there is this number of runs.
    fn of(papers: &[&'static Paper], runs: u32) -> Steps {
        // One more for the figures.
        let steps = papers.iter().map(|paper| paper.steps + fleets::steps(paper.name, runs) + 1);
        Steps { bar: Bar::new(), done: 0, total: steps.sum::<usize>() as u64 }
    }

    fn next(&mut self, paper: &Paper, what: &str) {
        self.bar.at(self.done, self.total, &format!("{}: {what}", paper.name));
        self.done += 1;
    }
}

fn compare(paper: &'static Paper, runs: u32, steps: &mut Steps, interrupted: &Interrupted) -> Compared {
    let mut begin = |what: &str| {
        steps.next(paper, what);
        if interrupted.yes() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut rows = Rows::new(paper, &mut begin);
    let done = (paper.rows)(&mut rows).is_continue();
    let fleets = if done { fleets::run(paper.name, runs, &mut rows) } else { fleets::Fleets::default() };
    let complete = done && !fleets.broken && fleets.failure.is_none();
    Compared { rows: rows.finish(), series: fleets.series, complete, failure: fleets.failure }
}

fn summary(paper: &'static Paper, rows: &[Row], complete: bool) -> Summary {
    let of = |wanted: Verdict| rows.iter().filter(move |row| row.verdict == wanted);
    let items = |rows: Vec<&Row>| rows.into_iter().map(|row| row.item.clone()).collect::<Vec<String>>();
    let (named, unnamed) = of(Verdict::Differs).partition(|row| row.named);
    let headline = |row: &Row| {
        let (item, verdict) = (row.item.clone(), row.verdict);
        row.headline.clone().map(|sentence| Headline { item, verdict, sentence })
    };
    Summary {
        paper: paper.name,
        citation: paper.citation,
        silence: paper.silence,
        rows: rows.len(),
        verdicts: Verdicts {
            paper: of(Verdict::Paper).count(),
            specification: of(Verdict::Specification).count(),
            differs: of(Verdict::Differs).count(),
            no_evidence: of(Verdict::NoEvidence).count(),
        },
        headlines: rows.iter().filter_map(headline).collect(),
        differs_named: items(named),
        differs_unnamed: items(unnamed),
        no_evidence: items(of(Verdict::NoEvidence).collect()),
        complete,
    }
}

/// A directory for figures.
struct Folder(PathBuf);

impl Folder {
    /// Makes it, and checks that files can be made in it.
    fn prepare(path: &Path) -> Result<Folder, Failure> {
        if path == Path::new(STANDARD) {
            return Err(Failure::usage("figures `-`: they are several files and cannot go to standard output")
                .hint("give --out a directory; one called `-` is `./-`"));
        }
        std::fs::create_dir_all(path).map_err(|error| {
            Failure::environment(format!("figures `{}`: cannot make the directory: {error}", path.display()))
                .hint("give --out a directory that you may write to")
        })?;
        Files::new().write("figure", "--out", &path.join("figure.svg"))?;
        Ok(Folder(path.to_path_buf()))
    }

    /// Writes the numbers and the picture; the names of the files.
    fn write(&self, figure: &Series) -> Result<[String; 2], Failure> {
        let files = [("csv", series::csv(figure)), ("svg", series::draw(figure))];
        for (ending, text) in &files {
            let path = self.0.join(format!("{}.{ending}", figure.name));
            Files::new().write("figure", "--out", &path)?.write(text.as_bytes())?;
        }
        Ok(files.map(|(ending, _)| format!("{}.{ending}", figure.name)))
    }
}
