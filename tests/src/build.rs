//! Scenarios from short texts and from the catalog, and sweeps over seeds.
#![expect(clippy::print_stderr, reason = "a failing test says which seed failed")]

use model::Scenario;
use scenarios::{Files, NamedIn, Overrides};

/// The scenario that a text describes.
///
/// # Panics
/// With all its problems, when it has any.
pub fn scenario(text: &str) -> Scenario {
    with(text, &Overrides::default())
}

/// The same with changes.
///
/// # Panics
/// With all its problems, when it has any.
pub fn with(text: &str, overrides: &Overrides) -> Scenario {
    scenarios::parse("test.toml", text, overrides).unwrap_or_else(|problems| panic!("{problems}\n{text}"))
}

/// A scenario of the catalog, with changes.
///
/// # Panics
/// When there is none of that name, or the changes do not fit.
pub fn catalog(name: &str, overrides: &Overrides) -> Scenario {
    let entry = scenarios::find_catalog(name).unwrap_or_else(|unknown| panic!("{unknown}"));
    scenarios::parse(entry.name, entry.text, overrides).unwrap_or_else(|problems| panic!("{problems}"))
}

/// The files of `examples/maps`.
#[derive(Clone, Copy, Debug)]
pub struct Maps;

macro_rules! maps {
    ($($name:literal),*) => {
        [$(($name, include_bytes!(concat!("../../examples/maps/", $name)).as_slice())),*]
    };
}

impl Maps {
    /// The bytes of one of them.
    ///
    /// # Panics
    /// When there is none of that name.
    pub fn file(name: &str) -> &'static [u8] {
        let files = maps!["office.toml", "office.yaml", "office.pgm", "rooms.toml", "rooms.map", "rooms.scen"];
        files.into_iter().find(|(file, _)| *file == name).unwrap_or_else(|| panic!("no file `{name}`")).1
    }

    /// A scenario among them, with changes.
    ///
    /// # Panics
    /// When it has problems.
    pub fn scenario(name: &str, overrides: &Overrides) -> Scenario {
        let text = std::str::from_utf8(Maps::file(name)).expect("it is a text");
        scenarios::parse_with_files(name, text, overrides, &Maps).unwrap_or_else(|problems| panic!("{problems}"))
    }
}

impl Files for Maps {
    fn read(&self, path: &str, _: NamedIn, _: u64) -> Result<Vec<u8>, String> {
        Ok(Maps::file(path).to_vec())
    }
}

/// All names in the catalog.
pub fn catalog_names() -> impl Iterator<Item = &'static str> {
    scenarios::catalog().iter().map(|entry| entry.name)
}

/// With this seed.
pub fn seed(seed: u64) -> Overrides {
    Overrides { seed: Some(seed), ..Overrides::default() }
}

/// Checks every seed. A seed that fails is named on standard error: write it down as a row of its own.
pub fn seeds(which: impl IntoIterator<Item = u64>, mut check: impl FnMut(u64)) {
    for seed in which {
        let _named = Named(seed);
        check(seed);
    }
}

struct Named(u64);

impl Drop for Named {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("failing seed: {}", self.0);
        }
    }
}
