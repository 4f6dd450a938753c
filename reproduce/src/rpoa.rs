//! Random particle optimisation: worked examples, every expectation of its scenes, and what else the
//! specification found out about the method.
//!
//! The paper's own numbers are lost, so there is no value of the paper to compare with; its claims in words are.
//!
//! Tolerances, from the specification: all printed digits of worked examples; 0.2 s (0.2 m of path) and 0.03 m of
//! clearance with equal angles; with random angles at least 19 arrivals where 20 are listed, none where none is, and
//! 0.5 s for the mean time. It gives none for the rest. Of the potential field: 2 % or one tick, whichever is larger, but
//! 0.03 m for clearances. Of extremes of 20 random seeds: the range of the same extreme over ten sets of seeds, at least
//! one tick or 0.03 m; of other things that 20 seeds decide, two standard deviations of the difference between two sets.
//! Where this was written, everything that is not random agrees to all printed digits, and 4000 seeds of each scene
//! say that 20 seeds of ours would give an extreme like the specification's, or further out, with more than 10 %, on
//! either side.

mod effects;
mod examples;
mod figures;

use crate::row::{Item, Paper, Rows};
use crate::scene::{Scene, plain, scenes_of};
use crate::stepper::{Rules, Run, tidy};
pub use effects::as_in_the_runtime;
use effects::{claims, effects};
use examples::examples;
use model::ParamValue;
use model::key::Named;
use nalgebra::Vector2;
use scenarios::{Expectation, Results as Keys};
use std::ops::{ControlFlow, RangeInclusive};

/// The paper.
pub static PAPER: Paper = Paper {
    name: "rpoa",
    citation: "B. Mohajer, K. Kiani, E. Samiei, M. Sharifi, A new online random particles optimization algorithm for \
               mobile robot path planning in dynamic environments, Mathematical Problems in Engineering, 2013, 491346",
    rows,
    series: figures::series,
};

/// Half of the sixth digit after the point.
const PRINTED: f64 = 0.5e-6;

/// Why the extremes of random runs have the tolerances they have.
const RANGE_NOTE: &str = "our tolerance: the range of this extreme over ten sets of seeds";

/// The paper's programs give up after this time, s.
const LIMIT_S: f64 = 100.0;

/// The scenes that the basic rule solves as it should.
const REGULAR: [&str; 6] =
    ["rpoa_static", "rpoa_static_moved4", "rpoa_moving6", "rpoa_orbiter", "rpoa_moving_target", "rpoa_khan2014"];

fn rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    rows.begin("worked examples")?;
    examples(rows);
    for scene in scenes_of("rpoa_") {
        for expect in scene.expectations() {
            rows.begin(&format!("{} {}", scene.name, expect.method))?;
            compare(rows, scene, expect);
        }
    }
    rows.begin("effects")?;
    effects(rows);
    rows.begin("claims of the paper")?;
    claims(rows);
    ControlFlow::Continue(())
}

/// RPOA as the paper has it: without the guard, at one radius of its particles a tick.
pub fn rpoa(scene: &Scene, angles: &str, seed: u64) -> Run {
    let params = [
        ("step_radius", ParamValue::Float(0.1)),
        ("angles", ParamValue::Choice(angles.to_owned())),
        ("guard", ParamValue::Bool(false)),
    ];
    let run = Run::of(scene, "rpoa", &params).seeded(seed).for_seconds(LIMIT_S);
    run.each(|robot| robot.limits.speed_mps_max = f64::INFINITY)
}

/// The compared field, equations (8) and (9): our `apf` without limit of the pull. It feels what RPOA sees.
pub fn field(scene: &Scene, dt_s: Option<f64>) -> Run {
    let sensed = scene.robot().params.get("sensor_range").cloned().unwrap_or(ParamValue::Float(1.0));
    let params = [
        ("k_att", ParamValue::Float(1.0)),
        ("k_rep", ParamValue::Float(1.0)),
        ("influence_m", sensed),
        ("attract_cap_m", ParamValue::Float(0.0)),
    ];
    let run = Run::of(scene, "apf", &params).for_seconds(LIMIT_S);
    let rules = Rules { dt_s: dt_s.unwrap_or(run.rules.dt_s), ..run.rules };
    run.under(rules)
}

