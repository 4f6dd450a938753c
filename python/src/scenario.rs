//! Scenarios: checked, with overrides applied.

use model::{FilterKind, Mode, Problem};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use scenarios::{Files, NamedIn, Overrides, Problems};
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// The files that a scenario names, such as its map: beside its own.
#[derive(Debug)]
struct Folder(PathBuf);

impl Files for Folder {
    fn read(&self, path: &str, named_in: NamedIn, bytes_max: u64) -> Result<Vec<u8>, String> {
        let path = match named_in {
            NamedIn::Scenario => self.0.join(path),
            NamedIn::Option => Path::new(path).to_path_buf(),
        };
        // In the words of the command line.
        let file = File::open(&path).and_then(|file| {
            if file.metadata()?.len() > bytes_max { Err(ErrorKind::FileTooLarge.into()) } else { Ok(file) }
        });
        let mut bytes = Vec::new();
        // A device has no size, and is read up to the bound.
        let read = file.and_then(|file| file.take(bytes_max + 1).read_to_end(&mut bytes));
        let too_large = || format!("it is larger than {} KiB", bytes_max >> 10);
        match read {
            Ok(_) if bytes.len() as u64 > bytes_max => Err(too_large()),
            Ok(_) => Ok(bytes),
            Err(error) => Err(match error.kind() {
                ErrorKind::NotFound => format!("file not found (`{}`)", path.display()),
                ErrorKind::IsADirectory => "it is a directory".to_owned(),
                ErrorKind::FileTooLarge => too_large(),
                ErrorKind::PermissionDenied => "it may not be read".to_owned(),
                _ => error.to_string(),
            }),
        }
    }
}

/// A scenario that has been checked.
#[pyclass(frozen, module = "shoal._native", name = "Scenario")]
pub(crate) struct Scenario(pub(crate) model::Scenario);

#[pymethods]
impl Scenario {
    /// Reads and checks a TOML text, and the files that it names in this folder. `lined`: the text is one that the user wrote,
    /// so problems name its lines.
    #[new]
    #[pyo3(signature = (name, text, lined, folder, *, mode, planner, filter, robots, seed, duration_s, set))]
    #[expect(clippy::too_many_arguments, reason = "the overrides of the command line, each by its name")]
    fn new(
        py: Python<'_>,
        name: &str,
        text: &str,
        lined: bool,
        folder: PathBuf,
        mode: Option<&str>,
        planner: Option<String>,
        filter: Option<&str>,
        robots: Option<usize>,
        seed: Option<u64>,
        duration_s: Option<f64>,
        set: Vec<String>,
    ) -> PyResult<Scenario> {
        let modes = [Mode::Single, Mode::Lockstep, Mode::Realtime];
        let filters = [FilterKind::None, FilterKind::SharedGap];
        let overrides = Overrides {
            mode: one_of(py, "mode", mode, &modes, |mode| mode.word())?,
            planner,
            filter: one_of(py, "filter", filter, &filters, |filter| filter.word())?,
            robots,
            seed,
            duration_s,
            set,
            ..Overrides::default()
        };
        scenarios::parse_with_files(name, text, &overrides, &Folder(folder))
            .map(Scenario)
            .map_err(|problems| wrong(py, problems, lined))
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// What it shows.
    #[getter]
    fn description(&self) -> &str {
        &self.0.description
    }

    /// Clock mode.
    #[getter]
    fn mode(&self) -> &'static str {
        self.0.clock.mode.word()
    }

    /// Ticks per second.
    #[getter]
    fn tick_hz(&self) -> f64 {
        self.0.clock.tick_hz
    }

    /// Random seed.
    #[getter]
    fn seed(&self) -> u64 {
        self.0.clock.seed
    }

    /// Longest simulated time, s.
    #[getter]
    fn duration_s(&self) -> f64 {
        self.0.clock.ticks_max as f64 * self.0.clock.dt_s()
    }

    /// Names of the robots, by index.
    #[getter]
    fn robots(&self) -> Vec<&str> {
        self.0.robots.iter().map(|robot| robot.id.as_str()).collect()
    }

    /// What is questionable: dicts with line, key, message, hint.
    #[getter]
    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        list(py, &self.0.warnings)
    }
}

/// Names of the catalog and their texts.
#[pyfunction]
pub(crate) fn catalog() -> Vec<(&'static str, &'static str)> {
    scenarios::catalog().iter().map(|entry| (entry.name, entry.text)).collect()
}

/// The text of a scenario of the catalog, or what is wrong with the name.
#[pyfunction]
pub(crate) fn find_catalog(py: Python<'_>, name: &str) -> PyResult<&'static str> {
    scenarios::find_catalog(name).map(|entry| entry.text).map_err(|unknown| {
        let text =
            format!("{unknown}\nhint: {}\nhint: a file is named with its path, as in `./my.toml`", unknown.hint());
        error(py, &text, None)
    })
}

fn one_of<T: Copy>(
    py: Python<'_>,
    what: &str,
    given: Option<&str>,
    known: &[T],
    word: impl Fn(T) -> &'static str,
) -> PyResult<Option<T>> {
    let Some(given) = given else { return Ok(None) };
    let words: Vec<&str> = known.iter().map(|known| word(*known)).collect();
    let found = known.iter().copied().find(|known| word(*known) == given);
    found.map(Some).ok_or_else(|| error(py, &format!("{what} `{given}`: not one of {}", words.join(", ")), None))
}

/// All problems of a scenario as one exception.
fn wrong(py: Python<'_>, mut problems: Problems, lined: bool) -> PyErr {
    if !lined {
        problems.shown.iter_mut().for_each(|problem| problem.line = None);
    }
    let text = problems.to_string();
    let lines: Vec<&str> = text.lines().map(|line| line.strip_prefix("error: ").unwrap_or(line)).collect();
    match list(py, &problems.shown) {
        Ok(list) => error(py, &lines.join("\n"), Some(list)),
        Err(error) => error,
    }
}

fn error(py: Python<'_>, text: &str, problems: Option<Bound<'_, PyList>>) -> PyErr {
    let made = py.import("shoal._errors").and_then(|errors| errors.call_method1("scenario_error", (text, problems)));
    made.map_or_else(|error| error, PyErr::from_value)
}

fn list<'py>(py: Python<'py>, problems: &[Problem]) -> PyResult<Bound<'py, PyList>> {
    let entries = PyList::empty(py);
    for problem in problems {
        let entry = PyDict::new(py);
        entry.set_item("line", problem.line)?;
        entry.set_item("key", &problem.key)?;
        entry.set_item("message", &problem.message)?;
        entry.set_item("hint", problem.hint.as_deref())?;
        entries.append(entry)?;
    }
    Ok(entries)
}
