//! The decentralised potential field: worked examples of its law, where robots come to rest, and every expectation of
//! its scenes.
//!
//! Tolerances. The specification prints worked examples to six digits after the point. It allows 0.3 s for arrival
//! times (2.5 s in `apf_antipodal8`, which a grain of dust changes) and 0.02 m for clearances. It gives none for places
//! of rest: there 0.05 m, one tick of motion. All leave room for other mathematical libraries: where this was written,
//! every row agrees to all printed digits. Arrivals that arrival times imply, and places of rest that a worked example
//! has to six digits, have no row of their own.

mod forces;

use crate::example::at_origin;
use crate::row::{Item, Paper, Rows, Series};
use crate::scene::{Scene, disc_at, plain, scene, scenes_of};
use crate::stepper::{Rules, Run, Stepper, tidy};
use model::key::Named;
use model::{BodyKind, Drive, ParamValue, ParamValues};
use nalgebra::Vector2;
use planners::{Identity, Neighbor, Obstacle, Plan, PlanInput, find};
use scenarios::{Expectation, Results as Keys};
use std::ops::ControlFlow;

/// The paper.
pub static PAPER: Paper = Paper {
    name: "decentralized-apf",
    citation: "F. Matoui, B. Boussaid, B. Metoui, G. B. Frej et al., Path planning of a group of robots with potential \
               field approach: decentralized architecture, IFAC World Congress 2017, doi 10.1016/j.ifacol.2017.08.1822",
    silence: "the text that could be read has equations, no parameters and no results; numbers are the specification's",
    differs: &[(
        "claim: collisions are avoided (the paper's own law)",
        "the law as printed lets bodies overlap obstacles: distances are between centres, and the pull grows without a limit \
         while the push at contact is finite. With shoal's defaults the clearance is 0.37 m or more in the same scenes",
    )],
    rows,
    steps: 33,
    series,
};

/// Six digits after the point.
const PRINTED: f64 = 0.5e-6;

fn rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    rows.begin("claims of the paper")?;
    claims(rows);
    rows.begin("worked examples")?;
    examples(rows);
    places_of_rest(rows);
    for scene in scenes_of("apf_") {
        for expect in scene.expectations() {
            rows.begin(&format!("{} {}", scene.name, variant_name(expect)))?;
            let run = row(scene, expect);
            let why = match scene.name.as_str() {
                "apf_antipodal8" => {
                    "the specification's: 2.5 s here, which a grain of dust changes, 0.02 m for clearances"
                }
                _ => "the specification's: 0.3 s for arrival times, 0.02 m for clearances",
            };
            rows.about("specification, section 4", format!("scene {}: {}", scene.name, run.words()), why);
            compare(rows, scene, expect, &run.run());
        }
    }
    rows.begin("aid against deadlock")?;
    aid(rows);
    rows.begin("forces over time")?;
    forces::rows(rows);
    ControlFlow::Continue(())
}

/// The scenes in which several robots meet each other and obstacles.
const TRAFFIC: [&str; 3] = ["apf_cross4", "apf_dynamic", "apf_antipodal8"];

/// What the abstract and the introduction claim, under the law as it is printed.
fn claims(rows: &mut Rows<'_>) {
    let runs = TRAFFIC.map(|name| run(scene(name), "literal", BodyKind::Point).run());
    rows.about(
        "abstract and introduction; specification, section 1",
        "scenes apf_cross4, apf_dynamic and apf_antipodal8 (15 point robots): planner decentralized-apf as printed \
         (eta = 1, bracket_power = 2, distance = centre, attract_cap = 0)",
        "a claim in words: it holds in every scene or it does not",
    );
    let robots: usize = runs.iter().map(|run| run.bodies().len()).sum();
    let arrived: usize = runs.iter().flat_map(|run| &run.arrival_ticks).flatten().count();
    let item = Item::new("claim: every robot reaches its goal without a supervisor (the paper's own law)");
    let ours = format!("{arrived} of {robots} robots arrive");
    let sentence =
        format!("Without a supervisor {arrived} of {robots} robots reach their goals in three scenes of traffic.");
    let printed = "every robot plans its own path, without a supervisor";
    rows.claim(item.against_paper(printed, "all", arrived == robots).headline(sentence), ours);
    let least = |of: fn(&Stepper) -> f64| runs.iter().map(of).fold(f64::INFINITY, f64::min);
    let (robots_m, obstacles_m) = (least(|run| run.robots.clearance_m), least(|run| run.obstacles.clearance_m));
    let item = Item::new("claim: collisions are avoided (the paper's own law)");
    let ours = format!("least clearance {robots_m:.3} m of robots, {obstacles_m:.3} m of obstacles");
    let sentence = match obstacles_m < 0.0 {
        true => format!(
            "The law as printed does not avoid collisions: robots pass with {robots_m:.3} m, and overlap obstacles by \
             {:.3} m.",
            -obstacles_m
        ),
        false => format!("No body touches another one: {ours}."),
    };
    let holds = robots_m >= 0.0 && obstacles_m >= 0.0;
    let printed = "collision avoidance in a very dynamic workspace";
    rows.claim(item.against_paper(printed, "none overlaps", holds).headline(sentence), ours);
}

