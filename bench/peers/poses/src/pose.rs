//! What is sent: 64 bytes, the same for every transport.

/// A robot's pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Whose.
    pub robot: u32,
    /// Nothing yet; keeps the layout explicit.
    pub flags: u32,
    /// The tick at which it was due; 0 before the common start.
    pub tick: u64,
    /// When the writer handed it to the transport, monotonic clock, ns.
    pub stamp_ns: u64,
    /// Position, m.
    pub x_m: f64,
    /// Position, m.
    pub y_m: f64,
    /// Heading, rad.
    pub yaw_rad: f64,
    /// Velocity, m/s.
    pub vx_mps: f64,
    /// Velocity, m/s.
    pub vy_mps: f64,
}

impl Pose {
    /// Its size on any wire.
    pub const BYTES: usize = 64;

    /// For transports that carry bytes.
    pub fn to_bytes(&self) -> [u8; Pose::BYTES] {
        let head = u64::from(self.robot) | u64::from(self.flags) << 32;
        let floats = [self.x_m, self.y_m, self.yaw_rad, self.vx_mps, self.vy_mps].map(f64::to_bits);
        let words = [head, self.tick, self.stamp_ns].into_iter().chain(floats);
        let mut bytes = [0; Pose::BYTES];
        for (eight, word) in bytes.chunks_exact_mut(8).zip(words) {
            eight.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    /// The reverse; `None` if these are not 64 bytes.
    pub fn from_bytes(bytes: &[u8]) -> Option<Pose> {
        let bytes: &[u8; Pose::BYTES] = bytes.try_into().ok()?;
        let word = |at: usize| u64::from_le_bytes(std::array::from_fn(|byte| bytes[8 * at + byte]));
        let float = |at: usize| f64::from_bits(word(at));
        Some(Pose {
            robot: word(0) as u32,
            flags: (word(0) >> 32) as u32,
            tick: word(1),
            stamp_ns: word(2),
            x_m: float(3),
            y_m: float(4),
            yaw_rad: float(5),
            vx_mps: float(6),
            vy_mps: float(7),
        })
    }

    /// The trivial step: turns towards the middle of the others and drives on, at 0.5 m/s.
    pub fn step(&mut self, others: &[Option<Pose>], dt_s: f64) {
        let (mut x_m, mut y_m, mut count) = (0.0, 0.0, 0.0);
        for other in others.iter().flatten() {
            (x_m, y_m, count) = (x_m + other.x_m, y_m + other.y_m, count + 1.0);
        }
        let bearing_rad = (y_m - count * self.y_m).atan2(x_m - count * self.x_m);
        self.yaw_rad += dt_s * (bearing_rad - self.yaw_rad).sin();
        (self.vx_mps, self.vy_mps) = (0.5 * self.yaw_rad.cos(), 0.5 * self.yaw_rad.sin());
        self.x_m += dt_s * self.vx_mps;
        self.y_m += dt_s * self.vy_mps;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_comes_back_from_its_bytes() {
        let pose = Pose {
            robot: 7,
            flags: 1,
            tick: 1 << 40,
            stamp_ns: u64::MAX,
            x_m: -1.5,
            y_m: 2.0,
            yaw_rad: 0.1,
            vx_mps: 3.0,
            vy_mps: -4.0,
        };
        assert_eq!(Pose::from_bytes(&pose.to_bytes()), Some(pose));
        assert_eq!(Pose::from_bytes(&[0; 63]), None);
        assert_eq!(Pose::from_bytes(&[0; 65]), None);
    }

    #[test]
    fn a_step_moves_by_speed_and_time() {
        let mut pose = Pose::default();
        pose.step(&[Some(Pose { x_m: 1.0, ..Pose::default() }), None], 0.02);
        assert!((pose.x_m - 0.01).abs() < 1e-12 && pose.y_m == 0.0, "{pose:?}");
    }
}
