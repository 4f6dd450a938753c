//! Random particle optimisation: worked examples, every expectation of its environments, and what else the
//! specification found out about the method.
//!
//! The paper's own numbers are lost, so there is no value of the paper to compare with; its claims in words are.
//!
//! Tolerances, from the specification: all printed digits of worked examples; 0.2 s (0.2 m of path) and 0.03 m of
//! clearance with equal angles; with random angles at least 19 arrivals where 20 are listed, none where none is, and
//! 0.5 s for the mean time. It gives none for the rest. Of the potential field: 2 % or one tick, whichever is larger, but
//! 0.03 m for clearances. Of extremes of 20 random seeds: the range of the same extreme over ten sets of seeds, at least
//! one tick or 0.03 m; of other things that 20 seeds decide, two standard deviations of the difference between two sets.
//! Where this was written, everything that is not random agrees to all printed digits, and 4000 seeds of each environment
//! say that 20 seeds of ours would give an extreme like the specification's, or further out, with more than 10 %, on
//! either side.

use crate::environment::{Environment, Expect, environment, environments_of};
use crate::row::{Form, Item, Paper, Rows, Series};
use crate::simulate::{Run, at_origin, disc_at, tidy};
use nalgebra::{Point2, Vector2};
use planners::random::Stream;
use planners::rpoa::{Angles, Params, Rpoa, Rule, Step, gaussian};
use planners::{Identity, Obstacle, ParamValue, PlanInput, find};
use std::ops::{ControlFlow, RangeInclusive};

/// The paper.
pub static PAPER: Paper = Paper {
    name: "rpoa",
    citation: "B. Mohajer, K. Kiani, E. Samiei, M. Sharifi, A new online random particles optimization algorithm for \
               mobile robot path planning in dynamic environments, Mathematical Problems in Engineering, 2013, 491346",
    rows,
    series,
};

/// Half of the sixth digit after the point.
const PRINTED: f64 = 0.5e-6;

/// Why the extremes of random runs have the tolerances they have.
const RANGE_NOTE: &str = "our tolerance: the range of this extreme over ten sets of seeds";

/// The environments that the basic rule solves as it should.
const REGULAR: [&str; 6] =
    ["rpoa_static", "rpoa_static_moved4", "rpoa_moving6", "rpoa_orbiter", "rpoa_moving_target", "rpoa_khan2014"];

fn rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    rows.begin("worked examples")?;
    examples(rows);
    for environment in environments_of("rpoa_") {
        for expect in &environment.expect {
            rows.begin(&format!("{} {}", environment.name, expect.method))?;
            compare(rows, environment, expect);
        }
    }
    rows.begin("effects")?;
    number_of_particles(rows);
    guard(rows);
    sight(rows);
    look_ahead(rows);
    modified_rule(rows);
    small_changes(rows);
    rows.begin("claims of the paper")?;
    claims(rows);
    ControlFlow::Continue(())
}

/// RPOA as the paper has it: without the guard.
pub fn rpoa<'a>(environment: &'a Environment, angles: &str, seed: u64) -> Run<'a> {
    let run = Run { seed, ..Run::new(environment, "rpoa", environment.params("rpoa").clone()) };
    with(with(run, "angles", ParamValue::Choice(angles.to_owned())), "guard", ParamValue::Bool(false))
}

fn with<'a>(mut run: Run<'a>, name: &str, value: ParamValue) -> Run<'a> {
    run.params.insert(name.to_owned(), value);
    run
}

/// The compared field, equations (8) and (9): our `apf` without limit of the pull.
pub fn field<'a>(environment: &'a Environment, dt_s: Option<f64>) -> Run<'a> {
    let mut set = environment.params("apf").clone();
    for (paper, ours) in [("xi", "k_att"), ("eta", "k_rep"), ("rho0", "influence_m")] {
        let value = set.remove(paper).unwrap_or_else(|| panic!("{} has no `{paper}`", environment.name));
        set.insert(ours.to_owned(), value);
    }
    set.insert("attract_cap_m".to_owned(), toml::Value::Float(0.0));
    let run = Run::new(environment, "apf", set);
    Run { dt_s: dt_s.unwrap_or(run.dt_s), ..run }
}

