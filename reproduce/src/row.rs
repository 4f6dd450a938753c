//! A claim and what became of it.

use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// One claim of a paper, or one result of its specification's oracle, beside ours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the paper.
    pub paper: String,
    /// What is compared: experiment, method variant, quantity.
    pub item: String,
    /// What the paper prints, if it prints it.
    pub paper_value: Option<String>,
    /// What the reference implementation of the specification gives, if it has it.
    pub oracle_value: Option<String>,
    /// What we get.
    pub ours: String,
    /// How far ours may be from the oracle (or from the paper), in words: `exact`, `± 0.02 m`, `2 %`, ...
    pub tolerance: String,
    /// Whether ours is within the tolerance.
    pub ok: bool,
    /// Anything a reader must know: where a tolerance comes from, why a row cannot hold.
    pub note: String,
}

/// What is being compared, for building rows.
#[derive(Clone, Debug, Default)]
pub struct Item {
    /// See [`Row::item`].
    pub item: String,
    /// See [`Row::paper_value`].
    pub paper_value: Option<String>,
    /// See [`Row::note`].
    pub note: String,
}

impl Item {
    /// An item of which the paper prints no value.
    pub fn new(item: impl Into<String>) -> Item {
        Item { item: item.into(), ..Item::default() }
    }

    /// The same, with this note.
    pub fn note(self, note: impl Into<String>) -> Item {
        Item { note: note.into(), ..self }
    }
}

/// Collects the rows of one paper, and says where it is.
pub struct Rows<'a> {
    paper: &'static str,
    rows: Vec<Row>,
    progress: &'a mut dyn FnMut(&str) -> ControlFlow<()>,
}

impl<'a> Rows<'a> {
    /// No rows yet. `progress` is told what is being run, and may break it off.
    pub fn new(paper: &'static str, progress: &'a mut dyn FnMut(&str) -> ControlFlow<()>) -> Rows<'a> {
        Rows { paper, rows: Vec::new(), progress }
    }

    /// Says what comes next; `Break` means that the paper should return at once with the rows it has.
    pub fn begin(&mut self, what: &str) -> ControlFlow<()> {
        (self.progress)(what)
    }

    /// A number against a number, within an absolute tolerance (0 is exact).
    pub fn number(&mut self, item: Item, oracle: f64, ours: f64, tolerance: f64, unit: &str) {
        let ok = (ours - oracle).abs() <= tolerance * (1.0 + 1e-12) || ours == oracle;
        let tolerance = if tolerance == 0.0 { "exact".to_owned() } else { format!("± {tolerance} {unit}") };
        self.push(
            item,
            Some(format!("{oracle} {unit}")),
            format!("{ours} {unit}"),
            tolerance.trim_end().to_owned(),
            ok,
        );
    }

    /// A vector against a vector, each component within an absolute tolerance (0 is exact).
    pub fn vector(&mut self, item: Item, oracle: [f64; 2], ours: [f64; 2], tolerance: f64, unit: &str) {
        let [x, y] = [0, 1].map(|i| (ours[i] - oracle[i]).abs() <= tolerance * (1.0 + 1e-12) || ours[i] == oracle[i]);
        let text = |v: [f64; 2]| format!("({}, {}) {unit}", v[0], v[1]);
        let tolerance = if tolerance == 0.0 { "exact".to_owned() } else { format!("± {tolerance} {unit} each") };
        self.push(item, Some(text(oracle)), text(ours), tolerance, x && y);
    }

    /// A count, a flag, a word: equal or not.
    pub fn exact<T: PartialEq + std::fmt::Display>(&mut self, item: Item, oracle: T, ours: T) {
        let ok = ours == oracle;
        self.push(item, Some(oracle.to_string()), ours.to_string(), "exact".to_owned(), ok);
    }

    /// Anything else.
    pub fn push(&mut self, item: Item, oracle_value: Option<String>, ours: String, tolerance: String, ok: bool) {
        let trim = |text: String| text.trim_end().to_owned();
        self.rows.push(Row {
            paper: self.paper.to_owned(),
            item: item.item,
            paper_value: item.paper_value,
            oracle_value: oracle_value.map(trim),
            ours: trim(ours),
            tolerance,
            ok,
            note: item.note,
        });
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
    /// Adds all its rows. Returns early if [`Rows::begin`] says `Break`.
    pub rows: fn(&mut Rows<'_>) -> ControlFlow<()>,
    /// Files for `--out`: name (`.csv`) and text. SVG pictures are drawn from these by the command line.
    pub series: fn() -> Vec<Series>,
}

impl Paper {
    /// All its rows, without a word about it.
    pub fn all_rows(&self) -> Vec<Row> {
        let mut quiet = |_: &str| ControlFlow::Continue(());
        let mut rows = Rows::new(self.name, &mut quiet);
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
}
