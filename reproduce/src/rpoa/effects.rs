//! What the specification found out about the method's parts, and the paper's claims in words.

use super::figures::turns;
use super::{REGULAR, SEEDS, Seeds, at_degrees, chance, count, field, rpoa};
use crate::row::{Item, Rows};
use crate::scene::{Scene, goal, scene, scenes_of};
use crate::stats;
use crate::stepper::{Rules, Run, Stepper, tidy};
use model::ParamValue;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// Adds the rows of all effects.
pub(super) fn effects(rows: &mut Rows<'_>) {
    number_of_particles(rows);
    guard(rows);
    sight(rows);
    look_ahead(rows);
    modified_rule(rows);
    small_changes(rows);
    circling(rows);
}

/// What the field does where an obstacle circles round the target: the paper says that it circles at a constant rate.
fn circling(rows: &mut Rows<'_>) {
    /// Of the last minute, in pieces of 10 s.
    const PIECES: usize = 6;
    let run = field(scene("rpoa_orbiter"), None);
    rows.about(
        "the paper's scenario 2, as far as the text survives; specification, section 4",
        format!(
            "scene rpoa_orbiter: {}; how far the robot turns round the target in each 10 s of the last minute",
            run.words()
        ),
        "ours: constant is within 5 %, and the rate of what drags it within 1 %",
    );
    let (outcome, target) = (run.run(), goal(scene("rpoa_orbiter").robot()));
    let turned = turns(outcome.path(0).into_iter().map(|place| place - target));
    let ticks = (10.0 / outcome.rules.dt_s).round() as usize;
    let end = turned.len() - 1;
    let rates: Vec<f64> =
        (0..PIECES).map(|i| (turned[end - i * ticks] - turned[end - (i + 1) * ticks]) / 10.0).collect();
    let mean = stats::mean(&rates);
    let off = rates.iter().map(|rate| (rate / mean - 1.0).abs()).fold(0.0, f64::max);
    let item = Item::new("rpoa_orbiter apf: the rate at which it circles is constant").against_paper(
        "for ever, at constant rate",
        "within 5 % in each 10 s, at least a turn a minute",
        off <= 0.05 && mean.abs() >= TAU / 60.0,
    );
    rows.claim(item, format!("{:.1} turns in the last minute, within {:.1} %", mean * 60.0 / TAU, 100.0 * off));
    let item =
        Item::new("rpoa_orbiter apf: the rate at which it circles").note("that of the obstacle, which drags it round");
    rows.number(item, 0.3, tidy(mean), 0.003, "rad/s");
}

/// Section 4: more particles, straighter ways.
fn number_of_particles(rows: &mut Rows<'_>) {
    rows.about(
        "specification, section 4, number of particles",
        "scene rpoa_static_moved4: planner rpoa with angles = random, guard = false, step_radius = 0.1; seeds 1 to 200",
        "0.5 s, or 2.6 standard errors (99 %) of the difference between means of 200 and of 20 seeds, which is more with \
         few particles",
    );
    // With 60 particles it is the scene's own row.
    for (particles, mean_s) in particle_counts().into_iter().filter(|(n, _)| *n != 60) {
        let all = many_particles(particles);
        let item = |what: &str| Item::new(format!("rpoa_static_moved4 with {particles} particles: {what}"));
        count(rows, item("arrivals of 20 seeds"), Some(20), all.first(20).arrivals(), 20);
        let tolerance = (all.time_error() * 1e2).round().max(50.0) / 1e2;
        rows.number(item("mean time"), mean_s, (all.time_mean() * 1e3).round() / 1e3, tolerance, "s");
    }
}

/// Numbers of particles, and the specification's mean times.
pub(super) fn particle_counts() -> [(i64, f64); 5] {
    [(5, 24.4), (10, 17.2), (20, 15.4), (60, 14.3), (200, 14.0)]
}

pub(super) fn many_particles(n: i64) -> Seeds {
    let run = rpoa(scene("rpoa_static_moved4"), "random", 1);
    Seeds::run(&run.with("particles", ParamValue::Int(n)), 1..=SEEDS.into())
}

