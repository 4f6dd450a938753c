//! What the papers report, held against what shoal's methods do: one row per claim, in one thread, with each paper's own
//! update order.
//!
//! A paper is one module: it knows the paper's experiments and yields [`Row`]s. Where it has to run something, it takes a
//! scenario from [`scene`] and runs it with [`stepper`]. The methods themselves are in `planners`; nothing here is used by
//! a running fleet.

pub mod amr_apf;
pub mod decentralized_apf;
pub mod example;
pub mod field_map;
pub mod forces;
pub mod liquid;
pub mod pso_via_points;
pub mod row;
pub mod rpoa;
pub mod scene;
pub mod smoothness;
pub mod stats;
pub mod stepper;

pub use row::{Item, Paper, Row, Rows, Verdict};

/// The papers, in the order in which they are listed.
pub static PAPERS: &[&Paper] =
    &[&decentralized_apf::PAPER, &rpoa::PAPER, &liquid::PAPER, &pso_via_points::PAPER, &amr_apf::PAPER];
