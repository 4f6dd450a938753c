//! What the registry knows of a method.

use crate::params::{self, ParamError};
use crate::planner::Planner;
use model::kind::{Kind, Spec};
use model::value::Value;
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
    /// The parameters whose defaults are absolute lengths, or made of lengths: they suit bodies of about [`RADIUS_M`].
    pub lengths: &'static [Length],
    /// It counts on the [filter](crate::filter) behind it: robots get one unless their scenario says otherwise.
    pub wants_filter: bool,
    /// It follows shortest [ways](crate::way) where it knows the map.
    pub follows_ways: bool,
    /// Builds it for one robot.
    pub build: Build,
}

/// The radius of the bodies for which defaults that are absolute lengths were chosen, m.
pub const RADIUS_M: f64 = 0.2;
/// A body whose radius differs from that by no more than this factor is of about that size.
const RADIUS_FACTOR: f64 = 2.0;

/// Parameters that choose the values of all others.
const PRESETS: [&str; 2] = ["preset", "variant"];

/// A parameter whose default suits bodies of one size only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Length {
    /// Its name.
    pub name: &'static str,
    /// The power of a length that it is: 1 for m, -1 for 1/m, 3 for a gain of repulsion (m⁴/s, of which a speed is left).
    pub power: i32,
}

impl Length {
    /// A parameter of this name and power.
    pub const fn of(name: &'static str, power: i32) -> Length {
        Length { name, power }
    }
}

/// A default that does not suit a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// The parameter.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its default.
    pub default: f64,
    /// What is to this body as the default is to one of [`RADIUS_M`], within the bounds of the parameter.
    pub fits: f64,
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

    /// The defaults that do not suit a body of this radius (m). A value that is given suits, and so do all values of a preset
    /// that is given: they are meant.
    pub fn misfits(&self, values: &ParamValues, radius_m: f64) -> Vec<Misfit> {
        let times = radius_m / RADIUS_M;
        let is_given = |name: &str| values.contains_key(name);
        if (times * RADIUS_FACTOR >= 1.0 && times <= RADIUS_FACTOR) || PRESETS.into_iter().any(is_given) {
            return Vec::new();
        }
        let specs = (self.params)();
        let misfit = |length: &Length| {
            let spec = specs.iter().find(|spec| spec.name == length.name)?;
            let (Kind::Float(range), Some(Value::Float(default))) = (spec.kind(), spec.default()) else { return None };
            let fits = (default * times.powi(length.power)).clamp(range.min, range.max);
            Some(Misfit { name: spec.name, unit: spec.unit, default, fits })
        };
        self.lengths.iter().filter(|length| !is_given(length.name)).filter_map(misfit).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Lengths that suit bodies of any size.
    const SUIT_ANY: [(&str, &str); 6] = [
        // These follow the speed limit.
        ("apf", "attract_cap_m"),
        ("decentralized-apf", "attract_cap"),
        ("rpoa", "step_radius"),
        ("liquid-online", "step_m"),
        // What a longer search is worth; the space of an arm's joints.
        ("pso-via-points", "gain"),
        ("pso-via-points", "grid"),
    ];

    #[test]
    fn every_default_that_is_a_length_is_named_with_the_power_of_its_unit() {
        let mut lengths = 0;
        for method in crate::METHODS {
            let specs = (method.params)();
            for spec in &specs {
                let power = match spec.unit {
                    "m" => 1,
                    "m²" => 2,
                    "1/m" => -1,
                    "1/m²" => -2,
                    "m⁴/s" => 3,
                    _ => 0,
                };
                let is_none = spec.default() == Some(Value::Float(0.0)) || SUIT_ANY.contains(&(method.name, spec.name));
                let expected = (power != 0 && !is_none).then_some(Length::of(spec.name, power));
                let named = method.lengths.iter().find(|length| length.name == spec.name).copied();
                assert_eq!(named, expected, "{} {}", method.name, spec.name);
                lengths += usize::from(named.is_some());
            }
            assert!(method.lengths.iter().all(|length| specs.iter().any(|spec| spec.name == length.name)));
        }
        assert!(lengths > 30, "{lengths}");
    }

    #[test]
    fn what_fits_is_in_proportion_and_within_bounds() {
        let apf = crate::find("apf").unwrap();
        let fits = |radius_m: f64| -> Vec<(&str, f64)> {
            apf.misfits(&ParamValues::new(), radius_m).iter().map(|misfit| (misfit.name, misfit.fits)).collect()
        };
        assert_eq!(fits(0.2), []);
        assert_eq!(fits(0.8), [("influence_m", 4.0), ("k_rep", 0.2 * 64.0)]);
        assert_eq!(fits(50.0), [("influence_m", 100.0), ("k_rep", 100.0)]);
    }
}
