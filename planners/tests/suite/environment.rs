//! The papers' environments and what is expected in them (`tests/data/*.toml`). A key that is not understood is an
//! error, so that no expectation is passed over.

use nalgebra::{Point2, Vector2};
use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Environment {
    pub(crate) schema: String,
    pub(crate) name: String,
    #[serde(rename = "note")]
    _note: String,
    #[serde(rename = "world")]
    _world: toml::Value,
    #[serde(rename = "robot")]
    pub(crate) robots: Vec<Robot>,
    #[serde(rename = "obstacle", default)]
    pub(crate) obstacles: Vec<Disc>,
    pub(crate) params: BTreeMap<String, toml::Table>,
    pub(crate) expect: Vec<Expect>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Robot {
    pub(crate) start: [f64; 2],
    pub(crate) goal: [f64; 2],
    pub(crate) radius: f64,
    pub(crate) arrival_tolerance: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Disc {
    pub(crate) center: [f64; 2],
    pub(crate) radius: f64,
    pub(crate) motion: Option<Motion>,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub(crate) enum Motion {
    Pingpong { a: [f64; 2], b: [f64; 2], speed: f64 },
    Orbit { center: [f64; 2], radius: f64, omega: f64, phase: f64 },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Expect {
    pub(crate) method: String,
    #[serde(default)]
    pub(crate) neighbour_pose_delay_ticks: usize,
    pub(crate) arrives: bool,
    pub(crate) arrival_times: Vec<f64>,
    pub(crate) min_robot_clearance: Option<f64>,
    pub(crate) min_obstacle_clearance: Option<f64>,
    pub(crate) end: Option<Vec<[f64; 2]>>,
}

impl Environment {
    pub(crate) fn read(text: &str) -> Environment {
        let environment: Environment = toml::from_str(text).expect("the data file is an environment");
        assert_eq!(environment.schema, "papers-env/1");
        environment
    }
}

impl Disc {
    /// Where its centre is at time `t`.
    pub(crate) fn center_at(&self, t: f64) -> Point2<f64> {
        match self.motion {
            None => self.center.into(),
            Some(Motion::Pingpong { a, b, speed }) => {
                let (a, b) = (Point2::from(a), Point2::from(b));
                let length = (b - a).norm();
                let along = (speed * t).rem_euclid(2.0 * length);
                a + (b - a) * (along.min(2.0 * length - along) / length)
            }
            Some(Motion::Orbit { center, radius, omega, phase }) => {
                let (sin, cos) = (omega * t + phase).sin_cos();
                Point2::from(center) + radius * Vector2::new(cos, sin)
            }
        }
    }
}