/// A rule set of the paper for a kind of body. The recommended one is what the planner has by default.
pub fn run(scene: &Scene, set: &str, kind: BodyKind) -> Run {
    let run = match set {
        "recommended" => Run::of(scene, "decentralized-apf", &[("attract_cap", ParamValue::Float(1.0))]),
        "literal" => Run::of(scene, "decentralized-apf", &literal(1.0, 2)),
        other => panic!("{}: unknown parameter set `{other}`", scene.name),
    };
    run.each(|robot| robot.kind = kind)
}

fn row(scene: &Scene, expect: &Expectation) -> Run {
    let (set, kind) = match expect.method.as_str() {
        "recommended-point" => ("recommended", BodyKind::Point),
        "recommended-differential" => ("recommended", BodyKind::Unicycle),
        "literal-point" => ("literal", BodyKind::Point),
        other => panic!("{}: unknown rule set `{other}`", scene.name),
    };
    let run = run(scene, set, kind);
    let rules = Rules { delay_ticks: expect.delay_ticks as usize, ..run.rules };
    run.under(rules)
}

fn variant_name(expect: &Expectation) -> String {
    match expect.delay_ticks {
        0 => expect.method.clone(),
        ticks => format!("{}, poses {ticks} ticks old", expect.method),
    }
}

fn compare(rows: &mut Rows<'_>, scene: &Scene, expect: &Expectation, outcome: &Stepper) {
    let item = |what: &str| Item::new(format!("{} {}: {what}", scene.name, variant_name(expect)));
    let arrives = expect.get(Keys::arrives).unwrap_or_default();
    for key in expect.results() {
        if key.is(Keys::arrives) {
            // Where all arrive, their times say it.
            if !arrives {
                rows.exact(item("arrives"), false, outcome.all_arrived());
            }
        } else if key.is(Keys::arrival_times_s) {
            let tolerance = if scene.name == "apf_antipodal8" { 2.5 } else { 0.3 };
            let times = expect.get(Keys::arrival_times_s).unwrap_or_default();
            for (i, expected) in times.into_iter().enumerate().filter(|(_, time_s)| *time_s >= 0.0) {
                let item = item(&format!("arrival of robot {i}"));
                rows.number(item, expected, tidy(outcome.arrival_s(i).unwrap_or(-1.0)), tolerance, "s");
            }
        } else if key.is(Keys::min_robot_clearance_m) {
            let found = tidy(outcome.robots.clearance_m);
            rows.number(item("robot clearance"), expect.number(key).unwrap_or_default(), found, 0.02, "m");
        } else if key.is(Keys::min_obstacle_clearance_m) {
            let found = tidy(outcome.obstacles.clearance_m);
            rows.number(item("obstacle clearance"), expect.number(key).unwrap_or_default(), found, 0.02, "m");
        } else if key.is(Keys::end_m) {
            // The worked examples have those of this rule set to six digits.
            let ends = expect.get(Keys::end_m).filter(|_| expect.method != "recommended-point");
            for (i, end) in ends.unwrap_or_default().into_iter().enumerate() {
                let item =
                    item(&format!("end of robot {i}")).why("ours, the specification gives none: one tick of motion");
                rows.vector(item, end.into(), outcome.end(i).map(tidy).into(), 0.05, "m");
            }
        } else {
            let item = item(plain(key.name())).note("nothing here knows this key");
            rows.exact(item, "compared", "not compared");
        }
    }
}

