//! Plane geometry: by example, and against brute force.

mod arm;
mod shapes;
mod spline;
