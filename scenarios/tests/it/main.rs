//! The scenario format: what is read, what is refused and how it is said, and the catalog.

mod arms;
mod catalog;
mod draft;
mod errors;
mod goals;
mod layouts;
mod maps;
mod physics;
mod resolve;
mod robustness;
mod schema;
mod support;
mod warnings;
mod wheels;
