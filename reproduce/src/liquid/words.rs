//! What the specification says about the experiments beside the expectations of the files, and what the paper prints.

use super::drive::{Descent, Order, Setup, ends, khatib, tail_extent};
use crate::row::{Item, Rows};
use crate::scene::{Scene, scene, scenes_of};
use crate::stepper::tidy;
use geometry::Capsule;
use model::{Obstacle, ParamValue, ParamValues, Shape};
use nalgebra::{Point2, Vector2};
use planners::liquid::{Budget, Progress, Search};
use scenarios::{Expectation, Results as Keys};
use std::ops::ControlFlow;

/// The numbers that the paper prints for the experiment that a scene stands in for.
pub(super) fn printed(scene: &str, method: &str, key: &str) -> Option<&'static str> {
    Some(match (scene, method, key) {
        ("liquid_two_obstacles", "liquid-offline", "virtual_obstacles") => "4 (Ex. 1 case 2)",
        ("liquid_u_trap", "liquid-offline", "virtual_obstacles") => "10 (Ex. 2 case 1)",
        ("liquid_u_trap", "liquid-offline", "computation_rounds") => "288 (Ex. 2 case 1)",
        ("liquid_u_trap", "liquid-offline", "motion_steps") => "35 (Ex. 2 case 1)",
        ("liquid_u_trap", "liquid-online", "virtual_obstacles") => "16 (Ex. 2 case 1)",
        ("liquid_u_trap", "liquid-online", "motion_steps") => "81 (Ex. 2 case 1)",
        ("liquid_gap", "liquid-offline", "virtual_obstacles") => "4 (Ex. 2 case 2)",
        ("liquid_gap", "liquid-offline", "computation_rounds") => "110 (Ex. 2 case 2)",
        ("liquid_gap", "liquid-offline", "motion_steps") => "47 (Ex. 2 case 2)",
        ("liquid_gap", "liquid-online", "virtual_obstacles") => "2 (Ex. 2 case 2)",
        ("liquid_gap", "liquid-online", "motion_steps") => "33 (Ex. 2 case 2)",
        _ => return None,
    })
}

/// By how much a straight step with both ends outside a disc of radius 0.3 m may cut into it, m: section 5.
const CUT_M: f64 = 0.004;

