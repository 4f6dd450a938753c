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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::amr_apf::{Params, Preset};
    use crate::dapf::{self, Variant};

    const BODY: Body = Body { c_a: 4.0, speed_mps_max: 0.2, dt_s: 0.1, blocked: false, sgn_zero: false };

    #[track_caller]
    fn check(law: &SpeedLaw, force: [f64; 2], body: &Body, expected: [f64; 2]) {
        let Twist { speed_mps, turn_radps } = law.twist(force.into(), body);
        let off = (speed_mps - expected[0]).hypot(turn_radps - expected[1]);
        assert!(off < 1e-9, "{force:?}: ({speed_mps}, {turn_radps}) instead of {expected:?}");
    }

    /// v = v_max (F_r / C_a)², nothing backwards; w = 5 F_t / C_a; both within their limits.
    #[test]
    fn by_the_square() {
        for preset in [Preset::Fixed, Preset::Fleet] {
            check(&Params::of(preset).speed_law(), [2.0, 0.4], &BODY, [0.05, 0.5]);
        }
        for preset in [Preset::P, Preset::H] {
            let law = Params::of(preset).speed_law();
            check(&law, [2.0, 0.4], &BODY, [0.05, 0.5]);
            check(&law, [4.0, -0.4], &BODY, [0.2, -0.5]);
            check(&law, [8.0, 0.4], &BODY, [0.2, 0.5]);
            check(&law, [1.0, 4.0], &BODY, [0.0125, 1.0]);
            check(&law, [1.0, -4.0], &BODY, [0.0125, -1.0]);
            check(&law, [-4.0, 0.4], &BODY, [0.0, 0.5]);
        }
    }

    /// C1: v_max ((F_r/4)² + F_r/16) + 0.05, w = 3 F_t/4. The baselines: the same with 2 or 1; with 3 and without the
    /// linear part; with 5.
    #[test]
    fn lifted() {
        check(&Params::of(Preset::C1).speed_law(), [2.0, 0.4], &BODY, [0.125, 0.3]);
        check(&Params::of(Preset::C1).speed_law(), [0.0, 0.4], &BODY, [0.05, 0.3]);
        check(&Params::of(Preset::C1).speed_law(), [-0.1, 0.4], &BODY, [0.0, 0.3]);
        for (variant, expected) in [
            (Variant::Lin, [0.125, 0.2]),
            (Variant::Const, [0.125, 0.1]),
            (Variant::Max4, [0.1, 0.3]),
            (Variant::Max3, [0.1, 0.3]),
            (Variant::H, [0.1, 0.5]),
        ] {
            check(&dapf::Params::of(variant).speed_law(), [2.0, 0.4], &BODY, expected);
        }
    }

    /// (i) F_r < -1 and |w| < 0.05: turn at full rate to the side of w.
    #[test]
    fn turns_where_it_stands() {
        for preset in [Preset::P, Preset::C1, Preset::H, Preset::Fleet] {
            let law = Params::of(preset).speed_law();
            check(&law, [-2.0, 0.01], &BODY, [0.0, 1.0]);
            check(&law, [-2.0, -0.01], &BODY, [0.0, -1.0]);
            check(&law, [-2.0, 0.0], &BODY, [0.0, 1.0]);
            check(&law, [-2.0, 0.0], &Body { sgn_zero: true, ..BODY }, [0.05, 0.0]);
            check(&law, [-2.0, 0.3], &BODY, [0.0, law.turn_gain * 0.075]);
            check(&law, [-0.9, 0.01], &BODY, [0.05, law.turn_gain * 0.0025]);
        }
        // 5 · 0.04 / 4 = 0.05 is turning.
        check(&Params::of(Preset::P).speed_law(), [-2.0, 0.04], &BODY, [0.0, 0.05]);
        check(&Params::of(Preset::P).speed_law(), [-2.0, 0.039], &BODY, [0.0, 1.0]);
        // The later baseline asks whether it stands, the one with a constant pull never turns so.
        check(&dapf::Params::of(Variant::H).speed_law(), [-0.5, 0.01], &BODY, [0.0, 1.0]);
        check(&dapf::Params::of(Variant::Const).speed_law(), [-2.0, 0.01], &BODY, [0.2, 0.0025]);
        check(&dapf::Params::of(Variant::Lin).speed_law(), [-2.0, 0.01], &BODY, [0.0, 1.0]);
    }

    /// (ii) v = 0 and |w| < 0.03: creep with 0.05; in `lin`, `max3` and `max4` v ≤ 0.1: with 0.1.
    #[test]
    fn creeps() {
        let p = Params::of(Preset::P).speed_law();
        check(&p, [-0.5, 0.01], &BODY, [0.05, 0.0125]);
        check(&p, [-0.5, 0.0239], &BODY, [0.05, 0.029875]);
        check(&p, [-0.5, 0.0241], &BODY, [0.0, 0.030125]);
        check(&p, [0.4, 0.01], &BODY, [0.002, 0.0125]);
        for variant in [Variant::Lin, Variant::Max3, Variant::Max4] {
            let law = dapf::Params::of(variant).speed_law();
            check(&law, [0.4, 0.01], &BODY, [0.1, law.turn_gain * 0.0025]);
            check(
                &law,
                [2.4, 0.01],
                &BODY,
                [if variant == Variant::Lin { 0.152 } else { 0.122 }, law.turn_gain * 0.0025],
            );
        }
    }

    /// Guarded: no creeping towards what is near ahead, but turning; and no turn beyond the direction of the force.
    #[test]
    fn guarded() {
        let fleet = Params::of(Preset::Fleet).speed_law();
        let blocked = Body { blocked: true, ..BODY };
        check(&fleet, [-0.5, 0.01], &BODY, [0.05, 0.0125]);
        check(&fleet, [-0.5, 0.01], &blocked, [0.0, 1.0]);
        check(&fleet, [-0.5, -0.01], &blocked, [0.0, -1.0]);
        check(&Params::of(Preset::P).speed_law(), [-0.5, 0.01], &blocked, [0.05, 0.0125]);
        // atan(0.4 / 16) / 0.1 s is less than 5 · 0.4 / 4.
        let off = 0.025f64.atan() / 0.1;
        check(&fleet, [16.0, 0.4], &BODY, [0.2, off]);
        check(&fleet, [16.0, -0.4], &BODY, [0.2, -off]);
        check(&Params::of(Preset::P).speed_law(), [16.0, 0.4], &BODY, [0.2, 0.5]);
    }

    /// A robot that is three times as fast turns three times as fast, so that it drives the same curve; another C_a is
    /// another unit of force.
    #[test]
    fn scales() {
        let law = Params::of(Preset::P).speed_law();
        check(&law, [2.0, 0.4], &Body { speed_mps_max: 0.6, ..BODY }, [0.15, 1.5]);
        check(&law, [1.0, 0.2], &Body { c_a: 2.0, ..BODY }, [0.05, 0.5]);
        check(&law, [-2.0, 0.01], &Body { speed_mps_max: 0.6, ..BODY }, [0.0, 3.0]);
    }
}
