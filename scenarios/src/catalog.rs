//! The scenarios that ship with shoal.

use crate::problems::known;

/// A scenario that ships with shoal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CatalogEntry {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its file.
    pub text: &'static str,
}

macro_rules! entries {
    ($($name:literal),* $(,)?) => {
        &[$(CatalogEntry { name: $name, text: include_str!(concat!("../catalog/", $name, ".toml")) }),*]
    };
}

static CATALOG: &[CatalogEntry] = entries![
    "demo-15",
    "ring-15",
    "head-on",
    "corridor-swap",
    "late-join",
    "tasks",
    "moving-obstacles",
    "unicycle-15",
    "scale-64",
    "rvo2-circle",
    "rvo2-blocks",
    "rvo2-roadmap",
    "liquid-gap",
    "liquid-near-goal",
    "liquid-corridor-tight",
    "liquid-u-trap",
    "liquid-u-resonance",
    "liquid-ring-side",
    "rpoa-static",
    "rpoa-moved4",
    "rpoa-moving6",
    "rpoa-orbiter",
    "rpoa-moving-target",
    "rpoa-u-trap",
    "pso-mass-point-1",
    "pso-mass-point-2",
    "amr-case1",
    "amr-case2-01",
    "amr-case2-02",
    "amr-case2-03",
    "amr-case2-04",
    "amr-case2-05",
    "amr-case2-06",
    "amr-case2-07",
    "amr-case2-08",
    "amr-case2-09",
    "amr-case2-10",
    "amr-case2-11",
    "amr-case2-12",
    "arm-1",
    "arm-elbow-flip",
    "mixed",
];

/// All of them, the default of `shoal run` first.
pub fn catalog() -> &'static [CatalogEntry] {
    CATALOG
}

/// The scenario of that name.
pub fn find_catalog(name: &str) -> Result<&'static CatalogEntry, UnknownScenario> {
    CATALOG.iter().find(|entry| entry.name == name).ok_or_else(|| UnknownScenario { name: name.to_string() })
}

/// There is no scenario of that name in the catalog.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown scenario `{}`", name.escape_debug())]
pub struct UnknownScenario {
    /// The name.
    pub name: String,
}

impl UnknownScenario {
    /// The known names and the nearest of them, for a line `hint: ...`.
    pub fn hint(&self) -> String {
        let names: Vec<&str> = CATALOG.iter().map(|entry| entry.name).collect();
        known("scenarios", &self.name, &names)
    }
}
