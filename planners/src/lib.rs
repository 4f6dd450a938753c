//! The methods: pure mathematics, no clock, no I/O, and nothing of this workspace but the nouns and the geometry.
//!
//! A robot's plan is a function of what the robot knows at this tick ([`PlanInput`]) and of what the method
//! remembers. Every method lives in one file beside its paper; [`METHODS`] lists them.
//!
//! Units are SI; angles are radians, counter-clockwise from +x; x is forward and y is left in a body frame.

pub mod amr_apf;
pub mod apf;
pub mod chassis;
pub mod dapf;
pub mod decentralized_apf;
pub mod filter;
pub mod guide;
pub mod lanes;
pub mod liquid;
pub mod method;
pub mod orca;
pub mod params;
pub mod planner;
pub mod power_law;
pub mod pso_via_points;
pub mod rpoa;
pub mod steering;
pub mod straight;
#[cfg(test)]
mod testing;
pub mod way;

pub use chassis::Chassis;
pub use method::{Identity, Method, Misfit, RADIUS_M, Symmetry};
pub use model::{choice, keys};
pub use params::ParamError;
pub use planner::{
    FIRST_WALL, Intent, Neighbor, Obstacle, Plan, PlanInput, Planner, SENSED_WALLS_MAX, nearest_by_id, solid,
};

/// Every method, in the order in which help lists them. A new one costs its file, its `pub mod` above and a line here.
pub static METHODS: &[&Method] = &[
    &straight::METHOD,
    &apf::METHOD,
    &decentralized_apf::METHOD,
    &rpoa::METHOD,
    &liquid::offline::METHOD,
    &liquid::online::METHOD,
    &pso_via_points::METHOD,
    &amr_apf::METHOD,
    &dapf::METHOD,
    &orca::METHOD,
    &power_law::METHOD,
    &lanes::METHOD,
];

/// The method of that name.
pub fn find(name: &str) -> Option<&'static Method> {
    METHODS.iter().copied().find(|method| method.name == name)
}
