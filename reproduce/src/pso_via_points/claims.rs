//! What the specification says in words.

use super::expectations::share_free;
use super::experiment::{Experiment, Optimised, reduction_percent};
use crate::row::{Item, Rows};
use crate::scene::{disc_at, scene};
use crate::smoothness;
use crate::stats;
use crate::stepper::tidy;
use geometry::Elbow;
use geometry::arm::Room;
use geometry::spline::length;
use model::random::Stream;
use nalgebra::Point2;
use planners::Obstacle;
use planners::pso_via_points::field::{Bodies, RawPath, Variant, Walk, raw_path};
use planners::pso_via_points::planning::{Origin, Planning, Query};
use std::ops::ControlFlow;

/// Seeds of every claim about swarms.
const SEEDS: u64 = 10;

pub(super) fn rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    for (name, percent) in [("pso_mass_point_1", 10.0), ("pso_mass_point_2", 5.0)] {
        let experiment = Experiment::new(scene(name));
        for variant in Variant::ORDER {
            let raw = experiment.raw(variant);
            if raw.arrived {
                rows.begin(&format!("{name} swarm on {variant:?}"))?;
                let lengths_m = reduces(rows, &experiment, &format!("{name} {variant:?}"), &raw, None, percent);
                match (name, variant) {
                    ("pso_mass_point_1", Variant::FadedBias) => side(rows, variant, lengths_m, 11.40),
                    ("pso_mass_point_1", Variant::Plain) => side(rows, variant, lengths_m, 11.09),
                    _ => {}
                }
            }
        }
    }
    let experiment = Experiment::new(scene("pso_arm_1"));
    let raw = experiment.raw(Variant::Plain);
    rows.begin("pso_arm_1 swarm")?;
    reduces(rows, &experiment, "pso_arm_1 Plain elbow up", &raw, Some(Elbow::Up), 3.0);
    rows.begin("order and sheets")?;
    order(rows);
    sheets(rows);
    rows.begin("random maps")?;
    random_maps(rows);
    ControlFlow::Continue(())
}

/// What the paper claims in words: its numbers are for environments of its own.
pub(super) fn headlines(rows: &mut Rows<'_>) {
    rows.about(
        "paper, title and table of lengths; specification, section 4",
        "stand-ins for the paper's environments: planner pso-via-points, the swarm on the raw path of the field (variant \
         Plain, FadedBias where that is trapped); seeds 0 to 9",
        "a claim in words: it holds with every seed",
    );
    let found = SWARMS.map(|(name, variant, elbow)| {
        let experiment = Experiment::new(scene(name));
        let raw = experiment.raw(variant);
        let runs: Vec<Optimised> = (0..SEEDS).map(|seed| experiment.optimise(&raw.points, elbow, seed)).collect();
        (raw, runs)
    });
    let worst = found.each_ref().map(|(raw, runs)| {
        let longest = runs.iter().map(|run| run.length_m).fold(0.0, f64::max);
        reduction_percent(length(&raw.points), longest)
    });
    let list = worst.map(|percent| format!("{percent:.1} %")).join(", ");
    let printed = "shorter in all four environments, by 3.44 to 5.87 %";
    let item = Item::new("claim: the swarm shortens the path of the field")
        .against_paper(printed, "shorter with every seed", worst.iter().all(|percent| *percent > 0.0))
        .note("the reductions themselves are those of other environments than the paper's")
        .headline(format!(
            "The swarm shortens the field's path with every seed, by at least {list} in four stand-ins (paper: 3.4 to 5.9 % \
             in its own environments)."
        ));
    rows.claim(item, format!("by at least {list} in four stand-ins"));
    smoother(rows, &found);
    past_minima(rows);
}

