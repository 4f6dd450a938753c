//! A claim and what became of it.

use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// What a comparison came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Within the tolerance of what the paper prints.
    Paper,
    /// Within the tolerance of the specification. The paper has no value, or another one: the note says why.
    Specification,
    /// Within neither.
    Differs,
    /// The run behind it proves nothing: starved, impaired, or too few starts.
    NoEvidence,
}

impl Verdict {
    /// All of them, in the order in which they are counted.
    pub const ALL: [Verdict; 4] = [Verdict::Paper, Verdict::Specification, Verdict::Differs, Verdict::NoEvidence];

    /// Its name, as in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Paper => "paper",
            Verdict::Specification => "specification",
            Verdict::Differs => "differs",
            Verdict::NoEvidence => "no-evidence",
        }
    }
}

/// One claim of a paper, or one result of its specification, beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Name of the paper.
    pub paper: String,
    /// What is compared: experiment, planner variant, quantity. Unique within a paper.
    pub item: String,
    /// What came of it, in a sentence, if the row is one of the paper's headline claims.
    pub headline: Option<String>,
    /// What the paper itself prints: the column `paper`.
    pub printed: Option<String>,
    /// What follows from numbers that the paper prints, or stands in its authors' repository.
    pub authors: Option<String>,
    /// What the specification, or its reference implementation, gives.
    pub specification: Option<String>,
    /// What shoal gives.
    pub ours: String,
    /// How far ours may be from the value that the verdict names, in words: `exact`, `± 0.02 m`, ...
    pub tolerance: String,
    /// How far ours may be from what the paper prints; `None` where the two are not compared.
    pub paper_tolerance: Option<String>,
    /// What came of it.
    pub verdict: Verdict,
    /// It differs, and [`Paper::differs`] names it with the reason; or it is without evidence because so few runs were
    /// asked for.
    pub named: bool,
    /// What a reader must know: why the paper's value is not met, what the row does not show.
    pub note: String,
    /// Where paper and specification say it.
    pub source: String,
    /// What was computed, and how: scene, planner, parameters, runs.
    pub method: String,
    /// Why the tolerance is what it is.
    pub why: String,
}

impl Row {
    /// Whether ours is within the tolerance of the paper or of the specification.
    pub fn holds(&self) -> bool {
        matches!(self.verdict, Verdict::Paper | Verdict::Specification)
    }
}

/// What holds for a row after the other until something else is said.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Setting {
    /// See [`Row::source`].
    pub source: String,
    /// See [`Row::method`].
    pub method: String,
    /// See [`Row::why`].
    pub why: String,
}

/// What is being compared, for building rows.
#[derive(Clone, Debug, Default)]
pub struct Item {
    item: String,
    headline: Option<String>,
    printed: Option<Printed>,
    authors: Option<String>,
    note: String,
    setting: Setting,
}

/// What the paper prints, and whether ours is within a tolerance of it, if that is asked.
#[derive(Clone, Debug)]
struct Printed {
    value: String,
    compared: Option<(String, bool)>,
}

impl Item {
    /// An item of which the paper prints no value.
    pub fn new(item: impl Into<String>) -> Item {
        Item { item: item.into(), ..Item::default() }
    }

    /// The same, with this note besides those that it has.
    pub fn note(self, note: impl Into<String>) -> Item {
        let notes = [self.note.clone(), note.into()];
        Item { note: notes.into_iter().filter(|note| !note.is_empty()).collect::<Vec<_>>().join("; "), ..self }
    }

    /// The same, with the reason of its tolerance.
    pub fn why(mut self, why: impl Into<String>) -> Item {
        self.setting.why = why.into();
        self
    }

    /// The same, with the place where paper and specification say it.
    pub fn source(mut self, source: impl Into<String>) -> Item {
        self.setting.source = source.into();
        self
    }

    /// The same, with what was computed and how.
    pub fn method(mut self, method: impl Into<String>) -> Item {
        self.setting.method = method.into();
        self
    }

    /// The same, with what the paper prints. It is shown, not compared: the note says why not.
    pub fn printed(self, value: impl Into<String>) -> Item {
        Item { printed: Some(Printed { value: value.into(), compared: None }), ..self }
    }

    /// The same, with what the paper prints, and whether ours is within this tolerance of it.
    pub fn against_paper(self, value: impl Into<String>, tolerance: impl Into<String>, holds: bool) -> Item {
        Item { printed: Some(Printed { value: value.into(), compared: Some((tolerance.into(), holds)) }), ..self }
    }

    /// The same, with a value computed from the paper's numbers or taken from its authors' repository.
    pub fn authors(self, value: Option<String>) -> Item {
        Item { authors: value, ..self }
    }