/// What came of several seeds of one run: when it arrived, s, and its smallest distance to an inflated surface, m.
#[derive(Clone, Debug)]
pub struct Seeds(pub Vec<(Option<f64>, f64)>);

impl Seeds {
    /// Runs these seeds.
    pub fn run(run: &Run, seeds: RangeInclusive<u64>) -> Seeds {
        let outcomes = seeds.map(|seed| run.clone().seeded(seed).run());
        Seeds(outcomes.map(|outcome| (outcome.arrival_s(0), outcome.obstacles.clearance_m)).collect())
    }

    /// How many arrive.
    pub fn arrivals(&self) -> u32 {
        self.times().count() as u32
    }

    /// How many overlap an obstacle.
    pub fn collisions(&self) -> u32 {
        self.0.iter().filter(|(_, clearance)| *clearance < 0.0).count() as u32
    }

    /// The smallest clearance, m.
    pub fn clearance_worst(&self) -> f64 {
        self.0.iter().map(|(_, clearance)| *clearance).fold(f64::INFINITY, f64::min)
    }

    /// The mean time of those that arrive, s.
    pub fn time_mean(&self) -> f64 {
        self.times().sum::<f64>() / f64::from(self.arrivals())
    }

    /// Two standard errors of the difference between two such means, s.
    fn time_error(&self) -> f64 {
        let mean = self.time_mean();
        let variance = self.times().map(|time| (time - mean).powi(2)).sum::<f64>() / f64::from(self.arrivals());
        2.0 * (2.0 * variance / f64::from(self.arrivals())).sqrt()
    }

    /// The smallest time, s.
    pub fn time_min(&self) -> f64 {
        self.times().fold(f64::INFINITY, f64::min)
    }

    /// The greatest time, s.
    pub fn time_max(&self) -> f64 {
        self.times().fold(f64::NEG_INFINITY, f64::max)
    }

    fn times(&self) -> impl Iterator<Item = f64> {
        self.0.iter().filter_map(|(time, _)| *time)
    }
}

fn compare(rows: &mut Rows<'_>, scene: &Scene, expect: &Expectation) {
    match expect.seeds {
        Some(seeds) => compare_random(rows, scene, expect, seeds),
        None => compare_one(rows, scene, expect),
    }
}

fn item(scene: &Scene, expect: &Expectation, what: &str) -> Item {
    Item::new(format!("{} {}: {what}", scene.name, expect.method))
}

fn compare_random(rows: &mut Rows<'_>, scene: &Scene, expect: &Expectation, seeds: u32) {
    let all = Seeds::run(&rpoa(scene, "random", 1), 1..=10 * u64::from(seeds));
    let sets: Vec<Seeds> = all.0.chunks(seeds as usize).map(|set| Seeds(set.to_vec())).collect();
    let found = &sets[0];
    let extremes = [
        (Keys::time_min_s, Seeds::time_min as fn(&Seeds) -> f64, 0.1, "s"),
        (Keys::time_max_s, Seeds::time_max, 0.1, "s"),
        (Keys::min_clearance_worst_m, Seeds::clearance_worst, 0.03, "m"),
    ];
    for key in expect.results() {
        let item = item(scene, expect, plain(key.name()));
        if key.is(Keys::arrivals) {
            count(rows, item, expect.get(Keys::arrivals), found.arrivals(), seeds);
        } else if key.is(Keys::collisions) {
            count(rows, item, expect.get(Keys::collisions), found.collisions(), seeds);
        } else if key.is(Keys::time_mean_s) {
            rows.number(item, given(expect.number(key)), tidy(found.time_mean()), 0.5, "s");
        } else if let Some((_, extreme, least, unit)) = extremes.into_iter().find(|(known, ..)| key.is(*known)) {
            self::extreme(rows, item, given(expect.number(key)), &sets, extreme, least, unit);
        } else {
            unknown(rows, item);
        }
    }
}

