//! What can be run as it stands and yet is hardly meant: told before the run and in its report.

use crate::check::Source;
use crate::problems::{Origin, Report};
use model::{BodyKind, Clock, Robot, TimelineAction, TimelineEvent};
use std::collections::HashSet;

/// A robot that drives farther than this many goal tolerances in a tick jumps over its goals.
const TOLERANCES_PER_TICK_MAX: f64 = 2.0;

/// Checks a scenario whose values are right one by one.
pub(crate) fn check(robots: &[Robot], sources: &[Source], events: &[TimelineEvent], clock: Clock, report: &mut Report) {
    goals_apart(robots, sources, events, report);
    let slow = |robot: &Robot| slow_method(robot, clock);
    of_robots(
        robots,
        sources,
        &slow,
        "leave the parameters that limit it out: their defaults follow the speed limit",
        report,
    );
    let coarse = |robot: &Robot| coarse_ticks(robot, clock);
    of_robots(robots, sources, &coarse, "raise clock.tick_hz or goal_tolerance_m, or lower speed_mps_max", report);
    let radius_max = robots.iter().fold(0.0, |most: f64, robot| most.max(robot.radius_m));
    let blind = |robot: &Robot| blind_beyond_radio(robot, radius_max, robots.len());
    of_robots(robots, sources, &blind, "raise radio_range_m, or let sees_robots be true", report);
}

/// Robots whose bodies do not fit beside each other on their last goals. A sweep along x, as for their starts.
fn goals_apart(robots: &[Robot], sources: &[Source], events: &[TimelineEvent], report: &mut Report) {
    // Where a robot ends up that leaves, or is sent somewhere else, is no matter of its goal.
    let elsewhere: HashSet<usize> = (events.iter())
        .filter_map(|event| match event.what {
            TimelineAction::Leave { robot } | TimelineAction::Task { robot, .. } => Some(robot),
            _ => None,
        })
        .collect();
    let stays = |slot: &usize| {
        let robot = &robots[*slot];
        robot.kind != BodyKind::TwoLinkArm && robot.goal_motion.is_none() && !elsewhere.contains(slot)
    };
    let mut places: Vec<(usize, nalgebra::Point2<f64>, f64)> = (0..robots.len())
        .filter(stays)
        .filter_map(|slot| Some((slot, *robots[slot].goals.last()?, robots[slot].radius_m)))
        .filter(|(_, goal, _)| goal.coords.iter().all(|x| x.is_finite()))
        .collect();
    places.sort_by(|a, b| (a.1.x - a.2).total_cmp(&(b.1.x - b.2)).then(a.0.cmp(&b.0)));
    for (index, &(slot, goal, radius_m)) in places.iter().enumerate() {
        let beside = places[index + 1..].iter().take_while(|(_, other, r)| other.x - r < goal.x + radius_m);
        let too_near = |(_, other, r): &&(usize, nalgebra::Point2<f64>, f64)| {
            nalgebra::distance(&goal, other) < (radius_m + r) * (1.0 - 1e-9)
        };
        let Some(&(other, place, other_m)) = beside.into_iter().find(too_near) else { continue };
        let (first, second) = (slot.min(other), slot.max(other));
        let (key, origin) = &sources[second].goal;
        let (apart_m, needed_m) = (nalgebra::distance(&goal, &place), radius_m + other_m);
        let message = format!(
            "the goals of `{}` and `{}` are {apart_m:.3} m apart, their bodies need {needed_m:.3} m",
            robots[second].id, robots[first].id
        );
        report.warn(*origin, key, message, "who comes second cannot stay on its goal: move one of them");
    }
}

/// Says the same of all robots for which `what` has the same to say once.
fn of_robots(
    robots: &[Robot],
    sources: &[Source],
    what: &dyn Fn(&Robot) -> Option<String>,
    hint: &str,
    report: &mut Report,
) {
    let mut said: Vec<(String, usize, usize)> = Vec::new();
    for (slot, robot) in robots.iter().enumerate() {
        let Some(message) = what(robot) else { continue };
        match said.iter_mut().find(|(known, ..)| *known == message) {
            Some((.., more)) => *more += 1,
            None => said.push((message, slot, 0)),
        }
    }
    for (message, slot, more) in said {
        let (key, origin): (&str, Origin) = (sources[slot].id.0.trim_end_matches(".id"), sources[slot].id.1);
        report.warn(origin, key, format!("`{}`{}: {message}", robots[slot].id, and_others(more)), hint);
    }
}