    /// The same, as a headline claim.
    pub fn headline(self, sentence: impl Into<String>) -> Item {
        Item { headline: Some(sentence.into()), ..self }
    }
}

/// Without the noise of the last digits, which no reader of a table wants.
fn shown(x: f64) -> f64 {
    if x.abs() < 1e-6 { x } else { (x * 1e9).round() / 1e9 }
}

/// Collects the rows of one paper, and says where it is.
pub struct Rows<'a> {
    paper: &'static Paper,
    rows: Vec<Row>,
    setting: Setting,
    progress: &'a mut dyn FnMut(&str) -> ControlFlow<()>,
}

impl<'a> Rows<'a> {
    /// No rows yet. `progress` is told what is being run, and may break it off.
    pub fn new(paper: &'static Paper, progress: &'a mut dyn FnMut(&str) -> ControlFlow<()>) -> Rows<'a> {
        Rows { paper, rows: Vec::new(), setting: Setting::default(), progress }
    }

    /// Says what comes next; `Break` means that the paper should return at once with the rows it has.
    pub fn begin(&mut self, what: &str) -> ControlFlow<()> {
        (self.progress)(what)
    }

    /// Says where the next rows come from, how they are computed, and why their tolerances are what they are. An item's
    /// own words go before these.
    pub fn about(&mut self, source: impl Into<String>, method: impl Into<String>, why: impl Into<String>) {
        self.setting = Setting { source: source.into(), method: method.into(), why: why.into() };
    }

    /// A number against a number, within an absolute tolerance (0 is exact).
    pub fn number(&mut self, item: Item, specified: f64, ours: f64, tolerance: f64, unit: &str) {
        let ok = (ours - specified).abs() <= tolerance * (1.0 + 1e-12) || ours == specified;
        let tolerance = if tolerance == 0.0 { "exact".to_owned() } else { format!("± {tolerance} {unit}") };
        self.push(item, Some(format!("{specified} {unit}")), format!("{} {unit}", shown(ours)), tolerance, ok);
    }

    /// A vector against a vector, each component within an absolute tolerance (0 is exact).
    pub fn vector(&mut self, item: Item, specified: [f64; 2], ours: [f64; 2], tolerance: f64, unit: &str) {
        let near = |i: usize| (ours[i] - specified[i]).abs() <= tolerance * (1.0 + 1e-12) || ours[i] == specified[i];
        let text = |v: [f64; 2]| format!("({}, {}) {unit}", shown(v[0]), shown(v[1]));
        let tolerance = if tolerance == 0.0 { "exact".to_owned() } else { format!("± {tolerance} {unit} each") };
        self.push(item, Some(text(specified)), text(ours), tolerance, near(0) && near(1));
    }

    /// A count, a flag, a word: equal or not.
    pub fn exact<T: PartialEq + std::fmt::Display>(&mut self, item: Item, specified: T, ours: T) {
        let ok = ours == specified;
        self.push(item, Some(specified.to_string()), ours.to_string(), "exact".to_owned(), ok);
    }

    /// A claim of the paper that the specification says nothing about.
    pub fn claim(&mut self, item: Item, ours: impl Into<String>) {
        assert!(item.printed.as_ref().is_some_and(|printed| printed.compared.is_some()), "{}", item.item);
        self.push(item, None, ours.into(), String::new(), false);
    }

    /// Something that its runs cannot say, and why not. `expected` says that the number of runs was chosen so, and that
    /// the machine is not to blame.
    pub fn no_evidence(&mut self, item: Item, specified: Option<String>, because: &str, expected: bool) {
        let note = format!("no evidence: {because}");
        let item = Item { note, printed: item.printed.map(|printed| Printed { compared: None, ..printed }), ..item };
        let specified = specified.or_else(|| Some("-".to_owned()));
        let mut row = self.row(item, specified, "-".to_owned(), "-".to_owned(), false);
        (row.verdict, row.named, row.headline) = (Verdict::NoEvidence, expected, None);
        self.rows.push(row);
    }

    /// Anything else: the value of the specification, ours, and whether ours is within the tolerance of it.
    pub fn push(&mut self, item: Item, specified: Option<String>, ours: String, tolerance: String, ok: bool) {
        let row = self.row(item, specified, ours, tolerance, ok);
        self.rows.push(row);
    }

    fn row(&self, item: Item, specified: Option<String>, ours: String, tolerance: String, ok: bool) -> Row {
        let trim = |text: String| text.trim_end().to_owned();
        let (printed, compared) = match item.printed {
            Some(printed) => (Some(printed.value), printed.compared),
            None => (None, None),
        };
        assert!(specified.is_some() || compared.is_some(), "{}: nothing to compare with", item.item);
        let verdict = match &compared {
            Some((_, true)) => Verdict::Paper,
            _ if specified.is_some() && ok => Verdict::Specification,
            _ => Verdict::Differs,
        };
        let reason = self.paper.differs.iter().find(|(name, _)| *name == item.item).map(|(_, reason)| *reason);
        let reason = reason.filter(|_| verdict == Verdict::Differs);
        let words = [item.note.as_str(), reason.unwrap_or_default()].map(str::trim);
        let paper_tolerance = compared.map(|(tolerance, _)| tolerance);
        let tolerance = match (&paper_tolerance, verdict, &specified) {
            (Some(of_paper), Verdict::Paper, _) | (Some(of_paper), _, None) => of_paper.clone(),
            _ => tolerance,
        };
        let own = |own: String, shared: &String| if own.is_empty() { shared.clone() } else { own };
        Row {
            paper: self.paper.name.to_owned(),
            item: item.item,
            headline: item.headline,
            printed,
            authors: item.authors,
            specification: specified.map(trim),
            ours: trim(ours),
            tolerance: trim(tolerance),
            paper_tolerance,
            verdict,
            named: reason.is_some(),
            note: words.into_iter().filter(|words| !words.is_empty()).collect::<Vec<_>>().join("; "),
            source: own(item.setting.source, &self.setting.source),
            method: own(item.setting.method, &self.setting.method),
            why: own(item.setting.why, &self.setting.why),
        }
    }

    /// The rows.
    pub fn finish(self) -> Vec<Row> {
        self.rows
    }
}

