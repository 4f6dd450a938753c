//! Liquid-movement potential descent, offline and online, against Khatib's field: worked examples, every expectation of
//! the scenes, and what the specification says about all of them in words.
//!
//! The paper prints no coordinates, so its maps cannot be rebuilt: where it prints a number, the row is about a
//! stand-in that shows the same, and the paper's number stands beside it for comparison only.
//!
//! Rows that others imply are left out: distances to a goal that a place implies; an arrival that a time or a count of
//! steps implies.
//!
//! Tolerances. Counts and arrivals are exact. Worked examples hold to 1e-6, or to half of their last printed digit where
//! that is coarser. For the rest the specification gives none: clearances and places of virtual obstacles hold to half of
//! their last printed digit, results of Khatib's field to one, because the files' coordinates are rounded and its
//! chatter is not the same to the last digit. So much can be asked because nothing in these runs but the directions'
//! sines and cosines depends on a mathematical library.

mod drive;
mod figures;
mod words;

use crate::row::{Item, Paper, Rows};
use crate::scene::{Scene, goal, plain, scene, scenes_of};
use crate::stepper::{Stepper, tidy};
use drive::{Descent, Order, Setup, khatib, tail_extent};
use geometry::Capsule;
use model::key::{KeyName, Named, OptionalKey};
use model::{ParamValue, ParamValues};
use nalgebra::Point2;
use planners::Obstacle;
use planners::liquid::{Candidate, Field, Law};
use scenarios::{Expectation, Results as Keys};
use std::ops::ControlFlow;

/// The paper.
pub static PAPER: Paper = Paper {
    name: "liquid",
    citation: "B. Moaveni, D. Ghanbari Gol, Solving the Local Minimum Problem in Path Planning Algorithm based on the \
               Virtual Potential Field and the Principles of Liquid Movement (in Persian), 2011",
    silence: "the paper gives no coordinates: its numbers are for maps of its own, and are shown, not compared",
    differs: &[(
        "claim: Ex. 1 case 4, the field in a narrow passage (liquid_corridor)",
        "only the first order with a coarse tick oscillates and stops, by about v_max dt; the second order, which the paper \
         describes, drives through in 6.3 s",
    )],
    rows,
    steps: 75,
    series: figures::series,
};

fn rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    rows.begin("claims of the paper")?;
    words::claims(rows);
    rows.begin("worked examples")?;
    examples(rows);
    lengths(rows);
    for scene in scenes_of("liquid_") {
        for expect in scene.expectations() {
            let why = "counts and arrivals are exact, as the specification asks; clearances and places of virtual obstacles \
                       half of their last printed digit, results of Khatib's field one, which is ours";
            let method = format!("scene {}: {}, {} virtual obstacles at most", scene.name, variant_name(expect), 500);
            rows.about("specification, section 4 and the scene's file", method, why);
            rows.begin(&format!("{} {}", scene.name, variant_name(expect)))?;
            expectation(rows, scene, expect);
        }
    }
    words::rows(rows)
}

/// The potential of a scene, with these virtual obstacles.
fn field<'a>(
    scene: &Scene,
    law: &'a Law,
    obstacles: &'a [Obstacle],
    virtual_obstacles: &'a [Point2<f64>],
) -> Field<'a> {
    let (robot, k_v) = (scene.robot(), law.k_v);
    Field { law, k_v, agent_radius_m: robot.radius_m, goal: goal(robot), obstacles, virtual_obstacles }
}

/// A worked example: 1e-6 relative, or half of the last of so many printed decimals.
fn example(rows: &mut Rows<'_>, item: &str, oracle: f64, decimals: i32, ours: f64) {
    let tolerance = (1e-6 * oracle.abs()).max(0.5 * 10f64.powi(-decimals));
    rows.number(Item::new(format!("example {item}")), oracle, tidy(ours), tidy(tolerance), "");
}

