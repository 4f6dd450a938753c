//! The native part of the Python module `shoal`: `python/shoal/__init__.py` is what users import.
//!
//! ```text
//! agent       a script as the agent of a robot      simulate      a fleet in this thread
//! planner     a planner that calls Python           answer        what it answers
//! robot       what stays the same of a robot        view          what it sees in a tick
//! scenario    checked scenarios                     recording     records as arrays
//! trajectories  where everybody was                 results       report and log
//! arrays      NumPy arrays                          slow          plans that take too long
//! ```
//! Nothing here decides about robots: the cores are those of the other crates.

mod agent;
mod answer;
mod arrays;
mod planner;
mod recording;
mod results;
mod robot;
mod scenario;
mod simulate;
mod slow;
mod trajectories;
mod view;

/// The native module.
#[pyo3::pymodule(gil_used = true)]
mod _native {
    #[pymodule_export]
    use crate::agent::run_agent;
    #[pymodule_export]
    use crate::answer::Answer;
    #[pymodule_export]
    use crate::recording::load;
    #[pymodule_export]
    use crate::robot::{Limits, Obstacles, Robot};
    #[pymodule_export]
    use crate::scenario::{Scenario, catalog, find_catalog};
    #[pymodule_export]
    use crate::simulate::simulate;
    #[pymodule_export]
    use crate::view::{Neighbors, View};
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
