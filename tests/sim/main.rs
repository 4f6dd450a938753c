//! Whole fleets in one thread: the cores, and nothing but the cores.

mod amr_apf;
mod bodies;
mod catalog;
mod crossings;
mod crowds;
mod determinism;
mod invariants;
mod lanes;
mod maps;
mod radio;
mod random;
mod replay;
mod solids;
mod table;
mod timeline;
mod truth;
mod weight;
mod wheels;
mod worlds;