/// Section 4: the guard keeps clear of what the sum of the hills would let the robot drive through.
fn guard(rows: &mut Rows<'_>) {
    rows.about(
        "specification, section 4, guard",
        "planner rpoa with angles = random, step_radius = 0.1; seeds 1 to 20",
        "the specification's: one arrival of 20, 0.03 m of clearance",
    );
    let guarded = |run: Run| run.with("guard", ParamValue::Bool(true));
    let trap = |mu_obs: f64| rpoa(scene("rpoa_u_trap"), "random", 1).with("mu_obs", ParamValue::Float(mu_obs));
    let many = Seeds::run(&guarded(rpoa(scene("rpoa_squeeze"), "random", 1)), 1..=SEEDS.into());
    let squeeze = many.first(20);
    let item = |what: &str| Item::new(format!("rpoa_squeeze with the guard, 20 seeds: {what}"));
    count(rows, item("collisions"), Some(0), squeeze.collisions(), 20);
    rows.number(item("worst clearance"), 0.15, tidy(squeeze.clearance_worst()), 0.03, "m");
    chance(rows, Item::new("rpoa_squeeze with the guard: arrivals"), 6, many.arrivals());

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
    let run = rpoa(scene("rpoa_moving_target"), "random", 1).with("sensor_range", ParamValue::Float(1.5));
    rows.about(
        "specification, section 4, r_s",
        format!("scene rpoa_moving_target: {}; seeds 1 to 200", run.words()),
        "",
    );
    let found = Seeds::run(&run, 1..=SEEDS.into());
    chance(rows, Item::new("rpoa_moving_target with sensor range 1.5 m: collisions"), 10, found.collisions());
}

/// Section 7: in the runtime the robot does not get to the particle within a tick.
fn look_ahead(rows: &mut Rows<'_>) {
    rows.about(
        "specification, section 7",
        "the six scenes that the basic rule solves: planner rpoa with angles = random, guard = false; ticks of 0.05 s at \
         1 m/s; seeds 1 to 10 in each",
        "the specification's: one arrival, no collision, and 0.5 s for times, which it gives for mean times",
    );
    for step_radius in [0.05, 0.1, 0.2, 0.4] {
        let run = |name: &str, seeds: RangeInclusive<u64>| {
            let run = as_in_the_runtime(rpoa(scene(name), "random", 1));
            Seeds::run(&run.with("step_radius", ParamValue::Float(step_radius)), seeds)
        };
        let all = Seeds(REGULAR.iter().flat_map(|name| run(name, 1..=10).0).collect());
        let item = |what: &str| {
            Item::new(format!("six environments, 0.05 s ticks, C_t {step_radius} m, 10 seeds each: {what}"))
        };
        count(rows, item("arrivals"), Some(60), all.arrivals(), 60);
        let (least, most) = (tidy(all.time_min()), tidy(all.time_max()));
        let ok = least >= 13.9 - 0.5 && most <= 15.8 + 0.5;
        let ours = format!("{least} to {most} s");
        rows.push(item("times"), Some("13.9 to 15.8 s".to_owned()), ours, "± 0.5 s".to_owned(), ok);
        let note = match all.collisions() {
            0 => String::new(),
            _ => format!("the deepest overlap is {:.3} m", -all.clearance_worst()),
        };
        count(rows, item("collisions").note(note), Some(0), all.collisions(), 60);
    }
}

/// The run with ticks of 0.05 s, at 1 m/s.
pub fn as_in_the_runtime(run: Run) -> Run {
    let rules = Rules { dt_s: 0.05, ..run.rules };
    run.under(rules).each(|robot| robot.limits.speed_mps_max = 1.0)
}

/// Section 3: the modified rule fails in more scenes than the basic one.
fn modified_rule(rows: &mut Rows<'_>) {
    let failed = |lambda: f64| {
        let fails = |scene: &&Scene| {
            let run = rpoa(scene, "random", 1).with("lambda", ParamValue::Float(lambda));
            let found = Seeds::run(&run, 1..=20);
            found.arrivals() < 20 || found.collisions() > 0
        };
        scenes_of("rpoa_").filter(fails).count()
    };
    let (basic, modified) = (failed(0.0), failed(1.0));
    let item = Item::new("environments not solved by all of 20 seeds: modified rule (lambda 1), basic rule")
        .source("specification, section 3, modified rule")
        .method(
            "the nine scenes of the paper, planner rpoa with guard = false, lambda = 0 and 1; seeds 1 to 20 in each",
        );
    let ours = format!("{modified} against {basic}");
    rows.push(item, Some("more".to_owned()), ours, "exact".to_owned(), modified > basic);
}