/// The paper's first modification, in the stand-ins for its second environments.
fn past_minima(rows: &mut Rows<'_>) {
    let mut holds = true;
    let mut ours = Vec::new();
    for (name, ..) in SWARMS.into_iter().filter(|(_, variant, _)| *variant == Variant::FadedBias) {
        let experiment = Experiment::new(scene(name));
        let [plain, bias, literal] =
            [Variant::Plain, Variant::FadedBias, Variant::LiteralBias].map(|variant| experiment.raw(variant));
        let left_m = |raw: &RawPath| raw.points.last().map_or(f64::NAN, |end| (experiment.goal - end).norm());
        holds &= !plain.arrived && bias.arrived;
        ours.push(format!(
            "{name}: without it {:.2} m are left, with it {:.2} m, with it as printed {:.2} m",
            left_m(&plain),
            left_m(&bias),
            left_m(&literal)
        ));
    }
    let item = Item::new("claim: a constant force leads past a simple local minimum")
        .against_paper("past simple local minima, with (-0.75, +0.5)", "the plain field stops, with it a path arrives", holds)
        .note("the constant force fades near the goal here: as printed it comes to rest beside the goal; it is no remedy for every map")
        .headline(if holds {
            "A constant force that fades near the goal leads past the local minimum in both stand-ins that have one."
        } else {
            "A constant force does not lead past the local minimum in both stand-ins that have one."
        });
    rows.claim(item, ours.join("; "));
}

/// The raw path is `accepted but unsmooth`, the final one smooth: by the smoothness that the report has, both driven at
/// one speed.
fn smoother(rows: &mut Rows<'_>, found: &[(RawPath, Vec<Optimised>); SWARMS.len()]) {
    let each = found.each_ref().map(|(raw, runs)| {
        let finals = runs.iter().filter_map(|run| smoothness::of_path(&run.path));
        (smoothness::of_path(&raw.points), finals.fold(f64::INFINITY, f64::min))
    });
    let smoother = each.iter().all(|(raw, last)| raw.is_some_and(|raw| *last > raw));
    let list = each.map(|(raw, last)| format!("{last:.1} against {:.1}", raw.unwrap_or(f64::NAN))).join(", ");
    let item = Item::new("claim: the path is smooth")
        .against_paper("the raw path is unsmooth, the final path smooth", "smoother with every seed", smoother)
        .method(
            "log dimensionless jerk (0 is best) of the raw path and of the final path of each seed, both driven at 1 m/s; \
             the least smooth seed counts",
        )
        .headline(format!(
            "The final path {} smoother than the field's with every seed (log dimensionless jerk, 0 is best): {list}.",
            if smoother { "is" } else { "is not always" }
        ));
    rows.claim(item, list);
}

/// The scenes of the claims, the force variant of their raw paths, and the sheet of the arm.
pub(super) const SWARMS: [(&str, Variant, Option<Elbow>); 4] = [
    ("pso_mass_point_1", Variant::Plain, None),
    ("pso_mass_point_2", Variant::FadedBias, None),
    ("pso_arm_1", Variant::Plain, Some(Elbow::Up)),
    ("pso_arm_2", Variant::FadedBias, Some(Elbow::Up)),
];

/// A reduction in at least 9 of 10 seeds, clear of obstacles. (That a path is no shorter than the straight line, and that
/// the best cost never increases, holds by construction.)
fn reduces(
    rows: &mut Rows<'_>,
    experiment: &Experiment,
    name: &str,
    raw: &RawPath,
    elbow: Option<Elbow>,
    percent: f64,
) -> Vec<f64> {
    rows.about(
        "specification, section 5, qualitative",
        format!("{name}: the swarm on the raw path of that force variant; seeds 0 to {}", SEEDS - 1),
        "the specification's",
    );
    let runs: Vec<Optimised> = (0..SEEDS).map(|seed| experiment.optimise(&raw.points, elbow, seed)).collect();
    let raw_m = length(&raw.points);
    let enough = runs.iter().filter(|run| reduction_percent(raw_m, run.length_m) >= percent).count();
    let item = Item::new(format!("{name}: seeds with a reduction of at least {percent} %"));
    let (specified, ours) = (format!("at least 9 of {SEEDS}"), format!("{enough} of {SEEDS}"));
    rows.push(item, Some(specified), ours, "at least 9".to_owned(), enough >= 9);
    if elbow.is_none() {
        let clearance = runs.iter().map(|run| run.clearance_m).fold(f64::INFINITY, f64::min);
        let bound = format!("at least {} m", tidy(experiment.recipe.margin_m - 0.01));
        let (ours, ok) = (format!("{} m", tidy(clearance)), clearance >= experiment.recipe.margin_m - 0.01);
        let item = Item::new(format!("{name}: clearance at least margin - 0.01 m"));
        rows.push(item, Some(bound.clone()), ours, bound, ok);
    } else {
        let accepted = runs.iter().filter(|run| run.accepted).count();
        rows.exact(Item::new(format!("{name}: final paths that pass the fine check")), SEEDS as usize, accepted);
    }
    runs.iter().map(|run| run.length_m).collect()
}