/// Section 5, checks 1 to 8.
fn examples(rows: &mut Rows<'_>) {
    rows.about(
        "paper, equations (1) to (12); specification, section 5, checks 1 to 8",
        "the potential of liquid with the paper's parameters in scene liquid_two_obstacles, and liquid_near_goal for check 7",
        "the specification's: 1e-6, or half of the last printed digit where that is coarser",
    );
    let two = scene("liquid_two_obstacles");
    let (law, obstacles) = (Setup::of(two, &ParamValues::new()).law(), two.discs());
    let (start, goal) = drive::ends(two);
    let plain = field(two, &law, &obstacles, &[]);

    let disc = Obstacle { shape: Capsule::disc(Point2::origin(), 1.5), ..obstacles[0] };
    example(rows, "1: P_o at (2, 0)", 4.526935, 6, plain.of_obstacle(&disc, [2.0, 0.0].into()));
    rows.exact(Item::new("example 1: P_o at (1.5, 0)"), f64::INFINITY, plain.of_obstacle(&disc, [1.5, 0.0].into()));

    example(rows, "2: P_t at the start", 140.001750, 6, plain.of_goal(start));
    example(rows, "2: P_o of the first disc", 0.528744, 6, plain.of_obstacle(&obstacles[0], start));
    example(rows, "2: P_o of the second disc", 0.814735, 6, plain.of_obstacle(&obstacles[1], start));
    example(rows, "2: Pbar at the start", 141.345228, 6, plain.bar(start));

    let best =
        |field: &Field<'_>, q| field.best(q).unwrap_or(Candidate { m: usize::MAX, point: q, potential: f64::NAN });
    let exact = |rows: &mut Rows<'_>, item: &str, oracle: usize, ours: usize| {
        rows.exact(Item::new(format!("example {item}")), oracle, ours);
    };
    exact(rows, "3: best candidate at the start", 0, best(&plain, start).m);
    example(rows, "3: its P", 138.040381, 6, best(&plain, start).potential);
    for (m, p) in [(1, 138.2783), (15, 138.3194), (8, 144.6825)] {
        example(rows, &format!("3: P of candidate {m}"), p, 4, plain.candidate(start, m).potential);
    }

    let mut q = start;
    let mut steps = 0;
    while let Some(lower) = plain.descend(q) {
        (q, steps) = (lower, steps + 1);
    }
    exact(rows, "4: steps of the first descent", 12, steps);
    example(rows, "4: x of the minimum", 0.684776, 6, q.x);
    example(rows, "4: y of the minimum", 0.096537, 6, q.y);
    example(rows, "4: P there", 110.150783, 6, plain.at(q));
    exact(rows, "4: lowest candidate there", 15, best(&plain, q).m);
    example(rows, "4: its P", 110.279787, 6, best(&plain, q).potential);

    let drop = [q];
    let filled = field(two, &law, &obstacles, &drop);
    example(rows, "5: P(start) with the virtual obstacle", 186.147524, 6, filled.at(start));
    example(rows, "5: P(goal) with it", 11.419411, 6, filled.at(goal));
    example(rows, "5: Pbar(goal)", 3.694115, 6, filled.bar(goal));
    exact(rows, "5: best candidate at the start", 8, best(&filled, start).m);

    for (distance, p, decimals) in [(0.1, 12244.898, 3), (0.2, 2076.1246, 4), (1.5, 27.766209, 6)] {
        let ours = plain.of_virtual(Point2::origin(), [distance, 0.0].into());
        example(rows, &format!("6: P_v at {distance} m"), p, decimals, ours);
    }

    let near_goal = scene("liquid_near_goal");
    let around = near_goal.discs();
    let near = field(near_goal, &law, &around, &[]);
    let at_goal = near.bar(drive::ends(near_goal).1);
    example(rows, "7: Pbar(goal)", 14.570249, 6, at_goal);
    example(rows, "7: Pbar one step to the left", 15.338709, 6, near.bar([2.9, 0.0].into()));
    let lowest = (0..=3000)
        .map(|i| f64::from(i) * 0.001)
        .min_by(|a, b| near.bar([*a, 0.0].into()).total_cmp(&near.bar([*b, 0.0].into())));
    let item = Item::new("example 7: lowest point of the axis");
    let item = item.method("the potential at every millimetre between start and goal");
    rows.number(item, 3.0, lowest.unwrap_or(f64::NAN), 0.0, "m");

    let note = "equation (7) as printed, with sine and cosine swapped, would give (1, 0)";
    let item = Item::new("example 8: direction of m = 4 by (12)").note(note);
    let (dx, dy) = (law.directions[4].x, law.directions[4].y);
    let ok = dx.abs() <= 1e-6 && (dy - 1.0).abs() <= 1e-6;
    rows.push(item, Some("(0, 1)".into()), format!("({dx:.6}, {dy:.6})"), "± 1e-6".into(), ok);
}

/// Section 2: lengths that follow from the gains.
fn lengths(rows: &mut Rows<'_>) {
    rows.about("specification, section 2", "what follows from the gains of liquid", "half of the last printed digit");
    let law = Setup::of(scene("liquid_free"), &ParamValues::new()).law();
    let steeper = |k: f64| (2.0 * k / law.k_t).cbrt();
    let mut row = |item: &str, oracle: f64, decimals: i32, ours: f64| {
        rows.number(Item::new(format!("length: {item}")), oracle, tidy(ours), tidy(0.5 * 10f64.powi(-decimals)), "m");
    };
    row("an obstacle's hill is steeper than the goal's cone up to", 0.385, 3, steeper(law.k_o));
    row("a virtual obstacle's hill is, up to", 1.508, 3, steeper(law.k_v));
    let least = Law { tolerance_steps: 0.0, ..law.clone() }.tolerance_m();
    row("least arrival tolerance", 0.0510, 4, least);
}

/// The rule set of an expectation, with what it changes, in the paper's symbols.
fn variant_name(expect: &Expectation) -> String {
    let change = |(key, value): (&String, &ParamValue)| {
        let symbol = match key.as_str() {
            "k_v" => "K_v",
            "v_r_m" => "V_r",
            other => other,
        };
        format!(", {symbol} = {value}")
    };
    format!("{}{}", expect.method, expect.params.iter().map(change).collect::<String>())
}