/// Section 5: a start moved by 1e-7 m changes the time by a tick at most.
fn small_changes(rows: &mut Rows<'_>) {
    let mut greatest: f64 = 0.0;
    for name in REGULAR {
        let time = |scene: &Scene| rpoa(scene, "equal", 1).run().arrival_s(0).unwrap_or(-1.0);
        let here = time(scene(name));
        for degrees in [0.0, 90.0, 180.0, 270.0] {
            let mut moved = scene(name).clone();
            moved.robot_mut().start += at_degrees(1e-7, degrees);
            greatest = greatest.max((time(&moved) - here).abs());
        }
    }
    let item = Item::new("six environments, equal angles, start moved by 1e-7 m: greatest change of time")
        .source("specification, section 5")
        .method("planner rpoa with angles = equal, starts moved in four directions")
        .why("the specification's");
    rows.push(
        item,
        Some("≤ 0.1 s".to_owned()),
        format!("{} s", tidy(greatest)),
        "exact".to_owned(),
        tidy(greatest) <= 0.1,
    );
}

/// Six obstacles that walk at random, another walk with every seed: a sentence, ours, whether the claim holds, a note.
fn walkers() -> (String, String, bool, String) {
    const SEEDS: u64 = 100;
    let scene = scene("walkers6");
    let runs = |run: Run| -> Vec<Stepper> { (1..=SEEDS).map(|seed| run.clone().seeded(seed).run()).collect() };
    let (ours, other) = (runs(rpoa(scene, "random", 1)), runs(field(scene, None)));
    let count = |runs: &[Stepper], of: fn(&Stepper) -> bool| runs.iter().filter(|run| of(run)).count();
    let [arrive, field_arrives] = [&ours, &other].map(|runs| count(runs, Stepper::all_arrived));
    let [touch, field_touches] = [&ours, &other].map(|runs| count(runs, |run| run.obstacles.clearance_m < 0.0));
    let both = ours.iter().zip(&other).filter(|(ours, other)| ours.all_arrived() && other.all_arrived());
    let lengths: Vec<[f64; 2]> = both.map(|(ours, other)| [ours, other].map(|run| run.path_length(0))).collect();
    let mean = |i: usize| stats::mean(&lengths.iter().map(|pair| pair[i]).collect::<Vec<_>>());
    let [ours_m, field_m] = [mean(0), mean(1)];
    let longer = arrive >= 95 && field_m > 1.2 * ours_m;
    let text = format!(
        "RPOA {arrive} of {SEEDS} arrive, {touch} touch, {ours_m:.2} m; the field {field_arrives} arrive, {field_touches} touch, \
         {field_m:.2} m"
    );
    let sentence = format!(
        "Among six obstacles that walk at random the field's path is {} longer than that of RPOA: {field_m:.1} m and \
         {ours_m:.1} m on average; RPOA touches an obstacle in {touch} of {SEEDS} runs, the field in {field_touches}.",
        if longer { "much" } else { "not" }
    );
    let note = format!(
        "100 seeds; lengths are means of the {} in which both arrive; the straight line is 12.53 m",
        lengths.len()
    );
    (sentence, text, longer, note)
}