/// A point robot of radius 0.2 m at the origin, and what it is asked to do.
struct Example {
    goal: [f64; 2],
    discs: Vec<([f64; 2], f64)>,
    robots: Vec<[f64; 2]>,
}

impl Example {
    fn plan(&self, params: &[(&str, ParamValue)]) -> Plan {
        let values: ParamValues = params.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        let method = find("decentralized-apf").expect("the method exists");
        let identity = Identity { seed: 1, robot: 0, incarnation: 0 };
        let mut planner = (method.build)(&values, identity).unwrap_or_else(|problem| panic!("{problem}"));
        let discs = self.discs.iter().zip(0..);
        let obstacles: Vec<Obstacle> = discs.map(|(disc, id)| disc_at(id, disc.0.into(), disc.1)).collect();
        let neighbors: Vec<Neighbor> = self.robots.iter().zip(1..).map(|(robot, id)| still(id, *robot)).collect();
        planner.plan(&PlanInput { radius_m: 0.2, neighbors: &neighbors, ..at_origin(self.goal.into(), &obstacles) })
    }
}

/// A robot of radius 0.2 m that stands still and spoke just now.
fn still(id: u32, position: [f64; 2]) -> Neighbor {
    Neighbor {
        id,
        position: position.into(),
        yaw_rad: 0.0,
        velocity: Vector2::zeros(),
        radius_m: 0.2,
        age_s: 0.0,
        remaining_m: 1.0,
        arrived: false,
        stopped: false,
        next: None,
        intent: None,
    }
}