/// The swarm rarely changes the side on which the raw path passes.
fn side(rows: &mut Rows<'_>, variant: Variant, mut lengths_m: Vec<f64>, oracle: f64) {
    lengths_m.sort_by(f64::total_cmp);
    let item = Item::new(format!("pso_mass_point_1: swarm on the path of {variant:?}, median of {SEEDS} seeds"))
        .why("ours: a sixth of what the two sides differ");
    rows.number(item, oracle, tidy(lengths_m[lengths_m.len() / 2]), 0.05, "m");
}

/// The variants in the recommended order, and what comes of the plan as a robot makes it.
fn order(rows: &mut Rows<'_>) {
    rows.about(
        "specification, sections 3 and 6, bias; section 4",
        "the planning of pso-via-points, all in one piece, with the variants in the recommended order",
        "exact",
    );
    for (name, first) in [("pso_mass_point_1", Variant::Plain), ("pso_mass_point_2", Variant::Right)] {
        let experiment = Experiment::new(scene(name));
        let query = Query {
            start: experiment.start,
            goal: experiment.goal,
            obstacles: &experiment.obstacles,
            radius_m: 0.0,
            arm: None,
        };
        let mut planning = Planning::default();
        planning.begin(&query);
        let (mut stream, mut budget) = (Stream::new(1, 0, 0, "pso"), i64::MAX);
        planning.advance(&experiment.recipe, &query, &mut stream, &mut budget);
        let item = Item::new(format!("{name}: first variant that arrives, in the recommended order"));
        rows.exact(item, format!("{first:?}"), planning.arrived().map_or("none".to_owned(), |v| format!("{v:?}")));
        let item = Item::new(format!("{name}: what the planned path comes from"));
        let from = planning.best().map(|(_, origin)| origin);
        rows.exact(item, format!("{:?}", Some(Origin::Swarm(first))), format!("{from:?}"));
    }
}

/// Check 9, and that the union of the sheets is not a space an arm can move in.
fn sheets(rows: &mut Rows<'_>) {
    rows.about(
        "specification, section 5, check 9",
        "the sheets of the arm's free space, by inverse kinematics",
        "exact",
    );
    let flip = Experiment::new(scene("pso_arm_elbow_flip"));
    let one = Experiment::new(scene("pso_arm_1"));
    for (experiment, name, tip, oracle) in [
        (&flip, "pso_arm_elbow_flip", [1.6, 5.4], "elbow down"),
        (&flip, "pso_arm_elbow_flip", [1.0, 5.6], "elbow up"),
        (&flip, "pso_arm_elbow_flip", [2.0, 5.0], "both"),
        (&flip, "pso_arm_elbow_flip", [0.2, 5.6], "both"),
        (&one, "pso_arm_1", [5.0, 4.2], "none"),
        (&one, "pso_arm_1", [3.0, 3.0], "none"),
    ] {
        let geometry = experiment.arm.expect("an arm");
        let tip = Point2::from(tip);
        let free = Elbow::BOTH.map(|elbow| experiment.sheet(&geometry, elbow).pose(tip, Room::default()).is_some());
        let ours = match free {
            [true, true] => "both",
            [true, false] => "elbow up",
            [false, true] => "elbow down",
            [false, false] => "none",
        };
        let item = Item::new(format!("check 9: {name}, sheets in which ({}, {}) is free", tip.x, tip.y));
        rows.exact(item, oracle.to_owned(), ours.to_owned());
    }
    let raw = flip.raw(Variant::Plain);
    for elbow in Elbow::BOTH {
        let accepted = flip.optimise(&raw.points, Some(elbow), 0).accepted;
        let item =
            Item::new(format!("pso_arm_elbow_flip: swarm on the plain path passes the fine check, elbow {elbow:?}"));
        rows.exact(item.note("the way is not executable in this sheet"), false, accepted);
    }
    let whole = Elbow::BOTH.iter().any(|elbow| share_free(&flip, &raw, *elbow) == 1.0);
    rows.exact(Item::new("pso_arm_elbow_flip: plain path free in one sheet"), false, whole);
}