/// What the paper says in words about its scenarios, in the scenes that stand for them.
pub(super) fn claims(rows: &mut Rows<'_>) {
    rows.about(
        "the paper's scenarios 1 to 3 and its abstract, as far as the text survives; specification, section 4",
        "stand-ins for the paper's maps, which are lost. RPOA: planner rpoa with angles = random, guard = false, \
         step_radius = 0.1, ticks of 0.1 s, seeds 1 to 20 (walkers6: 1 to 100). Field: planner apf with the gains of the specification",
        "a claim in words: RPOA has to arrive with at least 19 of 20 seeds; `much longer` is read as more than 20 %",
    );
    let random = |name: &str| Seeds::run(&rpoa(scene(name), "random", 1), 1..=20);
    let apf = |name: &str| field(scene(name), None).run();
    let mut claim = |scenario: &str, words: &str, sentence: String, ours: String, ok: bool, note: &str| {
        let item = Item::new(format!("claim: {scenario}")).against_paper(words, "in words", ok);
        rows.claim(item.note(note).headline(sentence), ours);
    };
    let arrives = |arrives: bool| if arrives { "arrives" } else { "does not arrive" };

    let (ours, other) = (random("rpoa_static").arrivals(), apf("rpoa_static").all_arrived());
    let text = format!("RPOA arrives with {ours} of 20 seeds, the field {}", arrives(other));
    let sentence =
        format!("Among fixed obstacles RPOA arrives with {ours} of 20 seeds, and the field {}.", arrives(other));
    claim("scenario 1, fixed obstacles (rpoa_static)", "both arrive", sentence, text, ours >= 19 && other, "");

    let (ours, other) = (random("rpoa_static_moved4").arrivals(), apf("rpoa_static_moved4").all_arrived());
    let text = format!("RPOA arrives with {ours} of 20 seeds, the field {}", arrives(other));
    let words = "RPOA arrives, the field stops in a local minimum";
    let sentence = format!(
        "With the fourth obstacle moved RPOA arrives with {ours} of 20 seeds, and the field {}.",
        arrives(other)
    );
    let name = "scenario 1, fourth obstacle moved (rpoa_static_moved4)";
    claim(name, words, sentence, text, ours >= 19 && !other, "");

    let (ours, other) = (random("rpoa_moving6").time_mean(), apf("rpoa_moving6").path_length(0));
    let text = format!("RPOA {ours:.2} m, the field {other:.2} m, straight 12.53 m");
    let words = "RPOA near-optimal, the field's path much longer";
    let longer = other > 1.2 * ours;
    let sentence = format!(
        "Among six obstacles on fixed courses the field's path is {} longer than that of RPOA: {other:.1} m and {ours:.1} m.",
        if longer { "much" } else { "not" }
    );
    claim("scenario 2, six moving obstacles (rpoa_moving6)", words, sentence, text, longer, "");

    let (sentence, text, longer, note) = walkers();
    claim("scenario 2, six randomly moving obstacles (walkers6)", words, sentence, text, longer, &note);

    let (ours, other) = (random("rpoa_orbiter").arrivals(), apf("rpoa_orbiter"));
    let (driven, left) = (other.path_length(0), other.distance_to_goal(0));
    let text =
        format!("RPOA arrives with {ours} of 20 seeds, the field drives {driven:.0} m and ends {left:.2} m away");
    let words = "RPOA arrives, the field circles for ever";
    let note = "true of an obstacle that circles at 0.3 rad/s; at 0.5 rad/s (rpoa_orbiter_fast) neither arrives";
    let sentence = format!(
        "With an obstacle that circles round the target RPOA arrives with {ours} of 20 seeds, and the field {}; with a \
         faster one neither does.",
        if other.all_arrived() { "arrives too" } else { "circles for ever" }
    );
    let name = "scenario 2, an obstacle circles round the target (rpoa_orbiter)";
    claim(name, words, sentence, text, ours >= 19 && !other.all_arrived(), note);

    let (ours, other) = (random("rpoa_moving_target").time_mean(), apf("rpoa_moving_target"));
    let (length, time_s) = (other.path_length(0), other.arrival_s(0).unwrap_or(f64::INFINITY));
    let text = format!("RPOA {ours:.2} m in {ours:.2} s, the field {length:.2} m in {time_s:.1} s");
    let ok = ours < length && ours < time_s;
    let sentence = format!("RPOA reaches a moving target in {ours:.1} s, the field in {time_s:.1} s.");
    claim("scenario 3, moving target (rpoa_moving_target)", "RPOA shorter and faster", sentence, text, ok, "");

    let ours = random("rpoa_u_trap").arrivals();
    let text = format!("RPOA arrives with {ours} of 20 seeds");
    let sentence = format!("In a U of nine discs RPOA arrives with {ours} of 20 seeds: it has local minima.");
    claim("free from local minima (rpoa_u_trap)", "free from local minima", sentence, text, ours >= 19, "");
}
