//! Plane geometry: by example, and against brute force.

mod arm;
mod map;
mod route;
mod shapes;
mod spline;