/// An extreme of the first of several sets of seeds; it may be off by as much as it differs between the sets.
fn extreme(
    rows: &mut Rows<'_>,
    item: Item,
    expected: f64,
    sets: &[Seeds],
    extreme: fn(&Seeds) -> f64,
    least: f64,
    unit: &str,
) {
    let extremes = || sets.iter().map(extreme);
    let range = extremes().fold(f64::NEG_INFINITY, f64::max) - extremes().fold(f64::INFINITY, f64::min);
    let tolerance = (range.max(least) * 1e3).round() / 1e3;
    rows.number(item.note(RANGE_NOTE), expected, tidy(extreme(&sets[0])), tolerance, unit);
}

fn compare_one(rows: &mut Rows<'_>, scene: &Scene, expect: &Expectation) {
    let item = |what: &str| item(scene, expect, what);
    // Tolerances of times (s, and m of path at 1 m/s), clearances and places (m); a share of the value if that is more.
    let (run, time, clearance, place, share) = match expect.method.as_str() {
        "rpoa-fixed-angles" => (rpoa(scene, "equal", 1), 0.2, 0.03, 0.1, 0.0),
        "apf" => (field(scene, None), 0.1, 0.03, 0.1, 0.02),
        "apf-dt-0.02" => (field(scene, Some(0.02)), 0.02, 0.03, 0.02, 0.02),
        other => panic!("{}: unknown rule set `{other}`", scene.name),
    };
    let outcome = run.run();
    let numbers = [
        (Keys::time_s, outcome.arrival_s(0).unwrap_or(-1.0), time, "s"),
        (Keys::path_length_m, outcome.path_length(0), time, "m"),
        (Keys::min_clearance_m, outcome.obstacles.clearance_m, clearance, "m"),
        (Keys::distance_to_goal_m, outcome.distance_to_goal(0), place, "m"),
    ];
    for key in expect.results() {
        let item = item(plain(key.name()));
        if key.is(Keys::arrives) {
            rows.exact(item, expect.get(Keys::arrives).unwrap_or_default(), outcome.all_arrived());
        } else if key.is(Keys::end_m) {
            for end in expect.get(Keys::end_m).unwrap_or_default() {
                rows.vector(item.clone(), end.into(), outcome.end(0).map(tidy).into(), place, "m");
            }
        } else if let Some((_, found, tolerance, unit)) = numbers.into_iter().find(|(known, ..)| key.is(*known)) {
            let expected = given(expect.number(key));
            let scaled = !key.is(Keys::min_clearance_m);
            let tolerance = if scaled { tidy(f64::max(tolerance, share * expected.abs())) } else { tolerance };
            rows.number(item, expected, tidy(found), tolerance, unit);
        } else {
            unknown(rows, item);
        }
    }
}

fn given(expected: Option<f64>) -> f64 {
    expected.expect("the key is one of the results")
}

fn unknown(rows: &mut Rows<'_>, item: Item) {
    rows.exact(item.note("nothing here knows this key"), "compared", "not compared");
}

/// A count of seeds: all of them may be all but one.
fn count(rows: &mut Rows<'_>, item: Item, expected: Option<u32>, found: u32, seeds: u32) {
    let expected = expected.expect("the key is one of the results");
    let tolerance = if expected == seeds { 1.0 } else { 0.0 };
    rows.number(item, f64::from(expected), f64::from(found), tolerance, &format!("of {seeds}"));
}

fn at_degrees(radius: f64, degrees: f64) -> Vector2<f64> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    radius * Vector2::new(cos, sin)
}