/// The law with distances between centres and without limit of the pull; as the paper prints it with `eta` 1, `power` 2.
fn literal(eta: f64, power: i64) -> [(&'static str, ParamValue); 4] {
    [
        ("eta", ParamValue::Float(eta)),
        ("bracket_power", ParamValue::Int(power)),
        ("distance", ParamValue::Choice("centre".to_owned())),
        ("attract_cap", ParamValue::Float(0.0)),
    ]
}

/// Section 5 of the specification, 1 to 5.
fn examples(rows: &mut Rows<'_>) {
    rows.about(
        "paper, equations (2), (4), (6), (8); specification, section 5, checks 1 to 5",
        "a single plan of decentralized-apf for a robot of radius 0.2 m at the origin",
        "six digits after the point are printed",
    );
    let far = [3.0, 4.0];
    let alone = Example { goal: far, discs: Vec::new(), robots: Vec::new() };
    let pull = |params: &[(&str, ParamValue)]| alone.plan(params).attractive.into();
    rows.vector(Item::new("example 1: attraction"), far, pull(&literal(1.0, 2)), PRINTED, "m/s");
    rows.vector(Item::new("example 1: attraction with its limit"), [0.6, 0.8], pull(&[]), PRINTED, "m/s");

    for (eta, power, p, size) in [
        (1.0, 1, 0.5, 4.0),
        (1.0, 2, 0.5, 4.0),
        (0.1, 1, 0.5, 0.4),
        (1.0, 1, 0.4, 9.375),
        (1.0, 2, 0.4, 14.0625),
        (1.0, 1, 1.0, 0.0),
        (1.0, 2, 1.0, 0.0),
    ] {
        let scene = Example { goal: [9.0, 0.0], discs: vec![([0.0, -p], 0.3)], robots: Vec::new() };
        let item = Item::new(format!("example 2: repulsion, eta {eta}, bracket to the power {power}, p {p} m"));
        rows.number(item, size, tidy(scene.plan(&literal(eta, power)).repulsive.norm()), PRINTED, "m/s");
    }

    for (example, power, disc, robot, sum) in [
        (3, 2, [-1.234568, 0.0], [0.0, 0.097656], [1.765432, 4.097656]),
        (4, 1, [-1.851852, 0.0], [0.0, 0.390625], [1.148148, 4.390625]),
    ] {
        let scene = |discs: bool, robots: bool| Example {
            goal: far,
            discs: if discs { vec![([0.6, 0.0], 0.3)] } else { Vec::new() },
            robots: if robots { vec![[0.0, -0.8]] } else { Vec::new() },
        };
        let mut term = |what: &str, printed: [f64; 2], ours: Vector2<f64>| {
            let item = Item::new(format!("example {example}: the paper's law, power {power}: {what}"));
            rows.vector(item, printed, ours.map(tidy).into(), PRINTED, "m/s");
        };
        let params = literal(1.0, power);
        let both = scene(true, true).plan(&params);
        term("obstacle", disc, scene(true, false).plan(&params).repulsive);
        term("robot", robot, scene(false, true).plan(&params).repulsive);
        term("sum", sum, both.attractive + both.repulsive);
    }

    let plan = Example { goal: far, discs: vec![([0.9, 0.0], 0.3)], robots: vec![[0.0, -0.8]] }.plan(&[]);
    let Drive::Velocity(velocity) = plan.drive else { panic!("a point robot is asked for a velocity") };
    for (what, printed, ours) in [
        ("attraction", [0.6, 0.8], plan.attractive),
        ("repulsion", [-0.9375, 0.9375], plan.repulsive),
        ("sum", [-0.3375, 1.7375], plan.attractive + plan.repulsive),
        ("velocity", [-0.190681, 0.981652], velocity),
    ] {
        let item = Item::new(format!("example 5: recommended law: {what}"));
        rows.vector(item, printed, ours.map(tidy).into(), PRINTED, "m/s");
    }
}

/// Section 5 of the specification, 6 to 8.
fn places_of_rest(rows: &mut Rows<'_>) {
    rows.about(
        "specification, section 5, checks 6 to 8",
        "where the robots of the scene stand at its end: decentralized-apf, recommended parameters, point robots",
        "six digits after the point are printed",
    );
    let rest = |name: &str| run(scene(name), "recommended", BodyKind::Point).run();
    let mut place = |what: &str, printed: [f64; 2], outcome: &Stepper, robot: usize| {
        let item = Item::new(format!("{what}, robot {robot}"));
        rows.vector(item, printed, outcome.end(robot).map(tidy).into(), PRINTED, "m");
    };
    let (headon, trap, close) = (rest("apf_headon"), rest("apf_two_disc_trap"), rest("apf_close_goals_05"));
    let half = (0.393003 + 0.4) / 2.0;
    place("example 6: stand-off in apf_headon", [3.0 - half, 0.0], &headon, 0);
    place("example 6: stand-off in apf_headon", [3.0 + half, 0.0], &headon, 1);
    place("example 7: rest in apf_two_disc_trap", [2.227849, 0.0], &trap, 0);
    place("example 8: rest in apf_close_goals_05", [5.0, 0.484381], &close, 0);
    place("example 8: rest in apf_close_goals_05", [5.0, -0.484381], &close, 1);
}

/// Section 6 of the specification: the optional aid frees both traps.
fn aid(rows: &mut Rows<'_>) {
    rows.about(
        "specification, section 6, deadlock on the axis",
        "decentralized-apf, recommended parameters and aid = true, point robots",
        "the specification's for arrival times",
    );
    for (name, force, push_s, expected_s) in [("apf_headon", 0.2, 1.0, 9.15), ("apf_two_disc_trap", 0.5, 3.0, 14.4)] {
        let run = run(scene(name), "recommended", BodyKind::Point)
            .with("aid", ParamValue::Bool(true))
            .with("aid_force", ParamValue::Float(force))
            .with("aid_push_s", ParamValue::Float(push_s));
        let item = Item::new(format!("{name} recommended-point with the aid against deadlock: arrival of robot 0"))
            .note("the aid is the specification's, not the paper's");
        rows.number(item, expected_s, tidy(run.run().arrival_s(0).unwrap_or(-1.0)), 0.3, "s");
    }
}

fn series() -> Vec<Series> {
    let figures = scenes_of("apf_").flat_map(|scene| [("recommended", scene), ("literal", scene)]);
    let paths = figures.map(|(set, scene)| {
        let outcome = run(scene, set, BodyKind::Point).run();
        let lines = (0..scene.scenario.robots.len()).map(|i| (format!("robot {i}"), outcome.line(i)));
        Series::paths(
            format!("decentralized-apf-{}-{set}", scene.name),
            format!("{}: {set} law, point robots; obstacles where they start", scene.name),
            lines.collect(),
            scene.drawn(),
        )
    });
    paths.chain(forces::series()).collect()
}
