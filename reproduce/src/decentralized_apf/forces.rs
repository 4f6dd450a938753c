//! The forces along runs and over the plane: figures, and what the specification says about them.

use super::run;
use crate::field_map::Window;
use crate::row::{Form, Item, Line, Rows, Series};
use crate::scene::{Scene, goal, scene};
use crate::stepper::{planner, tidy};
use model::BodyKind;
use nalgebra::{Point2, Vector2};
use planners::PlanInput;

/// Length of a tick of the figures' scenes, s.
fn dt_s(scene: &Scene) -> f64 {
    scene.scenario.clock.dt_s()
}

pub(super) fn series() -> Vec<Series> {
    vec![
        over_time(scene("apf_cross4"), 0),
        over_time(scene("apf_dynamic"), 0),
        pair(scene("apf_headon_offset")),
        map(scene("apf_two_disc_trap")),
    ]
}

fn chart(scene: &Scene, file: &str, title: String, axes: [&str; 2], lines: Vec<Line>) -> Series {
    Series::chart(Form::Lines, format!("decentralized-apf-{}-{file}", scene.name), title, axes, lines)
}

/// Sizes of the three summands of a robot's force.
fn over_time(scene: &Scene, robot: usize) -> Series {
    let outcome = run(scene, "recommended", BodyKind::Point).remembering();
    let line = |name: &str, of: fn(&crate::forces::Forces) -> Vector2<f64>| {
        let forces = outcome.planners[robot].forces.iter().enumerate();
        (name.to_owned(), forces.map(|(tick, forces)| [tick as f64 * dt_s(scene), of(forces).norm()]).collect())
    };
    chart(
        scene,
        "forces",
        format!("{}: forces on robot {robot}, recommended law, point robots", scene.name),
        ["time (s)", "force (m/s)"],
        vec![
            line("goal (2)", |forces| forces.goal),
            line("obstacles (5)", |forces| forces.obstacles),
            line("robots (7)", |forces| forces.robots),
        ],
    )
}

/// What two robots that meet do to each other.
fn pair(scene: &Scene) -> Series {
    let outcome = run(scene, "recommended", BodyKind::Point).remembering();
    let line = |robot: usize, axis: usize| {
        let forces = outcome.planners[robot].forces.iter().enumerate();
        let name = format!("on robot {robot}, along {}", ["x", "y"][axis]);
        (name, forces.map(|(tick, forces)| [tick as f64 * dt_s(scene), forces.robots[axis]]).collect())
    };
    chart(
        scene,
        "forces",
        format!("{}: force of the other robot (6), recommended law, point robots", scene.name),
        ["time (s)", "force (m/s)"],
        vec![line(0, 0), line(1, 0), line(0, 1), line(1, 1)],
    )
}

/// The force of a robot at every place.
fn map(scene: &Scene) -> Series {
    let run = run(scene, "recommended", BodyKind::Point);
    let robot = &run.scenario.robots[0];
    let discs = scene.discs();
    let force = |position: Point2<f64>| {
        let clear = discs.iter().all(|disc| disc.shape.distance(position) > robot.radius_m);
        let input = PlanInput { position, radius_m: robot.radius_m, ..crate::example::at_origin(goal(robot), &discs) };
        let plan = planner(1, 0, robot).plan(&input);
        clear.then_some(plan.attractive + plan.repulsive)
    };
    let window = Window { x_m: [-0.4, 6.6], y_m: [-2.0, 2.0] };
    let at = |place: Point2<f64>| vec![[place.x, place.y]; 2];
    let chart = Series::chart(
        Form::Arrows,
        format!("decentralized-apf-{}-force", scene.name),
        format!(
            "{}: force on a robot of radius {} m; the longest arrows are 1 m/s or more",
            scene.name, robot.radius_m
        ),
        ["x (m)", "y (m)"],
        vec![
            ("force".to_owned(), window.arrows(0.2, 1.0, force)),
            ("start".to_owned(), at(robot.start)),
            ("goal".to_owned(), at(goal(robot))),
            ("where it comes to rest".to_owned(), at(run.run().end(0))),
        ],
    );
    Series { discs: scene.drawn(), ..chart }
}

/// What holds all along the runs.
pub(super) fn rows(rows: &mut Rows<'_>) {
    rows.about(
        "specification, section 5, qualitative",
        "the forces of every plan along the runs of apf_cross4, apf_antipodal8 and apf_headon_offset: decentralized-apf, \
         recommended parameters, point robots",
        "ours: rounding",
    );
    let names = ["apf_cross4", "apf_antipodal8", "apf_headon_offset"];
    let runs = names.map(|name| (scene(name), run(scene(name), "recommended", BodyKind::Point).remembering()));
    let (mut unbalanced, mut strongest) = (0.0f64, 0.0f64);
    let mut aside_m = 0.0f64;
    let mut ticks = 0;
    for (scene, outcome) in &runs {
        // All robots are alike and hear each other fresh, so that what they do to each other adds up to nothing.
        let planned = outcome.planners.iter().map(|planner| planner.forces.len()).min().unwrap_or(0);
        for tick in 0..planned {
            let pushes = || outcome.planners.iter().map(|planner| planner.forces[tick].robots);
            unbalanced = unbalanced.max(pushes().sum::<Vector2<f64>>().norm());
            strongest = strongest.max(pushes().map(|push| push.norm()).fold(0.0, f64::max));
        }
        for (robot, planner) in scene.scenario.robots.iter().zip(&outcome.planners) {
            let along = (goal(robot) - robot.start).normalize();
            let free = |forces: &&crate::forces::Forces| forces.obstacles + forces.robots == Vector2::zeros();
            for forces in planner.forces.iter().take_while(free) {
                aside_m = aside_m.max(along.perp(&(forces.position - robot.start)).abs());
                ticks += 1;
            }
        }
    }
    let item = Item::new("forces over time: what the robots do to each other adds up to")
        .note(format!("the strongest of these pushes is {strongest:.3} m/s"));
    let unbalanced = if strongest > 0.0 { tidy(unbalanced) } else { f64::NAN };
    rows.number(item, 0.0, unbalanced, 1e-9, "m/s");
    let item = Item::new("forces over time: until the first push, distance from the straight line to the goal")
        .note(format!("{ticks} plans"));
    let aside_m = if ticks > 0 { tidy(aside_m) } else { f64::NAN };
    rows.number(item, 0.0, aside_m, 1e-9, "m");
}
