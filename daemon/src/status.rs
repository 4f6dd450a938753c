//! A fleet at this moment: what `shoal ps` shows, put together by the daemon, or without it.

use crate::coordinator::OpenTick;
use crate::processes::state_of;
use bus::{Gate, WorldObserver, clock};
use model::{Mode, ProcessState, Rate, RobotInstance, Scenario};
use protocol::operator_to_daemon::{RobotStatus, Status};
use protocol::world_to_robot::Odometry;
use std::time::Duration;

/// The process of a robot: whose it is, its number, and where it is.
pub struct RobotProcess {
    /// Which process of which robot.
    pub instance: RobotInstance,
    /// Its process, if it has one.
    pub pid: Option<u32>,
    /// Where it is.
    pub state: ProcessState,
    /// How often its robot was restarted.
    pub restarts: u32,
}

/// The fleet of this scenario. `processes` are those of its robots, in their order.
pub fn of(
    scenario: &Scenario,
    processes: impl Iterator<Item = RobotProcess>,
    gate: &Gate,
    observer: &WorldObserver,
    daemon_pid: u32,
    world_pid: u32,
) -> Status {
    let (progress, mut instances) = (gate.progress(), Vec::new());
    let processes = processes.inspect(|process| instances.push(process.instance));
    let robots = processes.zip(&scenario.robots).map(|(RobotProcess { instance, pid, state, restarts }, robot)| {
        let odometry = observer.odometry(instance.index);
        // Before its first process has started it is nowhere; between two its body stands where it stood.
        let there = instance.incarnation > 0 || !matches!(state, ProcessState::Awaited | ProcessState::Starting);
        RobotStatus {
            id: robot.id.clone(),
            index: instance.index,
            incarnation: instance.incarnation,
            restarts,
            pid,
            state,
            planner: robot.planner.clone(),
            position_m: there.then_some([odometry.x_m, odometry.y_m]),
            goal_m: there.then_some([odometry.goal_x_m, odometry.goal_y_m]),
            arrived: odometry.has(Odometry::FLAG_ARRIVED),
            goals_done: odometry.goals_done,
            goals_left: odometry.goals_left,
        }
    });
    let robots: Vec<RobotStatus> = robots.collect();
    let open = open_tick(scenario.clock.mode, gate, observer, instances.into_iter());
    let missing = open.map_or_else(Vec::new, |open| open.missing);
    let name = |instance: &RobotInstance| robots.get(instance.index.at()).map(|robot| robot.id.clone());
    let waits_for = missing.iter().filter_map(name).collect();
    let (paused, rate) = gate.pace();
    let rate = if scenario.clock.mode == Mode::Realtime { Rate::Factor(1.0) } else { rate };
    let tick_age_ns = clock::now_ns().saturating_sub(progress.stamp_ns);
    Status {
        scenario: scenario.name.clone(),
        mode: scenario.clock.mode,
        tick: progress.tick,
        time_s: progress.tick as f64 * scenario.clock.dt_s(),
        daemon_pid,
        world_pid,
        world_state: state_of(world_pid),
        tick_age_s: (progress.stamp_ns > 0).then_some(tick_age_ns as f64 * 1e-9),
        paused,
        rate: rate.factor(),
        waits_for,
        robots,
    }
}

/// A tick of `lockstep` that is open for longer than this is said to wait.
const WAITS: Duration = Duration::from_millis(500);

/// The tick that has been open for too long, with the robots that it waits for. `instances` are those of all robots.
pub fn open_tick(
    mode: Mode,
    gate: &Gate,
    observer: &WorldObserver,
    instances: impl Iterator<Item = RobotInstance>,
) -> Option<OpenTick> {
    let tick = gate.newest_tick().filter(|_| mode == Mode::Lockstep && !gate.over())?;
    let opened = Duration::from_nanos(gate.opened_ns(tick));
    if Duration::from_nanos(clock::now_ns()).saturating_sub(opened) < WAITS {
        return None;
    }
    let takes_part = |instance: &RobotInstance| {
        let odometry = observer.odometry(instance.index);
        odometry.has(Odometry::FLAG_PRESENT) && (odometry.tick, odometry.incarnation) == (tick, instance.incarnation)
    };
    let (answered, missing): (Vec<_>, Vec<_>) =
        instances.filter(takes_part).partition(|instance| gate.answered(*instance, tick));
    (!missing.is_empty()).then_some(OpenTick { tick, opened, missing, others: answered.len() })
}
