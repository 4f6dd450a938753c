//! The forces over the plane and along the demonstrations: figures, and what they have to show.
//!
//! A map asks for the force on a robot at every place of a grid; it looks at its goal there, as it does on its way.

use super::layouts::{demos, radii_m};
use super::replay::{Program, amr, dapf};
use crate::field_map::Window;
use crate::forces::Remembering;
use crate::row::{Form, Item, Line, Rows, Series};
use crate::scene::Scene;
use crate::stepper::Stepper;
use nalgebra::{Point2, Rotation2, Vector2};
use planners::amr_apf::clusters::{Crowd, Member, crowd, force as crowd_force};
use planners::amr_apf::field::{Other, Own, Sight, obstacle, robot};
use planners::amr_apf::{Params, Preset, trap};
use planners::dapf::Variant;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Forces of this size, that of the pull, have the longest arrows.
const C_A: f64 = 4.0;
/// Where the thing of a map is.
const THING: Point2<f64> = Point2::new(0.0, 0.0);
/// The goal of the maps of one thing.
const GOAL: Point2<f64> = Point2::new(1.4, 0.0);
/// What the maps of one thing show, and how densely, m.
const WINDOW: Window = Window { x_m: [-1.2, 1.2], y_m: [-1.2, 1.2] };
const PITCH_M: f64 = 0.1;

/// A preset with sgn(0) = 1, so that no place of a grid is on no side.
fn preset(preset: Preset) -> Params {
    Params { sgn_zero: false, ..Params::of(preset) }
}

/// ρ of obstacles and of robots.
fn rho(params: &Params) -> [f64; 2] {
    let (robot, pillar) = radii_m(params.preset == Preset::H);
    [robot + pillar + params.safety_m, 2.0 * robot + params.safety_m]
}

/// A robot at a place of a map.
fn own(position: Point2<f64>, goal: Point2<f64>) -> Own {
    let to_goal = goal - position;
    Own { position, heading_rad: to_goal.y.atan2(to_goal.x), goal, sgn_zero: false }
}

fn world(own: &Own, force: Vector2<f64>) -> Vector2<f64> {
    Rotation2::new(own.heading_rad) * force
}

/// The force of a pillar, its radial part (2) and its tangential part (3), in the world frame.
fn pillar(params: &Params, position: Point2<f64>) -> (Sight, [Vector2<f64>; 2]) {
    let (own, rho) = (own(position, GOAL), rho(params)[0]);
    let sight = own.sight(THING, 0.0);
    let all = world(&own, obstacle(params, &own, THING, rho, 0.0, false));
    let radial = (position - THING).try_normalize(0.0).unwrap_or_default() * params.push(sight.distance_m, rho);
    (sight, [radial, all - radial])
}

/// The same of a robot that comes from where our goal is.
fn other_robot(params: &Params, position: Point2<f64>, right_of_way: bool) -> (Sight, [Vector2<f64>; 2]) {
    let (own, rho_m) = (own(position, GOAL), rho(params)[1]);
    let other = Other { position: THING, heading_rad: PI, parked: false, right_of_way, rho_m, apart_rad: 0.0 };
    let sight = own.sight(THING, 0.0);
    let all = world(&own, robot(params, &own, &other).force);
    let radial = (position - THING).try_normalize(0.0).unwrap_or_default() * params.push(sight.distance_m, rho_m);
    (sight, [radial, all - radial])
}

pub(super) fn series() -> Vec<Series> {
    let p = preset(Preset::P);
    let [rho_o, rho_r] = rho(&p);
    let outside = |position: Point2<f64>, radius_m: f64| (position - THING).norm() > radius_m;
    let of_pillar = |file: &str, words: &str, params: &Params, part: &dyn Fn([Vector2<f64>; 2]) -> Vector2<f64>| {
        let force = |at| outside(at, 0.11).then(|| part(pillar(params, at).1));
        map(file, words, rho(params)[0], &[[0.0, 0.0, 0.11]], GOAL, WINDOW.arrows(PITCH_M, C_A, force))
    };
    let of_robot = |file: &str, words: &str, right_of_way: bool| {
        let sum = |at| other_robot(&p, at, right_of_way).1.iter().sum();
        let force = |at| outside(at, 0.22).then(|| sum(at));
        map(file, words, rho_r, &[[0.0, 0.0, 0.22]], GOAL, WINDOW.arrows(PITCH_M, C_A, force))
    };
    let h = preset(Preset::H);
    let mut all = vec![
        of_pillar("pillar-radial", "repulsion of a pillar (2)", &p, &|[radial, _]| radial),
        of_pillar("pillar-tangential", "tangential force of a pillar (3), P", &p, &|[_, tangential]| tangential),
        of_pillar("pillar", "force of a pillar (4), P", &p, &|parts| parts.iter().sum()),
        of_pillar("pillar-h", "force of a pillar (4), H", &h, &|parts| parts.iter().sum()),
        sizes(),
        of_robot("robot-first", "force of a robot that comes from the goal (7), P, which has no right of way", false),
        of_robot("robot-second", "force of a robot that comes from the goal (7), P, which has right of way", true),
        gate(&p, [rho_o, rho_r]),
        crowd_map(&p),
    ];
    let files = ["single", "head-on", "crossing", "gate"];
    all.extend(demos().iter().zip(files).map(|(layout, file)| along(layout, file)));
    all
}

