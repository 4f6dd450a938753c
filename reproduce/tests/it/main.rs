//! The papers' rows and scenes, and the stepper that runs them.

mod amr_apf;
mod decentralized_apf;
mod liquid;
mod papers;
mod pso_via_points;
mod rpoa;
mod stepper;
