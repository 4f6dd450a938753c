//! Scenarios from short texts and from the catalog, and sweeps over seeds.
#![expect(clippy::print_stderr, reason = "a failing test says which seed failed")]

use model::Scenario;
use scenarios::Overrides;

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
