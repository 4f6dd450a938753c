//! Which pose of each neighbour counts in this tick.
//!
//! The rule for ticks: at tick k a robot uses each neighbour's newest pose of a tick before k. That rule does not
//! care who ran first within a tick, and so `single` and `lockstep` agree to the last bit. In `realtime` there
//! is no common tick and the newest pose counts.
//!
//! Faults act here, on reception: a pose may be lost, may be late, and may be wrong by some noise. A pose once
//! received stays in use until a newer one is received.

use model::random::Stream;
use model::{Radio, RobotInstance};
use nalgebra::{Point2, Vector2};
use planners::filter::border::{Rule, Word};
use planners::filter::{Promise, Told};
use planners::{Intent, Neighbor};
use protocol::robot_to_robot::{SharedBorder, SharedPose};
use protocol::world_to_robot::NeighborRef;

/// How old a pose is, and which pose is the newest: by ticks, or by the stamps of the monotonic clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Time {
    /// Deterministic modes: poses of earlier ticks count, and age is a number of ticks.
    Ticks,
    /// `realtime`: the newest pose counts, and age is measured.
    Stamps {
        /// The monotonic clock now, ns.
        now_ns: u64,
    },
}

/// One neighbour as this robot has heard it so far.
struct Track {
    who: NeighborRef,
    /// The pose in use.
    current: Option<SharedPose>,
    /// What came with it about the border to this robot.
    border: SharedBorder,
    /// Tick of the newest pose taken off the neighbour's board.
    taken: Option<u64>,
    /// Poses on their way, with the tick from which on they are heard.
    in_flight: Vec<(u64, SharedPose, SharedBorder)>,
}

impl Track {
    /// Hears what is due. A delay that shrank lets a newer pose overtake; the newer one stays.
    fn land(&mut self, tick: u64) {
        let (current, held_border) = (&mut self.current, &mut self.border);
        self.in_flight.retain(|(due, pose, border)| {
            if *due > tick {
                return true;
            }
            if current.is_none_or(|held| pose.tick > held.tick) {
                (*current, *held_border) = (Some(*pose), *border);
            }
            false
        });
    }
}

/// A robot in sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenRobot {
    /// Its slot.
    pub index: u32,
    /// Where it is, m.
    pub at: Point2<f64>,
    /// m/s.
    pub velocity: Vector2<f64>,
    /// m.
    pub radius_m: f64,
}

/// The receiver of one robot.
pub struct Receiver {
    tracks: Vec<Track>,
    losses: Stream,
    errors: Stream,
}

impl Receiver {
    /// A receiver that has not heard any robot.
    pub fn new(seed: u64, instance: RobotInstance) -> Receiver {
        let stream = |purpose| Stream::new(seed, instance.index.0, instance.incarnation, purpose);
        Receiver { tracks: Vec::new(), losses: stream("radio-loss"), errors: stream("radio-noise") }
    }

    /// Takes in what the boards of the robots in range tell at this tick. `heard` is sorted by slot; a robot that is not
    /// in it is out of range and forgotten. What each says about borders stands in `borders`, in the same order; it is empty in fleets
    /// without borders. `radio` is what the radio is like at this tick.
    pub fn receive(
        &mut self,
        tick: u64,
        time: Time,
        radio: Radio,
        heard: &[(NeighborRef, SharedPose)],
        borders: &[SharedBorder],
    ) {
        self.follow(heard);
        for (place, (track, (_, pose))) in self.tracks.iter_mut().zip(heard).enumerate() {
            let border = borders.get(place).copied().unwrap_or_default();
            let counts = pose.has(SharedPose::FLAG_SPOKEN) && (time != Time::Ticks || pose.tick < tick);
            if counts && track.taken.is_none_or(|taken| pose.tick > taken) {
                track.taken = Some(pose.tick);
                if radio.drop <= 0.0 || self.losses.unit() >= radio.drop {
                    let mut pose = *pose;
                    if radio.noise_m > 0.0 {
                        let [x_m, y_m] = [(); 2].map(|()| radio.noise_m * self.errors.normal());
                        for x in [&mut pose.x_m, &mut pose.next_x_m, &mut pose.far_x_m] {
                            *x += x_m;
                        }
                        for y in [&mut pose.y_m, &mut pose.next_y_m, &mut pose.far_y_m] {
                            *y += y_m;
                        }
                    }
                    if radio.delay_ticks == 0 {
                        (track.current, track.border) = (Some(pose), border);
                    } else {
                        track.in_flight.push((tick + u64::from(radio.delay_ticks), pose, border));
                    }
                }
            }
            track.land(tick);
        }
    }