/// What came of several seeds of one run: when it arrived, s, and its smallest distance to an inflated surface, m.
#[derive(Clone, Debug)]
pub struct Seeds(pub Vec<(Option<f64>, f64)>);

impl Seeds {
    /// Runs these seeds.
    pub fn run(run: &Run<'_>, seeds: RangeInclusive<u64>) -> Seeds {
        let outcomes = seeds.map(|seed| Run { seed, ..run.clone() }.run());
        Seeds(outcomes.map(|outcome| (outcome.arrival_s[0], outcome.obstacle_clearance)).collect())
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

fn compare(rows: &mut Rows<'_>, environment: &Environment, expect: &Expect) {
    match expect.seeds {
        Some(seeds) => compare_random(rows, environment, expect, seeds),
        None => compare_one(rows, environment, expect),
    }
}

fn item(environment: &Environment, expect: &Expect, what: &str) -> Item {
    Item::new(format!("{} {}: {what}", environment.name, expect.method))
}

fn compare_random(rows: &mut Rows<'_>, environment: &Environment, expect: &Expect, seeds: u32) {
    let all = Seeds::run(&rpoa(environment, "random", 1), 1..=10 * u64::from(seeds));
    let sets: Vec<Seeds> = all.0.chunks(seeds as usize).map(|set| Seeds(set.to_vec())).collect();
    let found = &sets[0];
    for key in expect.results() {
        let item = item(environment, expect, key);
        let (expected, extreme, least, unit): (_, fn(&Seeds) -> f64, _, _) = match key {
            "arrivals" => {
                count(rows, item, expect.arrivals, found.arrivals(), seeds);
                continue;
            }
            "collisions" => {
                count(rows, item, expect.collisions, found.collisions(), seeds);
                continue;
            }
            "time_mean" => {
                rows.number(item, given(expect.time_mean), tidy(found.time_mean()), 0.5, "s");
                continue;
            }
            "time_min" => (expect.time_min, Seeds::time_min, 0.1, "s"),
            "time_max" => (expect.time_max, Seeds::time_max, 0.1, "s"),
            "min_clearance_worst" => (expect.min_clearance_worst, Seeds::clearance_worst, 0.03, "m"),
            _ => {
                unknown(rows, item);
                continue;
            }
        };
        self::extreme(rows, item, given(expected), &sets, extreme, least, unit);
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

fn compare_one(rows: &mut Rows<'_>, environment: &Environment, expect: &Expect) {
    let item = |what: &str| item(environment, expect, what);
    // Tolerances of times (s, and m of path at 1 m/s), clearances and places (m); a share of the value if that is more.
    let (run, time, clearance, place, share) = match expect.method.as_str() {
        "rpoa-fixed-angles" => (rpoa(environment, "equal", 1), 0.2, 0.03, 0.1, 0.0),
        "apf" => (field(environment, None), 0.1, 0.03, 0.1, 0.02),
        "apf-dt-0.02" => (field(environment, Some(0.02)), 0.02, 0.03, 0.02, 0.02),
        other => panic!("{}: unknown rule set `{other}`", environment.name),
    };
    let outcome = run.run();
    for key in expect.results() {
        let (expected, found, tolerance, unit) = match key {
            "arrives" => {
                rows.exact(item(key), expect.arrives.unwrap_or_default(), outcome.arrives());
                continue;
            }
            "end" => {
                for end in expect.end.iter().flat_map(|points| &points.0) {
                    rows.vector(item(key), (*end).into(), outcome.end(0).map(tidy).into(), place, "m");
                }
                continue;
            }
            "time" => (expect.time, outcome.arrival_s[0].unwrap_or(-1.0), time, "s"),
            "path_length" => (expect.path_length, outcome.path_length(0), time, "m"),
            "min_clearance" => (expect.min_clearance, outcome.obstacle_clearance, clearance, "m"),
            "distance_to_goal" => (expect.distance_to_goal, outcome.distance_to_goal(0), place, "m"),
            other => {
                unknown(rows, item(other));
                continue;
            }
        };
        let expected = given(expected);
        let tolerance =
            if key == "min_clearance" { tolerance } else { tidy(f64::max(tolerance, share * expected.abs())) };
        rows.number(item(key), expected, tidy(found), tolerance, unit);
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

/// RPOA with equal angles in the scene of the worked examples: robot at the origin, everything 1, C_t = 0.1 m.
fn example(discs: &[Obstacle], goal: [f64; 2], params: Params) -> (Rpoa, PlanInput<'_>) {
    let mut rpoa = Rpoa::new(params, Identity { seed: 1, robot: 0, incarnation: 0 });
    let input = at_origin(goal.into(), discs);
    rpoa.sense(&input);
    (rpoa, input)
}

fn basic() -> Params {
    Params { angles: Angles::Equal, guard: false, ..Params::default() }
}

/// e_D and e_J of the particle at this place.
fn errors(rpoa: &mut Rpoa, input: &PlanInput<'_>, offset: Vector2<f64>) -> (f64, f64) {
    let theta = input.position + offset;
    let e_d = (theta - input.goal).norm() - (input.position - input.goal).norm();
    (e_d, rpoa.cost(theta, input.goal) - rpoa.cost(input.position, input.goal))
}

fn at_degrees(radius: f64, degrees: f64) -> Vector2<f64> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    radius * Vector2::new(cos, sin)
}

/// Section 5 of the specification, and the cone of section 3.
fn examples(rows: &mut Rows<'_>) {
    for (mu, printed) in [(1.0, 0.778801), (4.0, 0.367879)] {
        let item = Item::new(format!("example 1: Gaussian at 0.5 m, mu {mu}"));
        rows.number(item, printed, tidy(gaussian(1.0, mu, 0.5)), PRINTED, "");
    }

    let one = [disc_at(0, [1.0, 0.0].into(), 0.3)];
    let ahead = [5.0, 0.0];
    let (mut rpoa, input) = example(&one, ahead, basic());
    let total = rpoa.cost(input.position, input.goal);
    rows.number(Item::new("example 2: J of the robot"), 0.612626, tidy(total), PRINTED, "");
    let target = -gaussian(1.0, 1.0, 5.0);
    let obstacle = tidy(total - target);
    rows.number(Item::new("example 2: J of the robot, obstacle's part"), 0.612626394, obstacle, 0.5e-9, "");
    rows.number(Item::new("example 2: J of the robot, target's part"), -1.39e-11, target, 0.005e-11, "");

    for (degrees, e_d, e_j, digit) in [
        (0.0, -0.1, 0.08505, 0.5e-5),
        (60.0, -0.049242, 0.039422, PRINTED),
        (85.0, -0.007722, 0.003193, PRINTED),
        (90.0, 0.001000, -0.004278, PRINTED),
        (120.0, 0.050743, -0.045890, PRINTED),
    ] {
        let (ours_d, ours_j) = errors(&mut rpoa, &input, at_degrees(0.1, degrees));
        rows.number(Item::new(format!("example 3: e_D at {degrees} degrees")), e_d, tidy(ours_d), PRINTED, "m");
        rows.number(Item::new(format!("example 3: e_J at {degrees} degrees")), e_j, tidy(ours_j), digit, "");
    }

    let step = rpoa.choose(input.position, input.goal);
    rows.exact(Item::new("example 4: chosen particle"), 15, step.index);
    rows.vector(Item::new("example 4: its place"), [0.0, 0.1], step.offset.map(tidy).into(), 1e-12, "m");
    let (e_d, _) = errors(&mut rpoa, &input, step.offset);
    rows.exact(Item::new("example 4: it is further from the target than the robot"), true, e_d > 0.0);

    let two = [disc_at(0, [1.0, 0.5].into(), 0.3), disc_at(1, [1.0, -0.5].into(), 0.3)];
    let (mut rpoa, input) = example(&two, ahead, basic());
    let step = rpoa.choose(input.position, input.goal);
    let (_, e_j) = errors(&mut rpoa, &input, step.offset);
    let total = tidy(rpoa.cost(input.position, input.goal));
    rows.number(Item::new("example 5: J of the robot between two discs"), 1.024257, total, PRINTED, "");
    rows.exact(Item::new("example 5: chosen particle"), 15, step.index);
    rows.number(Item::new("example 5: its e_J"), -0.005285, tidy(e_j), PRINTED, "");

    // The particle nearest to the direction 100 degrees is number 17, at 102 degrees.
    let far = at_degrees(28.0, 100.0).into();
    let (mut rpoa, input) = example(&[], far, basic());
    let target = rpoa.cost(input.position, input.goal).abs();
    rows.number(Item::new("example 6: J_T at 28 m"), 0.0, target, 0.0, "");
    let Step { index, rule, .. } = rpoa.choose(input.position, input.goal);
    rows.exact(Item::new("example 6: target 28 m away at 100 degrees: chosen particle"), 17, index);
    rows.exact(Item::new("example 6: it is taken by the glide rule"), true, rule == Rule::Glide);

    potential_field(rows);
    rows.number(
        Item::new("example 8: one sensed obstacle: steps of 2000 that come nearer to it")
            .note("random places, directions"),
        0.0,
        f64::from(steps_towards_the_obstacle()),
        0.0,
        "",
    );
    let khan = Seeds::run(&self::rpoa(environment("rpoa_khan2014"), "random", 1), 1..=20).clearance_worst();
    let item = Item::new("example 8: clearance in rpoa_khan2014, 20 seeds");
    rows.push(
        item,
        Some("≥ r_s − C_t = 0.9 m".to_owned()),
        format!("{} m", tidy(khan)),
        "exact".to_owned(),
        khan >= 0.9,
    );

    cone(rows);
}

/// Example 7: the two potentials by equations (8) and (9), and what the method `apf` makes of them.
fn potential_field(rows: &mut Rows<'_>) {
    let (xi, eta, rho_0) = (1.0, 1.0, 1.0);
    let params = [("k_att", xi), ("attract_cap_m", 0.0), ("k_rep", eta), ("influence_m", rho_0)];
    let values = params.map(|(name, value)| (name.to_owned(), ParamValue::Float(value))).into_iter().collect();
    let method = find("apf").expect("the method exists");
    let identity = Identity { seed: 1, robot: 0, incarnation: 0 };
    let mut apf = (method.build)(&values, identity).unwrap_or_else(|problem| panic!("{problem}"));
    let goal = Point2::new(9.0, 9.0);
    let rho = 0.5;
    let discs = [disc_at(0, [0.0, -(rho + 0.3)].into(), 0.3)];
    let plan = apf.plan(&at_origin(goal, &discs));
    let attraction = xi / 2.0 * goal.coords.norm_squared();
    let repulsion = eta / 2.0 * (1.0 / rho - 1.0 / rho_0).powi(2);
    rows.number(Item::new("example 7: U_att of equation (8)"), 81.0, attraction, 1e-9, "");
    rows.vector(Item::new("example 7: pull of `apf`"), [9.0, 9.0], plan.attractive.into(), 1e-12, "m/s");
    rows.number(Item::new("example 7: U_rep of equation (9)"), 0.5, repulsion, 1e-12, "");
    rows.vector(Item::new("example 7: push of `apf`"), [0.0, 4.0], plan.repulsive.map(tidy).into(), 1e-9, "m/s");
}

/// Example 8: with exactly one obstacle in sight and the target far away, the robot never comes nearer to it.
fn steps_towards_the_obstacle() -> u32 {
    let mut stream = Stream::new(1, 0, 0, "example 8");
    let params = Params { angles: Angles::Random, ..basic() };
    let nearer = (0..2000).filter(|_| {
        let disc = disc_at(0, at_degrees(stream.between(0.4, 1.3), stream.between(0.0, 360.0)).into(), 0.3);
        let discs = [disc];
        let goal = at_degrees(100.0, stream.between(0.0, 360.0)).into();
        let (mut rpoa, input) = example(&discs, goal, params.clone());
        let step = rpoa.choose(input.position, input.goal);
        disc.shape.distance(input.position + step.offset) < disc.shape.distance(input.position)
    });
    nearer.count() as u32
}

/// Section 3: met head-on, almost no particle both lowers the cost and comes nearer to the target.
fn cone(rows: &mut Rows<'_>) {
    let point = [disc_at(0, [1.0, 0.0].into(), 0.0)];
    let (mut rpoa, input) = example(&point, [5.0, 0.0], basic());
    let mut edge = |inside: fn((f64, f64)) -> bool| {
        let (mut low, mut high) = (80.0, 100.0);
        while high - low > 1e-9 {
            let middle = (low + high) / 2.0;
            if inside(errors(&mut rpoa, &input, at_degrees(0.1, middle))) { high = middle } else { low = middle }
        }
        tidy(low)
    };
    let (from, to) = (edge(|(_, e_j)| e_j < 0.0), edge(|(e_d, _)| e_d >= 0.0));
    rows.number(Item::new("cone of particles with e_J < 0 and e_D < 0: from"), 87.13, from, 0.005, "degrees");
    rows.number(Item::new("cone of particles with e_J < 0 and e_D < 0: to"), 89.43, to, 0.005, "degrees");
    let share = 1.0 - 2.0 * (to - from) / 360.0;
    let item = Item::new("share of ticks in which none of 60 random particles is in it")
        .note("the specification says: about half; tolerance ours");
    rows.number(item, 0.5, tidy(share.powi(60)), 0.1, "");
}

/// Section 4: more particles, straighter ways.
fn number_of_particles(rows: &mut Rows<'_>) {
    for (particles, mean_s, seeds) in particle_counts().into_iter().map(|(n, mean_s)| (n, mean_s, many_particles(n))) {
        let item = |what: &str| Item::new(format!("rpoa_static_moved4 with {particles} particles, 20 seeds: {what}"));
        count(rows, item("arrivals"), Some(20), seeds.arrivals(), 20);
        // With few particles the times of single seeds differ so much that 0.5 s says nothing about their mean.
        let tolerance = (seeds.time_error() * 1e2).round().max(50.0) / 1e2;
        let item =
            item("mean time").note("our tolerance: 0.5 s or two standard errors of the difference of such means");
        rows.number(item, mean_s, tidy(seeds.time_mean()), tolerance, "s");
    }
}

/// Numbers of particles, and the specification's mean times.
fn particle_counts() -> [(i64, f64); 5] {
    [(5, 24.4), (10, 17.2), (20, 15.4), (60, 14.3), (200, 14.0)]
}

fn many_particles(n: i64) -> Seeds {
    Seeds::run(&with(rpoa(environment("rpoa_static_moved4"), "random", 1), "particles", ParamValue::Int(n)), 1..=20)
}

/// Section 4: the guard keeps clear of what the sum of the hills would let the robot drive through.
fn guard(rows: &mut Rows<'_>) {
    let guarded = |run: Run<'static>| with(run, "guard", ParamValue::Bool(true));
    let trap = |mu_obs: f64| with(rpoa(environment("rpoa_u_trap"), "random", 1), "mu_obs", ParamValue::Float(mu_obs));
    let squeeze = Seeds::run(&guarded(rpoa(environment("rpoa_squeeze"), "random", 1)), 1..=20);
    let item = |what: &str| Item::new(format!("rpoa_squeeze with the guard, 20 seeds: {what}"));
    count(rows, item("collisions"), Some(0), squeeze.collisions(), 20);
    rows.number(item("worst clearance"), 0.15, tidy(squeeze.clearance_worst()), 0.03, "m");
    chance(rows, item("arrivals"), 6, squeeze.arrivals());

    let plain = Seeds::run(&trap(1.0), 1..=20);
    let item = |what: &str| Item::new(format!("rpoa_u_trap with mu_obs 1, 20 seeds: {what}"));
    count(rows, item("arrivals"), Some(20), plain.arrivals(), 20);
    rows.number(item("worst clearance"), -0.298, tidy(plain.clearance_worst()), 0.03, "m");
    let guarded = Seeds::run(&guarded(trap(1.0)), 1..=20);
    let item = |what: &str| Item::new(format!("rpoa_u_trap with mu_obs 1 and the guard, 20 seeds: {what}"));
    count(rows, item("arrivals"), Some(0), guarded.arrivals(), 20);
    count(rows, item("collisions"), Some(0), guarded.collisions(), 20);
}

/// Section 4: seeing further can be worse.
fn sight(rows: &mut Rows<'_>) {
    let run = rpoa(environment("rpoa_moving_target"), "random", 1);
    let found = Seeds::run(&with(run, "sensor_range", ParamValue::Float(1.5)), 1..=20);
    let item = Item::new("rpoa_moving_target with sensor range 1.5 m, 20 seeds: collisions");
    chance(rows, item, 10, found.collisions());
}

/// A count of 20 seeds that is neither all nor none.
fn chance(rows: &mut Rows<'_>, item: Item, expected: u32, found: u32) {
    let share = f64::from(expected + found) / 40.0;
    let tolerance = (2.0 * (2.0 * 20.0 * share * (1.0 - share)).sqrt() * 10.0).round() / 10.0;
    let item = item.note("our tolerance: two standard deviations of the difference between two such counts");
    rows.number(item, f64::from(expected), f64::from(found), tolerance, "of 20");
}

/// Section 7: in the runtime the robot does not get to the particle within a tick.
fn look_ahead(rows: &mut Rows<'_>) {
    for step_radius in [0.05, 0.1, 0.2, 0.4] {
        let run = |name: &str, seeds: RangeInclusive<u64>| {
            let run = Run { dt_s: 0.05, speed_mps_max: 1.0, ..rpoa(environment(name), "random", 1) };
            Seeds::run(&with(run, "step_radius", ParamValue::Float(step_radius)), seeds)
        };
        let all = Seeds(REGULAR.iter().flat_map(|name| run(name, 1..=10).0).collect());
        let item = |what: &str| {
            Item::new(format!("six environments, 0.05 s ticks, C_t {step_radius} m, 10 seeds each: {what}"))
        };
        count(rows, item("arrivals"), Some(60), all.arrivals(), 60);
        let (least, most) = (tidy(all.time_min()), tidy(all.time_max()));
        let ok = least >= 13.9 - 0.5 && most <= 15.8 + 0.5;
        let times = item("times").note("our tolerance: that of mean times");
        rows.push(times, Some("13.9 to 15.8 s".to_owned()), format!("{least} to {most} s"), "± 0.5 s".to_owned(), ok);
        if step_radius < 0.4 {
            count(rows, item("collisions"), Some(0), all.collisions(), 60);
        } else {
            let sets = run("rpoa_moving_target", 1..=100);
            let sets: Vec<Seeds> = sets.0.chunks(10).map(|set| Seeds(set.to_vec())).collect();
            let item = item("worst clearance, in rpoa_moving_target");
            extreme(rows, item, 0.005, &sets, Seeds::clearance_worst, 0.03, "m");
        }
    }
}

/// Section 3: the modified rule fails in more environments than the basic one.
fn modified_rule(rows: &mut Rows<'_>) {
    let failed = |lambda: f64| {
        let fails = |environment: &&Environment| {
            let run = with(rpoa(environment, "random", 1), "lambda", ParamValue::Float(lambda));
            let found = Seeds::run(&run, 1..=20);
            found.arrivals() < 20 || found.collisions() > 0
        };
        environments_of("rpoa_").filter(fails).count()
    };
    let (basic, modified) = (failed(0.0), failed(1.0));
    let item = Item::new("environments not solved by all of 20 seeds: modified rule (lambda 1), basic rule")
        .note("the specification does not list its maps; of these nine both fail in three, not in the same");
    let ours = format!("{modified} against {basic}");
    rows.push(item, Some("more".to_owned()), ours, "exact".to_owned(), modified > basic);
}

/// Section 5: a start moved by 1e-7 m changes the time by a tick at most.
fn small_changes(rows: &mut Rows<'_>) {
    let mut greatest: f64 = 0.0;
    for name in REGULAR {
        let time = |environment: &Environment| rpoa(environment, "equal", 1).run().arrival_s[0].unwrap_or(-1.0);
        let here = time(environment(name));
        for degrees in [0.0, 90.0, 180.0, 270.0] {
            let mut moved = environment(name).clone();
            moved.robots[0].start += at_degrees(1e-7, degrees);
            greatest = greatest.max((time(&moved) - here).abs());
        }
    }
    let item = Item::new("six environments, equal angles, start moved by 1e-7 m: greatest change of time");
    rows.push(
        item,
        Some("≤ 0.1 s".to_owned()),
        format!("{} s", tidy(greatest)),
        "exact".to_owned(),
        tidy(greatest) <= 0.1,
    );
}

/// What the paper says in words about its scenarios, in the environments that stand for them.
fn claims(rows: &mut Rows<'_>) {
    let random = |name: &str| Seeds::run(&rpoa(environment(name), "random", 1), 1..=20);
    let apf = |name: &str| field(environment(name), None).run();
    let mut claim = |scenario: &str, words: &str, ours: String, ok: bool, note: &str| {
        let item = Item { item: scenario.to_owned(), paper_value: Some(words.to_owned()), note: note.to_owned() };
        rows.push(item, None, ours, "exact".to_owned(), ok);
    };
    let arrives = |arrives: bool| if arrives { "arrives" } else { "does not arrive" };

    let (ours, other) = (random("rpoa_static").arrivals(), apf("rpoa_static").arrives());
    let text = format!("RPOA arrives with {ours} of 20 seeds, APF {}", arrives(other));
    claim("scenario 1 (rpoa_static)", "both arrive", text, ours >= 19 && other, "");

    let (ours, other) = (random("rpoa_static_moved4").arrivals(), apf("rpoa_static_moved4").arrives());
    let text = format!("RPOA arrives with {ours} of 20 seeds, APF {}", arrives(other));
    let words = "RPOA arrives, APF stops in a local minimum";
    claim("scenario 1, fourth obstacle moved (rpoa_static_moved4)", words, text, ours >= 19 && !other, "");

    let (ours, other) = (random("rpoa_moving6").time_mean(), apf("rpoa_moving6").path_length(0));
    let text = format!("RPOA {ours:.2} m, APF {other:.2} m, straight 12.53 m");
    let note = "not reproduced: the paper's courses of the obstacles are lost, and in these the APF path is no longer";
    claim("scenario 2 (rpoa_moving6)", "RPOA near-optimal, APF path much longer", text, other > 1.2 * ours, note);

    let (ours, other) = (random("rpoa_orbiter").arrivals(), apf("rpoa_orbiter"));
    let (driven, left) = (other.path_length(0), other.distance_to_goal(0));
    let text = format!("RPOA arrives with {ours} of 20 seeds, APF drives {driven:.0} m and ends {left:.2} m away");
    let words = "RPOA arrives, APF circles for ever";
    let note = "true at 0.3 rad/s; at 0.5 rad/s neither arrives";
    claim(
        "scenario 2, one on an orbit round the target (rpoa_orbiter)",
        words,
        text,
        ours >= 19 && !other.arrives(),
        note,
    );

    let (ours, other) = (random("rpoa_moving_target").time_mean(), apf("rpoa_moving_target"));
    let (length, time_s) = (other.path_length(0), other.arrival_s[0].unwrap_or(f64::INFINITY));
    let text = format!("RPOA {ours:.2} m in {ours:.2} s, APF {length:.2} m in {time_s:.1} s");
    let ok = ours < length && ours < time_s;
    claim("scenario 3, moving target (rpoa_moving_target)", "RPOA shorter and faster", text, ok, "");

    let ours = random("rpoa_u_trap").arrivals();
    let text = format!("RPOA arrives with {ours} of 20 seeds");
    let note = "too strong: true of single convex obstacles, not of concave groups";
    claim("local minima (rpoa_u_trap)", "free from local minima", text, ours >= 19, note);
}

fn series() -> Vec<Series> {
    let paths = environments_of("rpoa_").map(|environment| Series {
        name: environment.name.clone(),
        title: format!("{}: paths; obstacles where they start", environment.name),
        x: "x (m)".to_owned(),
        y: "y (m)".to_owned(),
        form: Form::Paths,
        lines: vec![
            ("RPOA, random angles".to_owned(), rpoa(environment, "random", 1).run().line(0)),
            ("RPOA, equal angles".to_owned(), rpoa(environment, "equal", 1).run().line(0)),
            ("APF".to_owned(), field(environment, None).run().line(0)),
        ],
        discs: environment.obstacles.iter().map(|disc| [disc.center.x, disc.center.y, disc.radius]).collect(),
    });
    let bars = particle_counts().map(|(n, _)| (format!("{n}"), vec![[n as f64, many_particles(n).time_mean()]]));
    let particles = Series {
        name: "rpoa_particles".to_owned(),
        title: "Mean time in rpoa_static_moved4 over the number of particles, 20 seeds each".to_owned(),
        x: "particles".to_owned(),
        y: "time (s)".to_owned(),
        form: Form::Bars,
        lines: bars.into(),
        discs: Vec::new(),
    };
    paths.chain([particles]).collect()
}
