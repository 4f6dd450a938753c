//! Worked examples: single plans.

use super::{PRINTED, Seeds, at_degrees};
use crate::example::at_origin;
use crate::row::{Item, Rows};
use crate::scene::{disc_at, scene};
use crate::stepper::tidy;
use model::ParamValue;
use model::random::Stream;
use nalgebra::{Point2, Vector2};
use planners::rpoa::{Angles, Params, Rpoa, Rule, Step, gaussian};
use planners::{Identity, Obstacle, PlanInput, find};

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

/// In the scene of the worked examples: the angle of a particle, degrees, and its e_D and e_J.
pub(super) fn errors_of_example() -> impl FnMut(f64) -> [f64; 3] {
    let one = [disc_at(0, [1.0, 0.0].into(), 0.3)];
    let mut rpoa = example(&one, [5.0, 0.0], basic()).0;
    move |degrees| {
        let (e_d, e_j) = errors(&mut rpoa, &at_origin([5.0, 0.0].into(), &one), at_degrees(0.1, degrees));
        [degrees, e_d, e_j]
    }
}

/// Section 5 of the specification, and the cone of section 3.
pub(super) fn examples(rows: &mut Rows<'_>) {
    rows.about(
        "specification, section 5 (the paper's equations are restored from a follow-up)",
        "a single plan of rpoa with angles = equal and guard = false for a point robot at the origin, C_t = 0.1 m",
        "all digits that the specification prints",
    );
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
            .method("2000 plans at random places and directions, one disc in sight, the target 100 m away"),
        0.0,
        f64::from(steps_towards_the_obstacle()),
        0.0,
        "",
    );
    let khan = Seeds::run(&super::rpoa(scene("rpoa_khan2014"), "random", 1), 1..=20).clearance_worst();
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

/// Example 7: what the planner `apf` makes of the potentials of equations (8) and (9).
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
    rows.vector(Item::new("example 7: pull of `apf`"), [9.0, 9.0], plan.attractive.into(), 1e-12, "m/s");
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
}