/// What the paper claims in words, in the scenes that stand for its maps.
pub(super) fn claims(rows: &mut Rows<'_>) {
    rows.about(
        "paper, examples 1 and 2; specification, section 4",
        "a stand-in for the paper's map, which is a figure without coordinates: planners liquid (thinks first) and \
         liquid-online (the modified variant) with the paper's gains; field: planner apf with the specification's gains",
        "a claim in words",
    );
    let mut claim = |name: &str, words: &str, ok: bool, ours: String, sentence: String| {
        let item = Item::new(format!("claim: {name}")).against_paper(words, "in words", ok);
        rows.claim(item.note("in a stand-in for the paper's map").headline(sentence), ours);
    };
    let fields = |name: &str| [Order::Second, Order::First].map(|order| khatib(scene(name), order));
    let word = |arrives: bool| if arrives { "arrives" } else { "does not arrive" };

    let (thinks, field) = (unchanged("liquid_free").offline().arrives, fields("liquid_free")[0].all_arrived());
    let ours = format!("liquid {}, the field {}", word(thinks), word(field));
    let sentence = format!("Without a local minimum liquid {}, and the field {}.", word(thinks), word(field));
    claim("Ex. 1 case 1, no local minimum (liquid_free)", "both arrive", thinks && field, ours, sentence);

    for (name, map, words, place) in [
        (
            "Ex. 1 case 2, local minimum (liquid_two_obstacles)",
            "liquid_two_obstacles",
            "arrives with virtual obstacles; the field stops in the minimum",
            "Between two obstacles",
        ),
        (
            "Ex. 1 case 3, obstacles near the goal (liquid_near_goal)",
            "liquid_near_goal",
            "arrives; the field stops before the goal",
            "At a goal near obstacles",
        ),
        (
            "Ex. 1 case 4, a surrounded goal (liquid_ring_side)",
            "liquid_ring_side",
            "arrives; the field stops",
            "At a goal in a ring of obstacles",
        ),
    ] {
        let (thinks, field) = (unchanged(map).offline().arrives, fields(map).map(|run| run.all_arrived()));
        let stops = !field[0] && !field[1];
        let field = if stops { "stops" } else { "arrives" };
        let ours = format!("liquid {}, the field {field}", word(thinks));
        claim(name, words, thinks && stops, ours, format!("{place} liquid {}, and the field {field}.", word(thinks)));
    }

    let run = unchanged("liquid_large").offline();
    let through = run.arrives && !run.virtual_obstacles.is_empty() && run.clearance(scene("liquid_large")) >= -CUT_M;
    let ours = format!(
        "{} after {} virtual obstacles, {} steps, {:.2} m clear of the obstacles",
        word(run.arrives),
        run.virtual_obstacles.len(),
        run.steps(),
        run.clearance(scene("liquid_large"))
    );
    let sentence = format!(
        "Through a large arrangement of {} obstacles liquid {} after {} virtual obstacles.",
        scene("liquid_large").discs().len(),
        if through { "finds a path" } else { "finds no path" },
        run.virtual_obstacles.len()
    );
    let words = "a path like that of a liquid through a large arrangement";
    claim("figure 9, a large arrangement (liquid_large)", words, through, ours, sentence);

    let [second, first] = fields("liquid_corridor").map(|run| run.arrival_s(0));
    let told = |time_s: Option<f64>| time_s.map_or("stops".to_owned(), |time_s| format!("arrives after {time_s:.1} s"));
    let ours = format!("the field of second order {}, of first order with a coarse tick {}", told(second), told(first));
    let sentence = format!(
        "In a narrow passage the field does not have to stop: of second order it {}, only of first order with a coarse \
         tick it {}.",
        told(second),
        told(first)
    );
    let name = "Ex. 1 case 4, the field in a narrow passage (liquid_corridor)";
    claim(name, "the field oscillates, enters a closed loop, stops", second.is_none(), ours, sentence);

    let setup = unchanged("liquid_u_trap");
    let [thinks, online] = [setup.offline(), setup.online()].map(|run| in_cup(&run.path));
    let ours = format!("{thinks} points of its path inside the cup with liquid, {online} with liquid-online");
    let sentence = format!(
        "In a U the variant that thinks first never enters the cup ({thinks} points), the modified one does ({online} points)."
    );
    let words = "the original never enters the space between the obstacles, the modified one goes back and forth in it";
    claim("Ex. 2 case 1, who enters the cup (liquid_u_trap)", words, thinks == 0 && online > 0, ours, sentence);

    let setup = unchanged("liquid_gap");
    let [thinks, online] = [setup.offline(), setup.online()].map(|run| run.rounds);
    let ours = format!("{online} rounds online against {thinks}");
    let sentence =
        format!("The modified variant computes less in the map of Ex. 1 case 2: {online} rounds against {thinks}.");
    let words = "the modified variant needs fewer computation steps (53 against 110)";
    claim("Ex. 2 case 2, fewer rounds (liquid_gap)", words, online < thinks, ours, sentence);

    let runs = sweep_runs();
    let ordered = |of: fn(&Descent) -> usize, more: bool| {
        runs.windows(2).all(|pair| if more { of(&pair[0].1) < of(&pair[1].1) } else { of(&pair[0].1) > of(&pair[1].1) })
    };
    let ok = ordered(|run| run.virtual_obstacles.len(), true) && ordered(Descent::steps, false);
    let each = runs.each_ref().map(|(k_v, run)| format!("K_v {k_v}: {}/{}", run.virtual_obstacles.len(), run.steps()));
    let ours = format!("virtual obstacles/steps: {}", each.join(", "));
    let sentence = format!(
        "A smaller K_v {} more virtual obstacles and a shorter path.",
        if ok { "gives" } else { "does not always give" }
    );
    let words = "larger K_v for speed, smaller for shorter paths";
    claim("the gain K_v (liquid_u_shallow)", words, ok, ours, sentence);
}

fn changed(key: &str, value: f64) -> ParamValues {
    [(key.to_owned(), ParamValue::Float(value))].into()
}

fn item(item: impl Into<String>) -> Item {
    Item::new(item)
}

fn noted(text: impl Into<String>, note: impl Into<String>) -> Item {
    Item::new(text).note(note)
}

fn unchanged(name: &str) -> Setup {
    Setup::of(scene(name), &ParamValues::new())
}

pub(super) fn rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    for scene in scenes_of("liquid_").filter(|scene| !scene.expectations().is_empty()) {
        rows.begin(&format!("{} counts, clearance, perturbations", scene.name))?;
        every_scene(rows, scene);
    }
    rows.begin("claims about single environments")?;
    rows.about(
        "specification, sections 2 to 4 and 6",
        "planners liquid and liquid-online with the paper's gains, in the scene that the row names",
        "the specification's: counts are exact",
    );
    cup(rows);
    blunt(rows);
    chatter(rows);
    literal(rows);
    for (name, rounds) in [("rpoa_moving6", 142), ("rpoa_orbiter", 146)] {
        rows.begin(name)?;
        moving(rows, name, rounds);
    }
    rows.begin("liquid_u_resonance, 500 virtual obstacles")?;
    let ours = unchanged("liquid_u_resonance").online();
    let text = "liquid_u_resonance liquid-online, budget 500: virtual obstacles/rounds";
    rows.exact(item(text), "500/19130".into(), format!("{}/{}", ours.virtual_obstacles.len(), ours.rounds));
    rows.begin("liquid_clogged, 500 virtual obstacles")?;
    clogged(rows);
    ControlFlow::Continue(())
}

