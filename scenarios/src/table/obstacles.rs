//! Keys of obstacles, and of what moves.

use crate::types::Interval;
use model::field::Table;
use model::kind::{LARGE, Range, Section};
use model::{AtEnd, MAX_SHAPES, choice, keys};
use nalgebra::Point2;

pub(super) static OBSTACLE: Section = Section {
    title: "[[obstacle]]",
    help: "An obstacle, fixed or moving.",
    tag: Some("shape"),
    groups: &[Obstacle::KEYS],
};

choice! {
    /// The shape of an obstacle.
    pub(crate) enum ObstacleShape {
        Disc = "disc",
        Segment = "segment",
        Capsule = "capsule",
        Polygon = "polygon",
    }
}

keys! {
    /// Keys of `[[obstacle]]`.
    pub(crate) keys Obstacle {
        /// Shape of the obstacle.
        shape: ObstacleShape => required, "";
        /// Centre.
        #[only(ObstacleShape::Disc)]
        center_m: Point2<f64> => required, "m";
        /// One end.
        #[only(ObstacleShape::Segment, ObstacleShape::Capsule)]
        from_m: Point2<f64> => required, "m";
        /// The other end.
        #[only(ObstacleShape::Segment, ObstacleShape::Capsule)]
        to_m: Point2<f64> => required, "m";
        /// Radius of a disc, half the thickness of a capsule.
        #[only(ObstacleShape::Disc, ObstacleShape::Capsule)]
        radius_m: f64 => required, "m", Range::POSITIVE;
        /// Corners in order; the inside is solid.
        #[only(ObstacleShape::Polygon)]
        corners_m: Vec<Point2<f64>> => required, "m", 3..=MAX_SHAPES;
        /// Motion of the obstacle.
        motion: Table => optional, "", &MOTION;
    }
}

pub(super) static MOTION: Section = Section {
    title: "motion",
    help: "Motion as a function of time. The body is placed at the start of its motion.",
    tag: Some("kind"),
    groups: &[Motion::KEYS],
};

choice! {
    /// The kind of a motion.
    pub(crate) enum MotionKind {
        Orbit = "orbit",
        Bounce = "bounce",
        RandomWalk = "random-walk",
        Waypoints = "waypoints",
    }
}

keys! {
    /// Keys of a motion.
    pub(crate) keys Motion {
        /// Kind of motion.
        kind: MotionKind => required, "";
        /// Centre of the circle.
        #[only(MotionKind::Orbit)]
        center_m: Point2<f64> => required, "m";
        /// Radius of the circle.
        #[only(MotionKind::Orbit)]
        radius_m: f64 => "the distance from the centre", "m", Range::POSITIVE;
        /// Angular speed, counter-clockwise.
        #[only(MotionKind::Orbit)]
        omega_radps: f64 => required, "rad/s", Range::ANY;
        /// Angle at the start.
        #[only(MotionKind::Orbit)]
        phase_rad: f64 => "its direction from the centre", "rad", Range::ANY;
        /// Velocity at the start.
        #[only(MotionKind::Bounce)]
        velocity_mps: [f64; 2] => required, "m/s";
        /// Speed.
        #[only(MotionKind::RandomWalk, MotionKind::Waypoints)]
        speed_mps: f64 => required, "m/s", Range::POSITIVE;
        /// Time between random turns.
        #[only(MotionKind::RandomWalk)]
        turn_every_s: f64 = 2.0, "s", Range::at_least(0.01, LARGE);
        /// Interval of x in which the motion stays.
        #[only(MotionKind::Bounce, MotionKind::RandomWalk)]
        x_m: Interval => "the world's", "m";
        /// Interval of y in which the motion stays.
        #[only(MotionKind::Bounce, MotionKind::RandomWalk)]
        y_m: Interval => "the world's", "m";
        /// Points visited in order, starting at the first.
        #[only(MotionKind::Waypoints)]
        points_m: Vec<Point2<f64>> => required, "m", 2..=64;
        /// After the last point: loop goes straight to the first, ping-pong goes back through the points, stop
        /// stays.
        #[only(MotionKind::Waypoints)]
        then: AtEnd = AtEnd::Loop, "";
    }
}
