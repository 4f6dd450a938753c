//! Bodies of one tick as few bytes, lossless: the field `bodies` of the messages of `shoal.frame`.
//!
//! ```text
//! bodies (varint)  then per body:
//!     name (varint: 2 slot for a robot, 2 index + 1 for a moving obstacle)  mask (u8)
//!     flags (u8), if bit 0 of the mask is set
//!     x, y, yaw, goal x, goal y, joint 1, joint 2 for bits 1 to 7, each as a varint: bits of the value xor bits of its
//!     prediction, which is 2 a - b for the last two values a, b of the body (a for goals; 0 before there are any)
//! ```
//! Varints have seven bits a byte, the lowest first. What stands still costs two bytes a tick, what drives a curve about
//! fifteen. Predictions begin again with every frame that is a key frame, and every chunk of a record begins with one.

use crate::wire::{put_varint, take_byte, take_varint};
use model::{MAX_ROBOTS, MAX_SHAPES};
use protocol::world_to_observer::FrameBody;

/// Numbers of a body: see the format.
const FIELDS: usize = 7;

/// A body at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Slot of the robot, or index of the obstacle in the scenario.
    pub index: u32,
    /// The `FLAG_*` constants of [`FrameBody`].
    pub flags: u32,
    /// Position, m (of an arm: its tip; of an obstacle: the point that its motion carries).
    pub position_m: [f64; 2],
    /// Heading, rad.
    pub yaw_rad: f64,
    /// Where a robot's goal is, m; zero for an obstacle.
    pub goal_m: [f64; 2],
    /// Joint angles of an arm, rad; zero for everything else.
    pub joints_rad: [f64; 2],
}

impl Body {
    /// It is an obstacle, not a robot.
    pub fn is_obstacle(&self) -> bool {
        self.flags & FrameBody::FLAG_OBSTACLE != 0
    }

    fn name(&self) -> u64 {
        2 * u64::from(self.index) + u64::from(self.is_obstacle())
    }

    fn fields(&self) -> [f64; FIELDS] {
        let Body { position_m: [x, y], yaw_rad, goal_m: [goal_x, goal_y], joints_rad: [first, second], .. } = *self;
        [x, y, yaw_rad, goal_x, goal_y, first, second]
    }

    fn with_fields(self, [x, y, yaw_rad, goal_x, goal_y, first, second]: [f64; FIELDS]) -> Body {
        Body { position_m: [x, y], yaw_rad, goal_m: [goal_x, goal_y], joints_rad: [first, second], ..self }
    }
}

/// The last two states of a body, which predict its next one.
#[derive(Clone, Copy, Debug, Default)]
struct Track {
    flags: u32,
    last: [f64; FIELDS],
    before: [f64; FIELDS],
    known: u8,
}

impl Track {
    fn predicted(&self) -> [f64; FIELDS] {
        let Track { last, before, known, .. } = self;
        std::array::from_fn(|i| match (known, i) {
            (0 | 1, _) | (_, 3 | 4) => last[i],
            _ => 2.0 * last[i] - before[i],
        })
    }

    fn follow(&mut self, flags: u32, fields: [f64; FIELDS]) {
        *self = Track { flags, before: self.last, last: fields, known: (self.known + 1).min(2) };
    }
}

/// The tracks of all bodies, by name: even ones are robots, odd ones obstacles. Both ends of a record keep the same.
#[derive(Debug, Default)]
pub(crate) struct Tracks(Vec<Track>);

impl Tracks {
    /// Predictions begin again: the next frame is a key frame.
    pub(crate) fn restart(&mut self) {
        self.0.clear();
    }

    fn of(&mut self, name: u64) -> &mut Track {
        let name = name as usize;
        if self.0.len() <= name {
            self.0.resize(name + 1, Track::default());
        }
        &mut self.0[name]
    }

