//! A fleet at this moment: what `shoal ps` shows, put together by the daemon, or without it.

use crate::processes::state_of;
use bus::{Progress, WorldObserver, clock};
use model::{ProcessState, RobotInstance, Scenario};
use protocol::operator_to_daemon::{RobotStatus, Status};
use protocol::world_to_robot::Odometry;

/// The process of a robot: whose it is, its number, and where it is.
pub struct RobotProcess {
    /// Which process of which robot.
    pub instance: RobotInstance,
    /// Its process, if it has one.
    pub pid: Option<u32>,
    /// Where it is.
    pub state: ProcessState,
}

/// The fleet of this scenario. `processes` are those of its robots, in their order.
pub fn of(
    scenario: &Scenario,
    processes: impl Iterator<Item = RobotProcess>,
    progress: &Progress,
    observer: &WorldObserver,
    daemon_pid: u32,
    world_pid: u32,
) -> Status {
    let robots = processes.zip(&scenario.robots).map(|(RobotProcess { instance, pid, state }, robot)| {
        let odometry = observer.odometry(instance.index);
        // Before its first process has started it is nowhere; between two its body stands where it stood.
        let there = instance.incarnation > 0 || !matches!(state, ProcessState::Awaited | ProcessState::Starting);
        RobotStatus {
            id: robot.id.clone(),
            index: instance.index,
            incarnation: instance.incarnation,
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
        robots: robots.collect(),
    }
}
