//! Tests of the methods, one binary: worked examples, the papers' environments, and properties of every method.

mod acceptance;
mod allocation;
mod decentralized_apf;
mod environment;
mod geometry;
mod inputs;
mod methods;
mod params;
mod properties;
mod random;
mod sim;