/// A map. The dots are ρ and 2ρ around the thing.
fn map(file: &str, words: &str, rho: f64, discs: &[[f64; 3]], goal: Point2<f64>, arrows: Vec<[f64; 2]>) -> Series {
    let ring = |radius_m: f64| {
        let dot = |i: u32| [f64::from(i) * TAU / 90.0; 2].map(|angle| [radius_m * angle.cos(), radius_m * angle.sin()]);
        (0..90).flat_map(dot).collect()
    };
    let lines: Vec<Line> = vec![
        ("force".to_owned(), arrows),
        ("ρ".to_owned(), ring(rho)),
        ("2ρ".to_owned(), ring(2.0 * rho)),
        ("goal".to_owned(), vec![[goal.x, goal.y]; 2]),
    ];
    let title = format!("AMR-APF: {words}; the longest arrows are {C_A} or more");
    let chart = Series::chart(Form::Arrows, format!("amr-apf-force-{file}"), title, ["x (m)", "y (m)"], lines);
    Series { discs: discs.to_vec(), ..chart }
}

/// Sizes of the parts over the distance, dead ahead of the goal.
fn sizes() -> Series {
    let line = |name: &str, params: &Params, part: usize| {
        let rho = rho(params)[0];
        let size = |i: u32| {
            let d = rho * (0.7 + 0.005 * f64::from(i));
            [d / rho, pillar(params, Point2::new(-d, 0.0)).1[part].norm()]
        };
        (name.to_owned(), (0..=300).map(size).collect())
    };
    let [c1, p, h] = [Preset::C1, Preset::P, Preset::H].map(preset);
    Series::chart(
        Form::Lines,
        "amr-apf-force-sizes",
        "AMR-APF: sizes of the forces of a pillar dead ahead over the distance of the centres; the pull of the goal is 4",
        ["distance (ρ)", "force"],
        vec![
            line("repulsion (2)", &p, 0),
            line("tangential (3), H: also within ρ", &h, 1),
            line("tangential (3), P", &p, 1),
            line("tangential (3), C1", &c1, 1),
        ],
    )
}

/// The virtual obstacle of (9) between a parked robot and a pillar: its force alone.
fn gate(params: &Params, [rho_o, rho_r]: [f64; 2]) -> Series {
    let (parked, pillar) = (Point2::new(0.0, -0.3), Point2::new(0.0, 0.3));
    let found = trap(params, parked, pillar, rho_r, rho_o, radii_m(false).0).expect("they are near enough");
    let other = Other {
        position: found.center,
        heading_rad: 0.0,
        parked: true,
        right_of_way: false,
        rho_m: found.rho_m,
        apart_rad: 0.0,
    };
    let force = |at: Point2<f64>| {
        let own = own(at, GOAL);
        ((at - parked).norm() > 0.22 && (at - pillar).norm() > 0.11)
            .then(|| world(&own, robot(params, &own, &other).force))
    };
    let discs = [[parked.x, parked.y, 0.22], [pillar.x, pillar.y, 0.11]];
    let words = "force of the virtual obstacle between a parked robot and a pillar (9), P";
    map("gate", words, found.rho_m, &discs, GOAL, WINDOW.arrows(0.05, C_A, force))
}

/// Robots that stand about the middle of a map.
const CROWD: [[f64; 2]; 4] = [[-0.5, -0.2], [0.2, -0.35], [0.35, 0.4], [-0.3, 0.45]];