/// Section 5, what holds in all scenes.
fn every_scene(rows: &mut Rows<'_>, scene: &Scene) {
    let name = &scene.name;
    rows.about(
        "specification, section 5: counts do not change",
        format!(
            "scene {name}: liquid and liquid-online, 60 virtual obstacles at most; the start moved by 1e-9 to 1e-6 m (four \
             runs), the world upside down, and with x and y exchanged"
        ),
        "exact: a mismatch is a bug, not rounding, says the specification",
    );
    let setup = Setup { budget: 60, ..Setup::of(scene, &ParamValues::new()) };
    let specified = ["liquid-offline", "liquid-online"].map(|method| listed(scene, method)).join(", ");
    let found = |scene: Scene| {
        let setup = Setup { scene, ..setup.clone() };
        let one = |run: Descent| if run.arrives { run.counts() } else { "never".to_owned() };
        format!("{}, {}", one(setup.offline()), one(setup.online()))
    };
    let shifts = [1e-9, 1e-8, 1e-7, 1e-6].map(|size| Vector2::new(size, -0.7 * size));
    let moved = shifts.map(|shift| {
        let mut scene = setup.scene.clone();
        scene.robot_mut().start += shift;
        ("start moved", scene)
    });
    let mapped = [
        ("directions numbered backwards", mapped(&setup.scene, |p| Point2::new(p.x, -p.y))),
        ("directions numbered by (7)", mapped(&setup.scene, |p| Point2::new(p.y, p.x))),
    ];
    let changes = moved.into_iter().chain(mapped);
    let different = changes.map(|(change, scene)| (change, found(scene))).find(|(_, counts)| *counts != specified);
    let ours = different.map_or(specified.clone(), |(change, counts)| format!("{counts} ({change})"));
    let text = format!("{name}: counts offline, online, with a start moved and directions numbered otherwise");
    rows.exact(item(text), specified, ours);
}

/// The counts that the specification lists for a method in a scene.
fn listed(scene: &Scene, method: &str) -> String {
    let plain = |expect: &&Expectation| expect.method == method && expect.params.is_empty();
    let expect = scene.expectations().iter().find(plain).expect("every scene has both");
    let counts = [Keys::virtual_obstacles, Keys::computation_rounds, Keys::motion_steps].map(|key| expect.get(key));
    match (expect.get(Keys::arrives), counts) {
        (Some(true), [Some(hills), Some(rounds), Some(steps)]) => format!("{hills}/{rounds}/{steps}"),
        _ => "never".to_owned(),
    }
}

fn mapped(scene: &Scene, map: impl Fn(Point2<f64>) -> Point2<f64>) -> Scene {
    let mut scene = scene.clone();
    for robot in &mut scene.scenario.robots {
        robot.start = map(robot.start);
        robot.goals.iter_mut().for_each(|goal| *goal = map(*goal));
    }
    let discs = scene.discs().into_iter().map(|disc| disc.shape);
    scene.scenario.obstacles = discs.map(|disc| standing(map(disc.a), disc.radius)).collect();
    scene
}

/// A disc that stands still.
fn standing(center: Point2<f64>, radius: f64) -> Obstacle {
    Obstacle { shape: Shape::Capsule(Capsule::disc(center, radius)), motion: None }
}

/// The gains that the sweep tries, and their runs.
pub(super) fn sweep_runs() -> [(f64, Descent); 4] {
    let run = |k_v: f64| Setup::of(scene("liquid_u_shallow"), &changed("k_v", k_v)).offline();
    [60.0, 10.0, 1.0, 0.1].map(|k_v| (k_v, run(k_v)))
}

/// Points of a path inside the cup of `liquid_u_trap`: within 1.3 m of the centre of its arc.
fn in_cup(path: &[Point2<f64>]) -> usize {
    path.iter().filter(|p| (*p - Point2::new(2.0, 0.0)).norm() < 1.3).count()
}

fn cup(rows: &mut Rows<'_>) {
    let setup = unchanged("liquid_u_trap");
    let note = "inside: within 1.3 m of the centre of the arc, whose discs reach in to 1.5 m. The specification does not \
                say what it counted; this gives its number";
    for (method, oracle, run) in [("liquid-offline", 0, setup.offline()), ("liquid-online", 94, setup.online())] {
        rows.exact(noted(format!("liquid_u_trap {method}: points inside the cup"), note), oracle, in_cup(&run.path));
    }
}

