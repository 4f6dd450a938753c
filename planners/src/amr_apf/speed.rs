//! From a force to forward speed and turn rate.

use nalgebra::Vector2;

/// The speed limit for which the authors gave turn rates, m/s. Other robots turn faster in proportion to their speed, so
/// that they drive the same curves.
pub const SPEED_REFERENCE_MPS: f64 = 0.2;
/// The authors' limit of the turn rate at that speed, rad/s.
const TURN_MAX: f64 = 1.0;

/// Forward speed v and turn rate w for a force (F_r, F_t), in units of C_a; speeds are shares of the speed limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedLaw {
    /// Share of the speed limit per F_r / C_a, beside the square.
    pub linear: f64,
    /// Share of the speed limit that is always there while F_r ≥ 0.
    pub floor: f64,
    /// Turn rate per F_t / C_a at the reference speed, rad/s.
    pub turn_gain: f64,
    /// When to turn in place because there is no way ahead.
    pub pivot: Pivot,
    /// Up to this share of the speed limit a robot that hardly turns ...
    pub creep_below: f64,
    /// ... drives with this share instead.
    pub creep: f64,
    /// Do not turn beyond the direction of the force in one tick, and do not creep towards something near.
    pub guarded: bool,
}

/// When a robot that hardly turns gets the full turn rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pivot {
    /// Never.
    Never,
    /// If the force points clearly backwards.
    Backwards,
    /// If it has no forward speed.
    Standing,
}

/// A command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// v, m/s.
    pub speed_mps: f64,
    /// w, rad/s.
    pub turn_radps: f64,
}

/// What the command depends on beside the force.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// C_a.
    pub c_a: f64,
    /// v_max, m/s.
    pub speed_mps_max: f64,
    /// Length of a tick, s.
    pub dt_s: f64,
    /// Something is near ahead.
    pub blocked: bool,
    /// Take sgn(0) = 0.
    pub sgn_zero: bool,
}

impl SpeedLaw {
    /// The command for a force in the body frame.
    pub fn twist(&self, force: Vector2<f64>, body: &Body) -> Twist {
        let (f_r, f_t) = (force.x / body.c_a, force.y / body.c_a);
        let v_max = body.speed_mps_max;
        // Turn rates grow with the speed; at the reference speed the factor is exactly one.
        let pace = v_max / SPEED_REFERENCE_MPS;
        let mut v = if f_r < 0.0 { 0.0 } else { v_max * (f_r * f_r + self.linear * f_r) + self.floor * v_max };
        let mut w = self.turn_gain * f_t;
        let pivots = match self.pivot {
            Pivot::Never => false,
            Pivot::Backwards => force.x < -1.0,
            Pivot::Standing => v == 0.0,
        };
        let sgn = if w < 0.0 {
            -1.0
        } else if w > 0.0 || !body.sgn_zero {
            1.0
        } else {
            0.0
        };
        if pivots && w.abs() < 0.05 {
            w = sgn * TURN_MAX;
        }
        if v <= self.creep_below * v_max && w.abs() < 0.03 {
            if self.guarded && body.blocked {
                w = sgn * TURN_MAX;
            } else {
                v = self.creep * v_max;
            }
        }
        v = v.clamp(0.0, v_max);
        w = w.clamp(-TURN_MAX, TURN_MAX) * pace;
        if self.guarded {
            let off = force.y.atan2(force.x).abs() / body.dt_s;
            w = w.clamp(-off, off);
        }
        Twist { speed_mps: v, turn_radps: w }
    }
}
