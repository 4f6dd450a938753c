//! What the registry knows of a method.

use crate::params::{self, ParamError};
use crate::planner::Planner;
use model::kind::Spec;
use model::{BodyKind, ParamValues};

/// Builds a method for one robot, or says which parameter does not fit.
pub type Build = fn(&ParamValues, Identity) -> Result<Box<dyn Planner>, ParamError>;

/// A method as the registry knows it.
pub struct Method {
    /// Its name on the command line and in scenarios.
    pub name: &'static str,
    /// One line: what it is.
    pub summary: &'static str,
    /// Where it was published, or "" for what is not from a paper.
    pub source: &'static str,
    /// What leaves its plans unchanged; the property tests hold it to that.
    pub symmetry: Symmetry,
    /// The kinds of bodies that it can drive; a scenario that gives it another is refused.
    pub kinds: &'static [BodyKind],
    /// Its parameters.
    pub params: fn() -> Vec<Spec>,
    /// The greatest speed that it asks of a body with these parameters and this length of a tick (s), m/s: infinite if it
    /// uses what the body has. Its defaults do.
    pub speed_mps: fn(&ParamValues, f64) -> f64,
    /// It counts on the [filter](crate::filter) behind it: robots get one unless their scenario says otherwise.
    pub wants_filter: bool,
    /// Builds it for one robot.
    pub build: Build,
}

/// For methods that use the speed that a body has, whatever their parameters.
pub fn any_speed(_: &ParamValues, _: f64) -> f64 {
    f64::INFINITY
}

impl Method {
    /// Every problem of these values, for a validator that lists them all. `build` stops at the first.
    pub fn check(&self, values: &ParamValues) -> Vec<ParamError> {
        params::check(&(self.params)(), values)
    }
}

/// Changes of the world that change a method's plans only in the same way, up to rounding, with its default
/// parameters. A method with a fixed set of directions is not symmetric under rotation; one that prefers a side is not
/// under reflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Symmetry {
    /// Turning everything about any point.
    pub rotation: bool,
    /// Moving everything.
    pub translation: bool,
    /// Mirroring everything.
    pub reflection: bool,
    /// Listing the neighbours in another order.
    pub neighbor_order: bool,
}

impl Symmetry {
    /// All of them.
    pub const FULL: Symmetry = Symmetry { rotation: true, translation: true, reflection: true, neighbor_order: true };
}

/// Who plans: keys of the random streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Seed of the run.
    pub seed: u64,
    /// Slot of the robot.
    pub robot: u32,
    /// How often the robot was started before.
    pub incarnation: u32,
}