    /// Appends the bodies of a tick to `out`.
    pub(crate) fn encode(&mut self, bodies: &[Body], out: &mut Vec<u8>) {
        put_varint(bodies.len() as u64, out);
        for body in bodies {
            let track = self.of(body.name());
            let (fields, predicted) = (body.fields(), track.predicted());
            let unforeseen: [u64; FIELDS] = std::array::from_fn(|i| fields[i].to_bits() ^ predicted[i].to_bits());
            let told = (body.flags != track.flags) as u8;
            let mask = (0..FIELDS).fold(told, |mask, i| mask | (u8::from(unforeseen[i] != 0) << (i + 1)));
            put_varint(body.name(), out);
            out.push(mask);
            if told != 0 {
                out.push(body.flags as u8);
            }
            unforeseen.iter().filter(|bits| **bits != 0).for_each(|bits| put_varint(*bits, out));
            track.follow(body.flags, fields);
        }
    }

    /// Reads the bodies of a tick into `bodies`; `None` for bytes that no run writes.
    pub(crate) fn decode(&mut self, mut bytes: &[u8], bodies: &mut Vec<Body>) -> Option<()> {
        bodies.clear();
        for _ in 0..take_varint(&mut bytes).filter(|count| *count <= (MAX_ROBOTS + MAX_SHAPES) as u64)? {
            let name = take_varint(&mut bytes).filter(|name| *name < 2 * MAX_ROBOTS.max(MAX_SHAPES) as u64)?;
            let mask = take_byte(&mut bytes)?;
            let track = *self.of(name);
            let flags = if mask & 1 != 0 { take_byte(&mut bytes)?.into() } else { track.flags };
            let mut fields = track.predicted();
            for (i, field) in fields.iter_mut().enumerate() {
                if mask >> (i + 1) & 1 != 0 {
                    *field = f64::from_bits(field.to_bits() ^ take_varint(&mut bytes)?);
                }
            }
            let body = Body { index: (name / 2) as u32, flags, ..Body::default() }.with_fields(fields);
            if !fields.iter().all(|field| field.is_finite()) || body.name() != name {
                return None;
            }
            self.of(name).follow(flags, fields);
            bodies.push(body);
        }
        bytes.is_empty().then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Robots that come, drive, stand, and stop being there; numbers of all sizes.
    fn frame(tick: u64) -> Vec<Body> {
        let t = tick as f64 * 0.02;
        let curve =
            Body { index: 0, position_m: [t.sin(), t.cos()], yaw_rad: t, goal_m: [4.0, -1.0], ..Body::default() };
        let stands = Body { index: 3, flags: 2, position_m: [-7.1, 1e-300], ..Body::default() };
        let odd = Body { index: 700, joints_rad: [f64::MAX, -t], yaw_rad: -0.0, ..Body::default() };
        let moves = Body { index: 3, flags: 1, position_m: [0.1 * t, 0.0], ..Body::default() };
        let mut bodies = vec![curve];
        bodies.extend((10..40).contains(&tick).then_some(stands));
        bodies.extend((!tick.is_multiple_of(7)).then_some(odd));
        bodies.push(moves);
        bodies
    }

    #[test]
    fn what_is_written_is_read_to_the_last_bit_also_after_a_restart() {
        let (mut writer, mut reader, mut bodies) = (Tracks::default(), Tracks::default(), Vec::new());
        for tick in 0..=50 {
            if tick % 20 == 0 {
                writer.restart();
                // A reader may begin here.
                reader = Tracks::default();
            }
            let mut bytes = Vec::new();
            writer.encode(&frame(tick), &mut bytes);
            assert_eq!(reader.decode(&bytes, &mut bodies), Some(()), "tick {tick}");
            let bits = |body: &Body| (body.index, body.flags, body.fields().map(f64::to_bits));
            assert!(bodies.iter().map(bits).eq(frame(tick).iter().map(bits)), "tick {tick}");
            assert_eq!(reader.decode(&bytes[..bytes.len() - 1], &mut bodies), None);
            reader = Tracks::default();
            writer.restart();
        }
    }

    #[test]
    fn what_stands_costs_two_bytes_a_tick() {
        let (mut tracks, stands) = (Tracks::default(), Body { position_m: [1.2345, -0.1], ..Body::default() });
        for tick in 0..100 {
            let mut bytes = Vec::new();
            tracks.encode(&[stands], &mut bytes);
            assert!(tick < 2 || bytes.len() == 1 + 2, "tick {tick}: {bytes:?}");
        }
    }
}