/// Where the virtual obstacle of (10) is, and its force on a robot at a place.
fn around(params: &Params, position: Point2<f64>) -> Option<(Point2<f64>, f64, Own, Vector2<f64>)> {
    let own = own(position, Point2::new(3.2, 0.0));
    let members = CROWD.map(|at| Member { position: at.into(), arrived: false });
    match crowd(params, &own, radii_m(false).0, &members) {
        Crowd::Around { center, rho_m } => {
            Some((center, rho_m, own, world(&own, crowd_force(params, &own, center, rho_m, false))))
        }
        _ => None,
    }
}

const CROWD_WINDOW: Window = Window { x_m: [-3.0, 3.0], y_m: [-3.0, 3.0] };

fn crowd_map(params: &Params) -> Series {
    let free = |at: Point2<f64>| CROWD.iter().all(|member| (at - Point2::from(*member)).norm() > 0.22);
    let force = |at: Point2<f64>| around(params, at).filter(|_| free(at)).map(|(.., force)| force);
    let arrows = CROWD_WINDOW.arrows(0.25, 2.0 * C_A, force);
    let (center, rho_m, ..) = around(params, Point2::new(-3.0, 0.0)).expect("it is outside");
    let ring = |radius_m: f64| {
        let dot = |i: u32| {
            let (sin, cos) = (f64::from(i) * TAU / 90.0).sin_cos();
            [[center.x + radius_m * cos, center.y + radius_m * sin]; 2]
        };
        (0..90).flat_map(dot).collect()
    };
    let chart = Series::chart(
        Form::Arrows,
        "amr-apf-force-crowd",
        format!(
            "AMR-APF: force of the virtual obstacle around a crowd (10), P; the longest arrows are {} or more",
            2.0 * C_A
        ),
        ["x (m)", "y (m)"],
        vec![
            ("force".to_owned(), arrows),
            ("ρ".to_owned(), ring(rho_m)),
            ("2ρ".to_owned(), ring(2.0 * rho_m)),
            ("goal".to_owned(), vec![[3.2, 0.0]; 2]),
        ],
    );
    Series { discs: CROWD.iter().map(|[x, y]| [*x, *y, 0.22]).collect(), ..chart }
}

/// A demonstration, a hair off its symmetry, with the forces of every plan.
fn remembered(layout: &Scene, program: &Program) -> Stepper<Remembering> {
    let program = program.clone().for_seconds(100.0);
    let layout = super::unsymmetrical(layout);
    let mut stepper = program.stepper(&layout, |slot| Remembering::new(program.planner(slot), program.planner(slot)));
    stepper.run(program.steps_max);
    stepper
}

/// The force on the first robot of a demonstration, forward and to the left.
fn along(layout: &Scene, file: &str) -> Series {
    let mut lines = Vec::new();
    for (name, program) in [("AMR-APF P", amr(Preset::P)), ("DAPF max4", dapf(Variant::Max4))] {
        let outcome = remembered(layout, &program);
        for (side, axis) in [("forward", 0), ("to the left", 1)] {
            let forces = outcome.planners[0].forces.iter().enumerate();
            let point = |(tick, forces): (usize, &crate::forces::Forces)| {
                [tick as f64 * program.dt_s, forces.in_body_frame()[axis]]
            };
            lines.push((format!("{name}, {side}"), forces.map(point).collect()));
        }
    }
    Series::chart(
        Form::Lines,
        format!("amr-apf-demo-{file}-forces"),
        format!("{}: force on the first robot over time; the pull alone is {C_A}", layout.name),
        ["time (s)", "force"],
        lines,
    )
}

/// How many of the places that the maps show are as the specification says.
#[derive(Default)]
struct Places {
    right: usize,
    all: usize,
}

impl Places {
    fn add(&mut self, right: bool) {
        (self.right, self.all) = (self.right + usize::from(right), self.all + 1);
    }

    fn row(&self, rows: &mut Rows<'_>, item: Item) {
        let specified = format!("all of {}", self.all);
        let ours = format!(
            "{} of {}",
            if self.right == self.all { "all".to_owned() } else { self.right.to_string() },
            self.all
        );
        rows.push(item, Some(specified), ours, "exact".to_owned(), self.right == self.all && self.all > 0);
    }
}

