//! The second physics of a world: bodies have mass, stand on a ground that holds only so much, and push each other.
//!
//! ```text
//! ground    what a drive, its motors and the friction of the ground give a body in one step; no engine, plain numbers
//! touch     who touches what since when
//! bodies    the bodies of a world in the engine, tick by tick
//! ```
//!
//! This is the one crate that names rapier. Its nalgebra is another version than that of the kinematic world; neither
//! sees the other: numbers cross here, one by one.

mod bodies;
mod ground;
mod touch;

pub use bodies::{Bodies, State, Way};
pub use ground::Chassis;
pub use touch::{Touch, With};
