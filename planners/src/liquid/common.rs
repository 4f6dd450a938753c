//! The parameters that both methods have.

use super::field::Law;
use super::layer::Layer;

crate::params! {
    /// Parameters of the potential and of keeping clear of what moves.
    pub struct Common {
        /// Length of a step. Larger: coarser paths, less thinking. Limits the speed of `liquid-online` to one step a tick;
        /// its default follows the speed limit: it is at least what the body drives in a tick.
        step_m: f64 = 0.1, "m", 0.001..=1e6;
        /// Number of directions A_nsd. Larger: smoother paths, more thinking.
        directions: u32 = 16, "", 3..=360;
        /// Obstacle gain K_O. Larger: wider around obstacles.
        k_o: f64 = 1.0, "m²", 0.0..=1e6;
        /// Goal gain K_t. Larger: closer to obstacles.
        k_t: f64 = 35.0, "1/m", 0.0..=1e6;
        /// Gain of virtual obstacles K_v. Larger: fewer of them, longer ways.
        k_v: f64 = 60.0, "m²", 0.0..=1e6;
        /// Radius of virtual obstacles V_r, without the robot's. Larger: blunter.
        v_r_m: f64 = 0.0, "m", 0.0..=1e6;
        /// Greatest radius of virtual obstacles with the robot's, in steps; 0: no limit, as in the paper.
        v_r_cap_steps: f64 = 0.5, "steps", 0.0..=100.0;
        /// The descent ends within this number of steps of the goal. Larger: farther from it.
        tolerance_steps: f64 = 1.0, "steps", 0.0..=1000.0;
        /// Never step over a body that is thinner than a step. Not in the paper.
        no_jumping: bool = true, "";
        /// Turn rate of a unicycle per radian of heading error. Larger: turns sharper.
        heading_gain: f64 = 3.0, "1/s", 0.0..=100.0;
        /// Keep clear of other robots and of what moves. Not in the paper.
        neighbors: bool = true, "";
        /// Gain of those pushes. Larger: wider around what moves.
        evade_gain: f64 = 0.1, "m⁴/s", 0.0..=100.0;
        /// Reach of those pushes, from surface to surface. Larger: evades sooner.
        evade_range_m: f64 = 1.0, "m", 0.01..=100.0;
    }
}

impl Common {
    /// The numbers of the potential.
    pub(super) fn law(&self) -> Law {
        let Common { step_m, k_o, k_t, k_v, v_r_m, v_r_cap_steps, tolerance_steps, no_jumping, .. } = *self;
        let directions = Law::directions(self.directions);
        Law { step_m, directions, k_o, k_t, k_v, v_r_m, v_r_cap_steps, tolerance_steps, no_jumping }
    }

    /// What keeps this robot clear.
    pub(super) fn layer(&self, robot: u32) -> Layer {
        let Common { neighbors: on, evade_gain: gain, evade_range_m: range_m, heading_gain, .. } = *self;
        Layer { on, gain, range_m, heading_gain, robot }
    }
}