pub(super) fn rows(rows: &mut Rows<'_>) {
    rows.about(
        "paper, equations 2 to 10, as far as legible; specification, sections 3.2, 3.4 and 3.6",
        "the functions of planner amr-apf on the grid of the force maps, the robot looking at its goal",
        "exact: where a force acts, and to which side",
    );
    for (name, which) in [("P", Preset::P), ("H", Preset::H)] {
        let params = preset(which);
        let rho = rho(&params)[0];
        let (mut reach, mut acts, mut side) = (Places::default(), Places::default(), Places::default());
        for at in WINDOW.places(PITCH_M).filter(|at| (at - THING).norm() > 0.11) {
            let (sight, [radial, tangential]) = pillar(&params, at);
            let d = sight.distance_m;
            reach.add((radial + tangential != Vector2::zeros()) == (d < 2.0 * rho));
            let is_there = tangential.norm() > 1e-6;
            let in_ring = d > rho && (d < 1.5 * rho || sight.psi.abs() < FRAC_PI_2);
            acts.add(
                is_there
                    == match which {
                        Preset::H => d < 2.0 * rho && sight.beta.abs() <= FRAC_PI_2,
                        _ => d < 2.0 * rho && in_ring && sight.gamma > FRAC_PI_2 / 2.0,
                    },
            );
            if is_there {
                // Round the pillar on the side on which the goal is; with the goal exactly behind it, on the left.
                let left = (THING - at).perp(&tangential) > 0.0;
                side.add(left == (sight.beta >= 0.0));
            }
        }
        let item = |what: &str| Item::new(format!("force map of a pillar, {name}: places where {what}"));
        reach.row(rows, item("there is a force within 2ρ and none beyond"));
        acts.row(rows, item("the tangential force acts or does not, as specified"));
        side.row(rows, item("the tangential force leads round on the side of the goal"));
    }
    let params = preset(Preset::P);
    let (mut turned, mut reversed) = (Places::default(), 0);
    for at in WINDOW.places(PITCH_M).filter(|at| (at - THING).norm() > 0.22) {
        let (sight, [_, first]) = other_robot(&params, at, false);
        let (_, [_, second]) = other_robot(&params, at, true);
        if first.norm() > 1e-6 {
            // It heads for -x: how it sees us.
            let seen = planners::amr_apf::field::wrap(sight.theta - PI - PI);
            let hands_differ = -sight.psi * seen < 0.0;
            let expected = if hands_differ { -first } else { first };
            reversed += usize::from(hands_differ);
            turned.add((second - expected).norm() < 1e-9);
        }
    }
    let item = Item::new("force map of a robot, P: places where right of way turns the tangential force round, or not")
        .note(format!("turned round where the two would turn into each other: {reversed} places"));
    // Without a place where it is, there is nothing to see.
    let turned = if reversed > 0 { turned } else { Places::default() };
    turned.row(rows, item);
    let mut oblique = Places::default();
    for at in CROWD_WINDOW.places(0.25) {
        let Some((center, rho_m, own, force)) = around(&params, at) else { continue };
        let (sight, d) = (own.sight(center, 0.0), (center - at).norm());
        if d >= 2.0 * rho_m {
            oblique.add(force == Vector2::zeros());
            continue;
        }
        let to_center = (center - at).normalize();
        let angle = (to_center.dot(&force) / force.norm()).clamp(-1.0, 1.0).acos().to_degrees();
        let round = sight.gamma > 36f64.to_radians() && d > 0.8 * rho_m;
        oblique.add((angle - if round { 112.5 } else { 180.0 }).abs() < 1e-4);
    }
    let item = Item::new(
        "force map of a crowd, P: places where the force is 112.5 degrees off the centre, straight away, or none",
    );
    oblique.row(rows, item);
    stops(rows);
}

/// What the tangential force is for: no stop and turn before an obstacle.
fn stops(rows: &mut Rows<'_>) {
    let layout = &demos()[0];
    let seconds = |program: &Program| {
        let outcome = remembered(layout, program);
        let back = outcome.planners[0].forces.iter().filter(|forces| forces.in_body_frame().x < 0.0).count();
        back as f64 * program.dt_s
    };
    let [ours, base] = [amr(Preset::P), dapf(Variant::Max4)].map(|program| seconds(&program));
    let item = Item::new("claim: no stop and turn before a pillar")
        .against_paper("no stop and turn", "none for AMR-APF, some for DAPF", ours == 0.0 && base > 0.0)
        .source("paper, the new obstacle force; specification, section 1")
        .method(
            "demonstration of figure 4, a hair off its symmetry: how long the force on the robot points back, and it stands or \
             turns on the spot; presets p and DAPF max4",
        )
        .note("DAPF is the paper's baseline");
    rows.claim(item, format!("{ours:.1} s with AMR-APF, {base:.1} s with DAPF"));
}
