//! Plane geometry: shapes and their distances, paths, and the kinematics of an arm. Lengths are in metres, angles in
//! radians, counter-clockwise from +x. No robot, no scenario, no clock.

pub mod angle;
pub mod arm;
pub mod half_planes;
pub mod map;
pub mod route;
pub mod shapes;
pub mod smoothness;
pub mod spline;

pub use angle::{heading, towards, wrap};
pub use arm::{ArmGeometry, ArmState, Elbow};
pub use half_planes::HalfPlane;
pub use map::{Map, MapError, Raster};
pub use route::{Route, Search};
pub use shapes::{Capsule, Polygon, between_segments, segment_distance, segments_cross, swept_distance};
pub use smoothness::Smoothness;
