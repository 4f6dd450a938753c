//! Maps of the field's forces and potentials, and of the arm's free space; and what such a map has to show.

use super::expectations::free_space;
use super::experiment::Experiment;
use crate::field_map::Window;
use crate::row::{Form, Item, Rows, Series};
use crate::scene::{Scene, scene};
use crate::stepper::tidy;
use nalgebra::{Point2, Vector2};
use planners::pso_via_points::field::Variant;

/// From arrow to arrow, m.
const PITCH_M: f64 = 0.4;

/// Adds the figures of forces, potentials and free space.
pub(super) fn series(all: &mut Vec<Series>) {
    forces(all);
    potentials(all);
    for name in ["pso_arm_1", "pso_arm_2", "pso_arm_elbow_flip"] {
        all.push(free(scene(name)));
    }
}

/// (2), (4) and (7) in the first environment; in the second, where the plain field has a trap, what the constant force of
/// (19) and (20) makes of it.
fn forces(all: &mut Vec<Series>) {
    let mut add = |name: &str,
                   file: &str,
                   words: &str,
                   size_max: f64,
                   force: &dyn Fn(&Experiment, Point2<f64>) -> Vector2<f64>| {
        let (scene, experiment) = (scene(name), Experiment::new(scene(name)));
        let outside = |p: Point2<f64>| experiment.clearance(&[p]) > 0.0;
        let arrows = |p: Point2<f64>| outside(p).then(|| force(&experiment, p));
        let title = format!("{name}: {words}; the longest arrows are {size_max} or more");
        let at = |p: Point2<f64>| vec![[p.x, p.y]; 2];
        let lines = vec![
            ("force".to_owned(), Window::of(scene).arrows(PITCH_M, size_max, arrows)),
            ("start".to_owned(), at(experiment.start)),
            ("goal".to_owned(), at(experiment.goal)),
        ];
        let chart = Series::chart(Form::Arrows, format!("{name}_{file}"), title, ["x (m)", "y (m)"], lines);
        all.push(Series { discs: scene.drawn(), ..chart });
    };
    add("pso_mass_point_1", "force_attractive", "attractive force (2)", 12.0, &|it, p| {
        it.recipe.field.attraction(p, it.goal)
    });
    add("pso_mass_point_1", "force_repulsive", "repulsive force (5)", 4.0, &|it, p| {
        it.recipe.field.repulsion(p, it.goal, &it.bodies())
    });
    for (name, file, words, variant) in [
        ("pso_mass_point_1", "force", "force (7)", Variant::Plain),
        ("pso_mass_point_2", "force", "force (7)", Variant::Plain),
        (
            "pso_mass_point_2",
            "force_bias",
            "force with the constant part (19), (20), fading near the goal",
            Variant::FadedBias,
        ),
    ] {
        add(name, file, words, 4.0, &|it, p| it.recipe.field.force(variant, p, it.goal, &it.bodies()));
    }
}

/// (1), (3) and (6).
fn potentials(all: &mut Vec<Series>) {
    let (scene, it) = (scene("pso_mass_point_1"), Experiment::new(scene("pso_mass_point_1")));
    let mut add = |file: &str, words: &str, height_max: f64, potential: &dyn Fn(Point2<f64>) -> f64| {
        let chart = Series::chart(
            Form::Surface,
            format!("{}_{file}", scene.name),
            format!("{}: {words}", scene.name),
            ["x (m)", "y (m)"],
            Window::of(scene).surface(height_max, potential),
        );
        all.push(Series { discs: scene.drawn(), ..chart });
    };
    let field = it.recipe.field;
    let (pull, push) =
        (|p| field.attractive_potential(p, it.goal), |p| field.repulsive_potential(p, it.goal, &it.bodies()));
    add("potential_attractive", "attractive potential (1)", f64::INFINITY, &pull);
    add("potential_repulsive", "repulsive potential (3), cut at 10", 10.0, &push);
    add("potential", "potential (6), cut at 100", 100.0, &|p| pull(p) + push(p));
}

/// Where the tip can be, by sheet.
fn free(scene: &Scene) -> Series {
    let space = free_space(&Experiment::new(scene));
    let kinds = [("both elbows", [true, true]), ("elbow up only", [true, false]), ("elbow down only", [false, true])];
    let of = |kind: [bool; 2]| space.points().filter(|(_, free)| *free == kind).map(|(p, _)| [p.x, p.y]).collect();
    let lines = kinds.map(|(name, kind)| (name.to_owned(), of(kind)));
    let [up, down, both, union] = space.counts();
    let chart = Series::chart(
        Form::Dots,
        format!("{}_free_space", scene.name),
        format!(
            "{}: free positions of the tip on a grid of 0.1 m: {up} with the elbow up, {down} with the elbow down, {both} \
             with both, {union} with either",
            scene.name
        ),
        ["x (m)", "y (m)"],
        lines.into_iter().filter(|(_, points): &(String, Vec<[f64; 2]>)| !points.is_empty()).collect(),
    );
    Series { discs: scene.drawn(), ..chart }
}

/// Everywhere on the maps the force is the slope of the potential.
pub(super) fn rows(rows: &mut Rows<'_>) {
    /// Differences of the potential are taken over this distance each way, m.
    const STEP_M: f64 = 1e-5;
    for power in [0, 2] {
        let (mut worst, mut places) = (0.0f64, 0);
        for name in ["pso_mass_point_1", "pso_mass_point_2"] {
            let mut it = Experiment::new(scene(name));
            it.recipe.field.goal_power = power;
            let (field, goal) = (it.recipe.field, it.goal);
            let potential =
                |p: Point2<f64>| field.attractive_potential(p, goal) + field.repulsive_potential(p, goal, &it.bodies());
            for p in Window::of(scene(name)).places(PITCH_M).filter(|p| it.clearance(&[*p]) > 0.05) {
                let slope = |along: Vector2<f64>| (potential(p + along) - potential(p - along)) / (2.0 * STEP_M);
                let uphill = Vector2::new(slope(STEP_M * Vector2::x()), slope(STEP_M * Vector2::y()));
                let force = field.force(Variant::Plain, p, goal, &it.bodies());
                worst = worst.max((force + uphill).norm() / force.norm().max(1.0));
                places += 1;
            }
        }
        rows.about(
            "paper, equations (6) to (8); specification, section 5, check 3",
            format!(
                "maps of pso_mass_point_1 and pso_mass_point_2 with n = {power}: the force of the plain field against the \
                 slope of the potential at {places} places, one every {PITCH_M} m"
            ),
            "ours: what differences over 0.01 mm can tell apart",
        );
        let item = Item::new(format!("force map, n = {power}: largest difference from the slope, share of the force"));
        rows.number(item, 0.0, tidy(worst), 1e-6, "");
    }
}