/// All rows of one `[[paper.expect]]`.
fn expectation(rows: &mut Rows<'_>, scene: &Scene, expect: &Expectation) {
    let mut setup = Setup::of(scene, &expect.params);
    setup.budget = expect.virtual_obstacles_max.unwrap_or(setup.budget);
    let mut results = Results { rows, scene, expect, used: Vec::new() };
    match expect.method.as_str() {
        "liquid-offline" => results.descent(&setup.offline()),
        "liquid-online" => results.descent(&setup.online()),
        "khatib-second-order" => results.khatib(&khatib(scene, Order::Second)),
        "khatib-first-order" => results.khatib(&khatib(scene, Order::First)),
        other => panic!("unknown rule set {other}"),
    }
    let unused: Vec<KeyName> = expect.results().filter(|key| !results.used.contains(key)).collect();
    assert!(unused.is_empty(), "{}: nothing compares {unused:?}", scene.name);
}

/// Rows of an expectation; remembers which of its keys have one.
struct Results<'a, 'b> {
    rows: &'a mut Rows<'b>,
    scene: &'a Scene,
    expect: &'a Expectation,
    used: Vec<KeyName>,
}

impl Results<'_, '_> {
    fn item(&mut self, key: impl Named) -> Item {
        self.used.push(key.any());
        let key = key.name();
        let item = format!("{} {}: {}", self.scene.name, variant_name(self.expect), plain(key).replace('_', " "));
        match words::printed(&self.scene.name, &self.expect.method, plain(key)) {
            Some(printed) => {
                let note = "the paper's number is for a map that it does not publish: not compared";
                Item::new(item).printed(printed).note(note)
            }
            None => Item::new(item),
        }
    }

    /// The row of a number in metres or seconds, if it is expected.
    fn number(&mut self, key: OptionalKey<f64>, ours: f64, tolerance: f64) {
        if let Some(oracle) = self.expect.get(key) {
            let (item, unit) = (self.item(key), if key.name().ends_with("_s") { "s" } else { "m" });
            self.rows.number(item, oracle, tidy(ours), tolerance, unit);
        }
    }

    /// Of what arrives a time or a count of steps says so.
    fn arrives(&mut self, ours: bool) {
        self.used.push(Keys::arrives.any());
        let said = self.expect.results().any(|key| key.is(Keys::time_s) || key.is(Keys::motion_steps));
        if let Some(oracle) = self.expect.get(Keys::arrives).filter(|arrives| !arrives || !said) {
            let item = self.item(Keys::arrives);
            self.rows.exact(item, oracle, ours);
        }
    }

    fn descent(&mut self, ours: &Descent) {
        self.arrives(ours.arrives);
        let steps = if ours.arrives { ours.steps() } else { usize::MAX };
        for (key, ours) in [
            (Keys::virtual_obstacles, ours.virtual_obstacles.len()),
            (Keys::computation_rounds, ours.rounds),
            (Keys::motion_steps, steps),
        ] {
            if let Some(oracle) = self.expect.get(key) {
                let item = self.item(key);
                self.rows.exact(item, oracle as usize, ours);
            }
        }
        self.number(Keys::min_clearance_m, ours.clearance(self.scene), 0.0005);
        if let Some(oracle) = self.expect.get(Keys::virtual_obstacle_positions_m) {
            let item = self.item(Keys::virtual_obstacle_positions_m);
            let off = |(a, b): (&Point2<f64>, &Point2<f64>)| (a - b).amax();
            let worst = oracle.iter().zip(&ours.virtual_obstacles).map(off).fold(0.0, f64::max);
            let ok = oracle.len() == ours.virtual_obstacles.len() && worst <= 0.5e-4 * (1.0 + 1e-9);
            let tolerance = "± 0.00005 m in x and y".to_owned();
            let ours = points(&ours.virtual_obstacles, 6);
            self.rows.push(item, Some(points(&oracle, 4)), ours, tolerance, ok);
        }
    }

    fn khatib(&mut self, ours: &Stepper) {
        self.arrives(ours.all_arrived());
        self.number(Keys::time_s, ours.arrival_s(0).unwrap_or(f64::NAN), 0.01);
        if let Some(oracle) = self.expect.get(Keys::end_m) {
            let item = self.item(Keys::end_m);
            let off = (oracle[0] - ours.end(0)).amax();
            let (oracle, ours) = (points(&oracle, 3), points(&[ours.end(0)], 6));
            self.rows.push(item, Some(oracle), ours, "± 0.001 m in x and y".into(), off <= 0.001);
        }
        match self.expect.get(Keys::end_m) {
            Some(_) => self.used.push(Keys::distance_to_goal_m.any()),
            None => self.number(Keys::distance_to_goal_m, ours.distance_to_goal(0), 0.001),
        }
        self.number(Keys::tail_extent_m, tail_extent(ours), 0.0001);
    }
}

fn points(points: &[Point2<f64>], decimals: usize) -> String {
    // Adding zero takes the sign off a zero.
    let one = |p: &Point2<f64>| format!("({:.decimals$}, {:.decimals$})", tidy(p.x) + 0.0, tidy(p.y) + 0.0);
    points.iter().map(one).collect::<Vec<_>>().join(" ")
}
