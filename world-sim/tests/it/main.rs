//! The world as its callers see it, driven by agents that go straight.

mod arms;
mod driver;
mod physics;
mod presence;
mod ranges;
mod referee;
