//! Tests of the methods, one binary: unit tests, and properties of every method. The papers' worked examples and
//! environments are rows of `reproduce`.

mod allocation;
mod amr_apf;
mod arm;
mod chassis;
mod decentralized_apf;
mod equations;
mod inputs;
mod liquid;
mod methods;
mod obstacles;
mod params;
mod properties;
mod pso_via_points;
mod rpoa;
