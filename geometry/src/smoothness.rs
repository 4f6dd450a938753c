//! Smoothness of a drive: log dimensionless jerk, in one pass and without a memory of the drive.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Velocities are resampled at this rate, so that runs with different ticks compare.
const SAMPLE_HZ: f64 = 20.0;

/// The sums behind -ln(T³ / v_peak² ∫ |jerk|² dt), where jerk is the second difference of the velocity.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Smoothness {
    ticks: u64,
    /// Velocity at the last tick, m/s.
    velocity: Vector2<f64>,
    /// Samples taken so far; sample n is that of the time n / SAMPLE_HZ.
    samples: u64,
    last: Vector2<f64>,
    last_but_one: Vector2<f64>,
    /// ∫ |jerk|² dt, m²/s⁵.
    jerk: f64,
    /// m²/s².
    speed_squared_max: f64,
}

impl Smoothness {
    /// One more tick of `dt_s`, which ended at this velocity (m/s). The drive begins at rest.
    pub fn push(&mut self, velocity: Vector2<f64>, dt_s: f64) {
        let begin_s = self.ticks as f64 * dt_s;
        self.ticks += 1;
        let end_s = self.ticks as f64 * dt_s;
        loop {
            let at_s = self.samples as f64 / SAMPLE_HZ;
            // A hair of tolerance: a sample at a tick belongs to it whichever way its time was rounded.
            if at_s > end_s + 1e-9 {
                break;
            }
            let share = ((at_s - begin_s) / dt_s).clamp(0.0, 1.0);
            self.sample(self.velocity + (velocity - self.velocity) * share);
        }
        self.velocity = velocity;
    }

    fn sample(&mut self, velocity: Vector2<f64>) {
        if self.samples >= 2 {
            let jerk = (velocity - self.last * 2.0 + self.last_but_one) * (SAMPLE_HZ * SAMPLE_HZ);
            self.jerk += jerk.norm_squared() / SAMPLE_HZ;
        }
        self.speed_squared_max = self.speed_squared_max.max(velocity.norm_squared());
        (self.last_but_one, self.last) = (self.last, velocity);
        self.samples += 1;
    }

    /// LDJ over the ticks so far; 0 is best. `None` for a drive that never moved or was too short to tell.
    pub fn ldj(&self, dt_s: f64) -> Option<f64> {
        let time_s = self.ticks as f64 * dt_s;
        let ldj = -(time_s.powi(3) / self.speed_squared_max * self.jerk).ln();
        ldj.is_finite().then_some(ldj)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A half wave of speed: jerk is V (π/T)² sin(π t / T), so that T³/V² ∫ jerk² dt = π⁴/2 whatever T and V are.
    #[test]
    fn a_half_wave_has_its_analytic_jerk_whatever_the_tick() {
        for (hz, duration_s) in [(100.0, 10.0), (30.0, 10.0), (10.0, 20.0), (1000.0, 5.0)] {
            let mut smoothness = Smoothness::default();
            let direction = Vector2::new(0.6, -0.8);
            for tick in 1..=(hz * duration_s) as u32 {
                smoothness.push(direction * (PI * f64::from(tick) / hz / duration_s).sin() * 1.3, 1.0 / hz);
            }
            let expected = -(PI.powi(4) / 2.0).ln();
            let ldj = smoothness.ldj(1.0 / hz).unwrap();
            // Interpolated samples of a slow tick have kinks, hence the margin.
            assert!((ldj - expected).abs() < if hz < 100.0 { 1.2 } else { 0.01 }, "{hz} Hz: {ldj}, not {expected}");
        }
    }

    #[test]
    fn a_rest_has_no_smoothness() {
        let mut smoothness = Smoothness::default();
        assert_eq!(smoothness.ldj(0.02), None);
        (0..500).for_each(|_| smoothness.push(Vector2::zeros(), 0.02));
        assert_eq!(smoothness.ldj(0.02), None);
    }

    #[test]
    fn a_jerky_drive_is_worse() {
        let drive = |wobble: f64| {
            let mut smoothness = Smoothness::default();
            for tick in 1..=500 {
                let t = f64::from(tick) * 0.02;
                smoothness.push(Vector2::new((PI * t / 10.0).sin(), wobble * (9.0 * t).sin()), 0.02);
            }
            smoothness.ldj(0.02).unwrap()
        };
        assert!(drive(0.0) > drive(0.05) && drive(0.05) > drive(0.2));
    }
}
