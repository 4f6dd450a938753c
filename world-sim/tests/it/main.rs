//! The world as its callers see it, driven by agents that go straight.

mod arms;
mod attendance;
mod checkpoint;
mod driver;
mod faults;
mod physics;
mod presence;
mod ranges;
mod referee;
mod walls;