/// Section 3: a virtual obstacle that is wider than a step catches the online variant.
fn blunt(rows: &mut Rows<'_>) {
    for (v_r, arrives) in [(0.06, true), (0.08, false)] {
        let run = Setup::of(scene("liquid_ring_side"), &changed("v_r_m", v_r)).online();
        rows.exact(item(format!("liquid_ring_side liquid-online, V_r = {v_r}: arrives")), arrives, run.arrives);
        if !arrives {
            let first = run.virtual_obstacles[0];
            let frozen = run.virtual_obstacles.iter().all(|other| *other == first) && run.path.last() == Some(&first);
            rows.exact(
                item(format!("liquid_ring_side liquid-online, V_r = {v_r}: freezes at the first minimum")),
                true,
                frozen,
            );
        }
    }
}

fn chatter(rows: &mut Rows<'_>) {
    let run = khatib(scene("liquid_corridor"), Order::First);
    let text = "liquid_corridor khatib-first-order: extent of the chatter at the mouth is about v_max dt";
    rows.number(noted(text, "\"about\" read as 10 %"), 0.1, tidy(tail_extent(&run)), 0.01, "m");
}

/// Section 2: the printed numbers taken literally let the agent jump through a wall.
fn literal(rows: &mut Rows<'_>) {
    let mut scene = scene("liquid_free").clone();
    scene.robot_mut().start = Point2::origin();
    scene.robot_mut().goals = vec![Point2::new(350.0, 0.0)];
    scene.scenario.obstacles = (-10..=10).map(|i| standing(Point2::new(175.0, f64::from(3 * i)), 1.5)).collect();
    let run = Setup::of(&scene, &changed("step_m", 10.0)).offline();
    let text = "printed numbers taken literally: the agent jumps through a closed wall";
    let near = |x: f64| run.path.iter().any(|p| (p - Point2::new(x, 0.0)).norm() < 1e-9);
    let ours = format!("{}, over the wall from 170 to 180: {}", run.counts(), near(170.0) && near(180.0));
    let note = "with the step of 10 in metres; why we read it as 10 cm. The methods refuse such jumps (`no_jumping`)";
    rows.exact(noted(text, note), "0/34/34, over the wall from 170 to 180: true".into(), ours);
}

/// Section 6: moving obstacles, online; the obstacles are where they are when a round begins.
fn moving(rows: &mut Rows<'_>, name: &str, oracle: usize) {
    let run = unchanged(name).online();
    let text = format!("{name} liquid-online: virtual obstacles/rounds/steps");
    rows.exact(noted(text, "0.1 s a round; arrival within a step"), format!("0/{oracle}/{oracle}"), run.counts());
}

/// Section 4: a reachable goal that is not reached, and what a smaller K_v changes.
fn clogged(rows: &mut Rows<'_>) {
    let ours = unchanged("liquid_clogged").offline();
    let text = "liquid_clogged liquid-offline, budget 500: virtual obstacles/rounds";
    rows.exact(item(text), "500/34613".into(), format!("{}/{}", ours.virtual_obstacles.len(), ours.rounds));
    for (k_v, oracle) in [(10.0, "246/9076/34"), (1.0, "239/5105/33")] {
        let run = Setup::of(scene("liquid_clogged"), &changed("k_v", k_v)).offline();
        let text = format!("liquid_clogged liquid-offline, K_v = {k_v}: virtual obstacles/rounds/steps");
        rows.exact(item(text), oracle.to_owned(), run.counts());
    }
    // What the method does by default: it falls back.
    let setup = unchanged("liquid_clogged");
    let (law, obstacles) = (setup.law(), setup.scene.discs());
    let (start, goal) = ends(&setup.scene);
    let mut search = Search::new(Budget { virtual_max: 300, rounds_max: 20_000, fallbacks: 2 });
    search.begin(start, goal);
    while search.advance(&law, setup.scene.robot().radius_m, &obstacles, 50) == Progress::Thinking {}
    let found = search.progress() == Progress::Found;
    let counts = (search.virtual_obstacles().len(), search.rounds(), search.path().len() - 1);
    let ours = format!("{found} with K_v = {}: {}/{}/{}", law.k_v / search.k_v_divisor(), counts.0, counts.1, counts.2);
    let note = "the default budget: 300 virtual obstacles, 20000 rounds, K_v, K_v/6, K_v/60";
    let text = "liquid_clogged liquid-offline, falling back to smaller K_v: arrives";
    rows.exact(noted(text, note), "true with K_v = 10: 246/9076/34".into(), ours);
}