/// How often each variant arrives on random maps of eight discs.
fn random_maps(rows: &mut Rows<'_>) {
    const MAPS: u32 = 600;
    rows.about(
        "specification, section 3, force variants",
        "raw paths of each variant in 600 random maps of ours: the specification's are not given",
        "Fisher's exact test at 1 %: both counts may come from one share",
    );
    let mut stream = Stream::new(1, 0, 0, "random maps");
    let field = Experiment::new(scene("pso_mass_point_1")).recipe.field;
    let walk = Walk { step_m: 0.1, tolerance_m: 0.1, steps_max: 600 };
    let (start, goal) = (Point2::new(0.5, 0.5), Point2::new(9.0, 8.5));
    let mut arrivals = [0u32; 5];
    let variants = [Variant::Plain, Variant::Right, Variant::Left, Variant::FadedBias, Variant::LiteralBias];
    for _ in 0..MAPS {
        let map = random_map(&mut stream, start, goal);
        let bodies = Bodies { obstacles: &map, ring: None, radius_m: 0.0 };
        for (count, variant) in arrivals.iter_mut().zip(variants) {
            *count += u32::from(raw_path(&field, variant, &bodies, start, goal, &walk).arrived);
        }
    }
    let percent = arrivals.map(|count| f64::from(count) * 100.0 / f64::from(MAPS));
    for ((variant, ours), oracle) in variants.into_iter().zip(percent).zip([79.0, 81.0, 85.0, 65.0, 0.0]) {
        let item = Item::new(format!("{MAPS} random maps of 8 discs: arrivals of {variant:?}"));
        // The specification counted in 600 maps, and prints whole per cents.
        let counts = [[(ours * f64::from(MAPS) / 100.0).round() as u32, MAPS], [(oracle * 6.0) as u32, 600]];
        let p = stats::fisher(counts[0], counts[1]);
        let tolerance = format!("as probable as 1 %: {:.0} %", 100.0 * p);
        rows.push(item, Some(format!("{oracle} % of 600")), format!("{ours:.1} %"), tolerance, p >= stats::LEVEL);
    }
}

/// Eight discs that overlap neither each other nor start and goal.
fn random_map(stream: &mut Stream, start: Point2<f64>, goal: Point2<f64>) -> Vec<Obstacle> {
    let mut map: Vec<Obstacle> = Vec::new();
    while map.len() < 8 {
        let center = Point2::new(stream.between(1.0, 9.0), stream.between(1.0, 9.0));
        let disc = disc_at(map.len() as u32, center, stream.between(0.4, 0.6));
        let apart = |other: &Obstacle| other.shape.distance(center) > disc.shape.radius + 0.2;
        let clear = [start, goal].iter().all(|end| disc.shape.distance(*end) > 0.5);
        if clear && map.iter().all(apart) {
            map.push(disc);
        }
    }
    map
}
