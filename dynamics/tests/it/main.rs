//! Bodies with weight, through the door of the crate.

mod motion;
mod push;
mod scene;