    /// The poses in use, as the planner sees them, sorted by slot.
    pub fn neighbors(&self, tick: u64, dt_s: f64, time: Time) -> impl Iterator<Item = Neighbor> + '_ {
        self.in_use().map(move |(who, pose)| {
            let age_s = match time {
                Time::Ticks => tick.saturating_sub(pose.tick) as f64 * dt_s,
                Time::Stamps { now_ns } => now_ns.saturating_sub(pose.stamp_ns) as f64 * 1e-9,
            };
            Neighbor {
                id: who.index,
                position: Point2::new(pose.x_m, pose.y_m),
                yaw_rad: pose.yaw_rad,
                velocity: Vector2::new(pose.vx_mps, pose.vy_mps),
                radius_m: pose.radius_m,
                age_s,
                remaining_m: pose.remaining_m,
                arrived: pose.has(SharedPose::FLAG_ARRIVED),
                stopped: pose.has(SharedPose::FLAG_STOPPED),
                next: pose.has(SharedPose::FLAG_NEXT).then(|| Point2::new(pose.next_x_m, pose.next_y_m)),
                intent: intent(pose),
            }
        })
    }

    /// What the filter is told of all robots in range, sorted by slot. `seen` are the robots in sight, sorted by slot. The speed
    /// of a robot that is seen and has not been heard yet is taken to be `speed_mps_max`.
    pub fn told<'a>(&'a self, tick: u64, seen: &'a [SeenRobot], speed_mps_max: f64) -> impl Iterator<Item = Told> + 'a {
        self.tracks.iter().filter_map(move |track| {
            let place = seen.binary_search_by_key(&track.who.index, |robot| robot.index);
            let seen = place.ok().map(|place| seen[place]);
            let Some(pose) = &track.current else {
                let SeenRobot { at, velocity, radius_m, .. } = seen?;
                return Some(Told {
                    robot: track.who.index,
                    incarnation: track.who.incarnation,
                    is_heard: false,
                    tick,
                    at,
                    next: None,
                    seen: Some(at),
                    velocity,
                    radius_m,
                    speed_mps_max: speed_mps_max.max(velocity.norm()),
                    brake_m: 0.0,
                    promise: None,
                    word: None,
                });
            };
            Some(Told {
                robot: track.who.index,
                incarnation: track.who.incarnation,
                is_heard: true,
                tick: pose.tick,
                at: Point2::new(pose.x_m, pose.y_m),
                next: pose.has(SharedPose::FLAG_NEXT).then(|| Point2::new(pose.next_x_m, pose.next_y_m)),
                seen: seen.map(|robot| robot.at),
                velocity: seen.map_or(Vector2::new(pose.vx_mps, pose.vy_mps), |robot| robot.velocity),
                radius_m: pose.radius_m,
                speed_mps_max: f64::from(pose.speed_mps_max),
                brake_m: f64::from(pose.brake_m),
                promise: pose
                    .has(SharedPose::FLAG_PROMISE)
                    .then(|| Promise { far: Point2::new(pose.far_x_m, pose.far_y_m), spare_m: pose.spare_m }),
                word: word(&track.border),
            })
        })
    }

    /// The poses in use, sorted by slot.
    pub fn in_use(&self) -> impl Iterator<Item = (NeighborRef, &SharedPose)> + '_ {
        self.tracks.iter().filter_map(|track| track.current.as_ref().map(|pose| (track.who, pose)))
    }

    /// Makes the tracks those of `heard`, keeping what is known of those who stay. Both are sorted by slot.
    fn follow(&mut self, heard: &[(NeighborRef, SharedPose)]) {
        let same = self.tracks.len() == heard.len()
            && self.tracks.iter().zip(heard).all(|(track, (who, _))| track.who == *who);
        if same {
            return;
        }
        let mut old = std::mem::take(&mut self.tracks).into_iter().peekable();
        for (who, _) in heard {
            while old.next_if(|track| track.who.index < who.index).is_some() {}
            let kept = old.next_if(|track| track.who == *who);
            self.tracks.push(kept.unwrap_or_else(|| Track {
                who: *who,
                current: None,
                border: SharedBorder::default(),
                taken: None,
                in_flight: Vec::new(),
            }));
        }
    }
}

/// What a robot said about its border to this one.
fn word(border: &SharedBorder) -> Option<Word> {
    let number = border.number;
    match border.form {
        SharedBorder::FORM_LINE => {
            let normal = Vector2::new(border.normal_x, border.normal_y);
            Some(Word::Offer { number, rule: Rule::Line { normal, offset_m: border.offset_m } })
        }
        SharedBorder::FORM_APART => Some(Word::Offer { number, rule: Rule::Apart }),
        SharedBorder::FORM_ACCEPTED => {
            Some(Word::Accept { number, heard: number.saturating_add(border.heard_after.into()) })
        }
        _ => None,
    }
}

