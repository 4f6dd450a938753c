//! The environments with several robots, each robot a process. The oracle is the one-thread simulator of `reproduce`
//! with poses that are a tick old and whose age is known, as they are between processes.

use super::{Fleet, Stop, begin, lockstep};
use model::{AtEnd, BodyKind, Scenario};
use reproduce::decentralized_apf::run as one_thread;
use reproduce::environment::{Environment, Motion, environments_of};
use reproduce::row::{Item, Rows};
use reproduce::simulate::Run;

pub(super) fn run(rows: &mut Rows<'_>) -> Result<(), Stop> {
    for environment in environments_of("apf_").filter(|environment| environment.robots.len() > 1) {
        begin(rows, &format!("{} as processes", environment.name))?;
        let oracle = Run { delay_ticks: 1, age_known: true, ..one_thread(environment, "recommended", BodyKind::Point) };
        let ours = lockstep(scenario(environment, &oracle)?)?.outcome;
        let oracle = oracle.run();
        let item = |what: &str| {
            Item::new(format!("{} recommended-point, every robot a process in lockstep: {what}", environment.name))
                .note("oracle: the one-thread simulator with poses one tick old")
        };
        rows.exact(item("arrives"), oracle.arrives(), ours.robots.iter().all(|robot| robot.arrived));
        let tolerance = if environment.name == "apf_antipodal8" { 2.5 } else { 0.3 };
        for (i, expected) in oracle.arrival_s.iter().enumerate() {
            let time_s = ours.robots.iter().find(|robot| robot.slot as usize == i).and_then(|robot| robot.time_s);
            let what = format!("arrival of robot {i}");
            rows.number(item(&what), tidy(expected.unwrap_or(-1.0)), tidy(time_s.unwrap_or(-1.0)), tolerance, "s");
        }
        let clearance = ours.min_clearance_m.unwrap_or(f64::INFINITY);
        // Here it is swept between the ticks; robots that chatter for ever come nearer there, by what both move in one.
        let (tolerance, note) = match oracle.arrives() {
            true => (0.02, "ours is swept between ticks, the oracle's is sampled at them"),
            false => {
                (0.1, "ours is swept between ticks, where two robots that chatter come nearer by what they move in one")
            }
        };
        let item = item("robot clearance").note(note);
        rows.number(item, tidy(oracle.robot_clearance), tidy(clearance), tolerance, "m");
    }
    Ok(())
}

fn scenario(environment: &Environment, run: &Run<'_>) -> Result<Scenario, Stop> {
    let defaults = format!("speed_mps_max = {:?}\n", run.speed_mps_max);
    let mut fleet = Fleet::new(&environment.name, 1.0 / run.dt_s, run.t_max_s, &defaults, run.method, &run.params);
    for (i, robot) in environment.robots.iter().enumerate() {
        let more = format!("radius_m = {:?}\ngoal_tolerance_m = {:?}", robot.radius, robot.arrival_tolerance);
        fleet.robot(i, robot.start.into(), robot.goal.into(), &more);
    }
    environment.obstacles.iter().for_each(|disc| fleet.disc(disc.center.into(), disc.radius));
    let mut scenario = fleet.scenario()?;
    for (obstacle, disc) in scenario.obstacles.iter_mut().zip(&environment.obstacles) {
        obstacle.motion = disc.motion.map(|motion| match motion {
            Motion::Pingpong { a, b, speed } => {
                model::Motion::Waypoints { points: vec![a, b], speed_mps: speed, then: AtEnd::PingPong }
            }
            Motion::Orbit { center, radius, omega, phase } => {
                model::Motion::Orbit { center, radius_m: radius, omega_radps: omega, phase_rad: phase }
            }
        });
    }
    Ok(scenario)
}

/// Without the noise of the last digits.
fn tidy(x: f64) -> f64 {
    (x * 1e9).round() / 1e9
}
