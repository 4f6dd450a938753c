//! What a robot heads for: along a shortest way where it knows what stands, else straight to its goal.
//!
//! Past obstacles of the scenario it is found in a graph of tangents ([`way`](crate::way)), which is exact and takes in every
//! obstacle. A map has too many walls for that: there a search over cells finds it (module `course`), a bounded number of steps per
//! tick.

mod course;

use crate::planner::{FIRST_WALL, Obstacle, PlanInput};
use crate::way::{Ahead, Sketch, Way};
use course::Course;
use geometry::route::Ground;
use geometry::{Capsule, Map};

/// What to do about the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heading {
    /// To head for this.
    To(Ahead),
    /// To wait: a way is being searched for.
    Searching,
    /// There is no way.
    Nowhere,
}

/// Ways of one robot.
#[derive(Default)]
pub struct Guide {
    /// What an obstacle costs that a way on the known map has on its right, in radii of the robot.
    toll: f64,
    way: Option<Way>,
    /// What it has seen, if it has no map.
    sketch: Sketch,
    /// Walls among that, in an index.
    seen: Seen,
    course: Option<Course>,
    /// The obstacles of a scenario that has a map, in an index.
    standing: Option<Map>,
}

impl Guide {
    /// Ways that have obstacles on their left if that is no longer than this, in radii of the robot, for each obstacle.
    pub fn keeping_right(toll: f64) -> Guide {
        Guide { toll, ..Guide::default() }
    }

    /// What to head for of a robot that heads straight for its goal where it does not know what stands.
    pub fn follow(&mut self, input: &PlanInput<'_>) -> Heading {
        let Some(walls) = input.walls else {
            return Way::follow(&mut self.way, input, self.toll * input.radius_m).map_or(Heading::Nowhere, Heading::To);
        };
        if self.standing.is_none() {
            let obstacles = input.map.iter().filter(|piece| !piece.is_wall());
            self.standing = index(obstacles.map(|obstacle| obstacle.shape));
        }
        let standing = self.standing.as_ref().filter(|map| !map.is_empty());
        let course = &mut self.course;
        on([Some(walls), standing], |ground| Course::follow(course, ground, input))
    }

    /// The same of one that remembers what it has seen, if it does not know what stands.
    pub fn explore(&mut self, input: &PlanInput<'_>) -> Heading {
        if input.walls.is_some() || !input.map.is_empty() {
            return self.follow(input);
        }
        let news = self.sketch.look(input);
        // They come last.
        if !self.sketch.pieces().last().is_some_and(Obstacle::is_wall) {
            return Heading::To(Way::past(&mut self.way, &mut self.sketch, news, input));
        }
        if news {
            self.seen.take(&self.sketch);
            let is_closed = |course: &Course| on(self.seen.ground(), |ground| !course.is_open(ground));
            if self.course.as_ref().is_some_and(is_closed) {
                self.course = None;
            }
        }
        let course = &mut self.course;
        match on(self.seen.ground(), |ground| Course::follow(course, ground, input)) {
            Heading::Nowhere => {
                (self.course, self.seen, self.sketch) = (None, Seen::default(), Sketch::default());
                let left_m = nalgebra::distance(&input.position, &input.goal);
                Heading::To(Ahead { at: input.goal, is_goal: true, left_m })
            }
            heading => heading,
        }
    }
}

/// What stands, in two indices: most of it, and what is new, so that little has to be sorted again.
#[derive(Default)]
struct Seen {
    maps: [Option<Map>; 2],
    /// How many pieces are in the first.
    settled: usize,
    /// Which pieces those are, sorted by id and place in the sketch.
    known: Vec<(u32, Capsule)>,
}

impl Seen {
    /// As many pieces are sorted in alone.
    const NEW_MAX: usize = 128;

    fn take(&mut self, sketch: &Sketch) {
        let pieces = sketch.pieces();
        let is_known = |piece: &&Obstacle| {
            let from = self.known.partition_point(|(id, _)| *id < piece.id);
            self.known[from..].iter().take_while(|(id, _)| *id == piece.id).any(|(_, shape)| *shape == piece.shape)
        };
        let new: Vec<&Obstacle> = pieces.iter().filter(|piece| !is_known(piece)).collect();
        // What has been taken out of the sketch is not a wall, and walls are nearly all there is: then all is sorted again.
        let lost = pieces.len() - new.len() < self.known.len();
        if lost || new.len() > Seen::NEW_MAX.max(self.settled / 8) {
            self.known = pieces.iter().map(|piece| (piece.id, piece.shape)).collect();
            self.settled = pieces.len();
            self.maps = [index(pieces.iter().map(|piece| piece.shape)), None];
        } else {
            self.maps[1] = index(new.iter().map(|piece| piece.shape));
        }
    }

    fn ground(&self) -> [Option<&Map>; 2] {
        self.maps.each_ref().map(Option::as_ref)
    }
}

/// Does something on the ground that these maps are.
fn on<R>(maps: [Option<&Map>; 2], act: impl FnOnce(Ground<'_>) -> R) -> R {
    match maps {
        [Some(one), Some(other)] => act(&[one, other]),
        [Some(one), None] | [None, Some(one)] => act(&[one]),
        [None, None] => act(&[]),
    }
}

/// These shapes in an index; none where they are too many or too far away, which no scenario has.
fn index(shapes: impl Iterator<Item = Capsule>) -> Option<Map> {
    Map::build(&shapes.collect::<Vec<_>>(), false, None).ok()
}

const _: () = assert!(FIRST_WALL as usize > model::MAX_SHAPES + model::MAX_ROBOTS, "ids of walls are their own");