/// Methods whose defaults are absolute lengths, for bodies of another size: one warning for each method, with the figures of
/// the first such robot. Not for the scenarios of papers, whose robots have a size of their own.
pub(crate) fn of_other_sizes(robots: &[Robot], sources: &[Source], report: &mut Report) {
    for method in planners::METHODS {
        let misfits = |slot: usize| {
            let robot = &robots[slot];
            let drives = robot.planner == method.name && robot.agent.is_none() && robot.kind != BodyKind::TwoLinkArm;
            let misfits = if drives { method.misfits(&robot.params, robot.radius_m) } else { Vec::new() };
            (!misfits.is_empty()).then_some((slot, misfits))
        };
        let mut all = (0..robots.len()).filter_map(misfits);
        let Some((slot, misfits)) = all.next() else { continue };
        let said = misfits.iter().map(|misfit| format!("{} {} {}", misfit.name, misfit.default, misfit.unit));
        let message = format!(
            "`{}`{}: defaults of `{}` are for bodies of {} m, this one has {} m: {}",
            robots[slot].id,
            and_others(all.count()),
            method.name,
            planners::RADIUS_M,
            robots[slot].radius_m,
            said.collect::<Vec<_>>().join(", ")
        );
        let fits =
            misfits.iter().map(|misfit| format!("planners.{}.{}={}", method.name, misfit.name, short(misfit.fits)));
        let hint = format!(
            "in proportion: {}; or take a planner that measures in radii: {}",
            fits.collect::<Vec<_>>().join(" "),
            of_any_size(robots[slot].kind)
        );
        let (key, origin) = (sources[slot].id.0.trim_end_matches(".id"), sources[slot].id.1);
        report.warn(origin, key, message, hint);
    }
}

/// The methods that can drive this kind of body at any size.
fn of_any_size(kind: BodyKind) -> String {
    let fitting = planners::METHODS.iter().filter(|method| method.lengths.is_empty() && method.kinds.contains(&kind));
    fitting.map(|method| method.name).filter(|name| *name != "straight").collect::<Vec<_>>().join(", ")
}

/// A number with two digits that count.
fn short(number: f64) -> f64 {
    format!("{number:.1e}").parse().unwrap_or(number)
}

fn and_others(more: usize) -> String {
    match more {
        0 => String::new(),
        1 => " and another one".to_string(),
        more => format!(" and {more} others"),
    }
}

fn coarse_ticks(robot: &Robot, clock: Clock) -> Option<String> {
    let (per_tick_m, tolerance_m) = (robot.limits.speed_mps_max * clock.dt_s(), robot.goal_tolerance_m);
    (robot.kind != BodyKind::TwoLinkArm && per_tick_m > TOLERANCES_PER_TICK_MAX * tolerance_m).then(|| {
        let times = per_tick_m / tolerance_m;
        format!("drives up to {per_tick_m:.3} m in a tick, {times:.1} times its goal tolerance of {tolerance_m} m")
    })
}

/// A robot that knows others by radio alone, and hears them only when their bodies touch.
fn blind_beyond_radio(robot: &Robot, radius_max: f64, robots: usize) -> Option<String> {
    let (hears_m, needs_m) = (robot.radio_range_m, robot.radius_m + radius_max);
    (robots > 1 && !robot.sees_robots && hears_m <= needs_m).then(|| {
        format!("knows robots by radio alone, which reaches {hears_m} m: their bodies touch at up to {needs_m:.3} m")
    })
}

/// A method that, with its parameters, cannot use the speed that its body has. An agent of one's own has its own method.
fn slow_method(robot: &Robot, clock: Clock) -> Option<String> {
    let method = planners::find(&robot.planner).filter(|_| robot.agent.is_none())?;
    let (asks_mps, can_mps) = ((method.speed_mps)(&robot.params, clock.dt_s()), robot.limits.speed_mps_max);
    (asks_mps < can_mps * (1.0 - 1e-9)).then(|| {
        format!(
            "`{}` with these parameters drives at most {asks_mps:.3} m/s of the {can_mps} m/s that it may",
            method.name
        )
    })
}