/// What a robot said that it intends.
fn intent(pose: &SharedPose) -> Option<Intent> {
    let told = pose.intent;
    pose.has(SharedPose::FLAG_INTENT).then(|| Intent {
        wish: Vector2::new(told.wish_x_mps, told.wish_y_mps),
        left_m: told.left_m,
        rank: told.rank,
        corner: pose.has(SharedPose::FLAG_CORNER).then(|| Point2::new(told.corner_x_m, told.corner_y_m)),
        slow: told.slow,
        lag: told.lag,
        yields: pose.has(SharedPose::FLAG_YIELDS),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::RobotIndex;
    use protocol::robot_to_robot::PosePair;

    fn pose(tick: u64, x_m: f64) -> SharedPose {
        SharedPose { tick, x_m, flags: SharedPose::FLAG_SPOKEN, ..SharedPose::default() }
    }

    /// What the board of a robot holds that has spoken at this tick and at the one before.
    fn pair_at(tick: u64) -> PosePair {
        let mut pair = PosePair::default();
        for t in tick.saturating_sub(1)..=tick {
            pair.push(pose(t, t as f64));
        }
        pair
    }

    const ONE: NeighborRef = NeighborRef { index: 1, incarnation: 0 };

    /// Ages of the pose in use, in ticks, at each of `ticks`, when the neighbour has or has not yet spoken this tick.
    fn ages(schedule: Vec<(u64, Radio)>, ticks: std::ops::Range<u64>, ahead: bool) -> Vec<Option<u64>> {
        let mut receiver = Receiver::new(7, RobotInstance { index: RobotIndex(0), incarnation: 0 });
        let radio_at = |tick: u64| {
            schedule.iter().rev().find(|(from, _)| *from <= tick).map_or(Radio::PERFECT, |(_, radio)| *radio)
        };
        ticks
            .map(|tick| {
                let spoken = if ahead { tick } else { tick - 1 };
                let counts = *pair_at(spoken).before(tick).expect("of two poses one is of an earlier tick");
                receiver.receive(tick, Time::Ticks, radio_at(tick), &[(ONE, counts)], &[]);
                receiver.in_use().next().map(|(_, pose)| tick - pose.tick)
            })
            .collect()
    }

    #[test]
    fn it_does_not_matter_who_ran_first() {
        assert_eq!(ages(vec![], 1..6, true), ages(vec![], 1..6, false));
        assert_eq!(ages(vec![], 1..4, true), vec![Some(1); 3]);
    }

    #[test]
    fn a_pose_of_this_tick_is_not_heard_yet() {
        let mut receiver = Receiver::new(7, RobotInstance { index: RobotIndex(0), incarnation: 0 });
        receiver.receive(4, Time::Ticks, Radio::PERFECT, &[(ONE, pose(4, 0.0))], &[]);
        assert_eq!(receiver.in_use().count(), 0);
    }

    #[test]
    fn a_delay_adds_its_ticks_and_starts_with_what_was_heard_before() {
        let delayed = Radio { delay_ticks: 3, ..Radio::PERFECT };
        assert_eq!(ages(vec![(0, delayed)], 1..7, true), [None, None, None, Some(4), Some(4), Some(4)]);
        let switched = vec![(0, Radio::PERFECT), (3, delayed), (8, Radio::PERFECT)];
        let expected = [1, 1, 2, 3, 4, 4, 4, 1, 1, 1, 1, 1].map(Some);
        assert_eq!(ages(switched, 1..13, true), expected);
    }

    #[test]
    fn losses_come_at_their_rate_and_are_the_same_again() {
        let lossy = vec![(0, Radio { drop: 0.3, ..Radio::PERFECT })];
        let first = ages(lossy.clone(), 1..4001, true);
        let fresh = first.iter().filter(|age| **age == Some(1)).count();
        assert!((2700..2900).contains(&fresh), "{fresh} of 4000 poses got through, expected about 2800");
        assert_eq!(first, ages(lossy, 1..4001, true));
    }

    #[test]
    fn whoever_goes_out_of_range_is_forgotten_and_a_new_life_starts_afresh() {
        let mut receiver = Receiver::new(7, RobotInstance { index: RobotIndex(0), incarnation: 0 });
        let two = NeighborRef { index: 2, incarnation: 0 };
        receiver.receive(5, Time::Ticks, Radio::PERFECT, &[(ONE, pose(4, 0.0)), (two, pose(4, 0.0))], &[]);
        assert_eq!(receiver.in_use().count(), 2);
        receiver.receive(6, Time::Ticks, Radio::PERFECT, &[(two, pose(5, 0.0))], &[]);
        assert_eq!(receiver.in_use().map(|(who, _)| who.index).collect::<Vec<_>>(), [2]);
        let again = NeighborRef { index: 2, incarnation: 1 };
        receiver.receive(7, Time::Ticks, Radio::PERFECT, &[(again, SharedPose::default())], &[]);
        assert_eq!(receiver.in_use().count(), 0);
    }
}