/// A paper that can be reproduced.
pub struct Paper {
    /// Its name on the command line: that of its specification.
    pub name: &'static str,
    /// Citation.
    pub citation: &'static str,
    /// Why most rows have no value of the paper.
    pub silence: &'static str,
    /// Items of the rows that differ, each with the reason, as far as it is known.
    pub differs: &'static [(&'static str, &'static str)],
    /// Adds all its rows. Returns early if [`Rows::begin`] says `Break`.
    pub rows: fn(&mut Rows<'_>) -> ControlFlow<()>,
    /// How often it calls [`Rows::begin`]: steps of a progress bar.
    pub steps: usize,
    /// Files for `--out`: name (`.csv`) and text. SVG pictures are drawn from these by the command line.
    pub series: fn() -> Vec<Series>,
}

impl Paper {
    /// All its rows, without a word about it.
    pub fn all_rows(&'static self) -> Vec<Row> {
        let mut quiet = |_: &str| ControlFlow::Continue(());
        let mut rows = Rows::new(self, &mut quiet);
        // Nothing breaks it off.
        let _ = (self.rows)(&mut rows);
        rows.finish()
    }
}

/// Data of a figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// File name without ending.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// Label of the x axis, with unit.
    pub x: String,
    /// Label of the y axis, with unit.
    pub y: String,
    /// How it is drawn.
    pub form: Form,
    /// Lines (or bars), each with a name and its points.
    pub lines: Vec<Line>,
    /// Discs drawn below the lines: x, y, radius.
    pub discs: Vec<[f64; 3]>,
}

/// A line, or a set of bars: its name and its points.
pub type Line = (String, Vec<[f64; 2]>);

impl Series {
    /// Paths in the plane, m, drawn over discs.
    pub fn paths(name: impl Into<String>, title: impl Into<String>, lines: Vec<Line>, discs: Vec<[f64; 3]>) -> Series {
        Series { discs, ..Series::chart(Form::Paths, name, title, ["x (m)", "y (m)"], lines) }
    }

    /// A chart with these axes, their units included.
    pub fn chart(
        form: Form,
        name: impl Into<String>,
        title: impl Into<String>,
        [x, y]: [&str; 2],
        lines: Vec<Line>,
    ) -> Series {
        Series {
            name: name.into(),
            title: title.into(),
            x: x.to_owned(),
            y: y.to_owned(),
            form,
            lines,
            discs: Vec::new(),
        }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Form {
    /// Paths in the plane, equal scales.
    Paths,
    /// A quantity over another one.
    Lines,
    /// Bars.
    Bars,
    /// A quantity over the plane: a grid, one line for each y (its name, as a number), with points (x, quantity).
    Surface,
    /// Arrows in the plane, equal scales: of each line, one point after the other where an arrow begins and where it ends.
    Arrows,
    /// Places in the plane, equal scales.
    Dots,
}
