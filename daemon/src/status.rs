//! A fleet at this moment: what `shoal ps` shows, put together by the daemon, or without it.

use crate::processes::state_word;
use bus::{Progress, WorldObserver, clock};
use model::{RobotInstance, Scenario};
use protocol::operator_to_daemon::{RobotStatus, Status};
use protocol::world_to_robot::Odometry;

/// The life of a robot: whose it is, its process, and a word for its state.
pub struct Life {
    /// Slot and incarnation.
    pub instance: RobotInstance,
    /// Its process, if it has one.
    pub pid: Option<u32>,
    /// `running`, `stopped`, `dead` and so on.
    pub state: &'static str,
}

/// The fleet of this scenario. `lives` are those of its robots, by slot.
pub fn of(
    scenario: &Scenario,
    lives: impl Iterator<Item = Life>,
    progress: &Progress,
    observer: &WorldObserver,
    daemon_pid: u32,
    world_pid: u32,
) -> Status {
    let robots = lives.zip(&scenario.robots).map(|(Life { instance, pid, state }, robot)| {
        let odometry = observer.odometry(instance.index);
        RobotStatus {
            id: robot.id.clone(),
            index: instance.index,
            incarnation: instance.incarnation,
            pid,
            state: state.to_owned(),
            planner: robot.planner.clone(),
            position_m: [odometry.x_m, odometry.y_m],
            goal_m: [odometry.goal_x_m, odometry.goal_y_m],
            arrived: odometry.has(Odometry::FLAG_ARRIVED),
            goals_done: odometry.goals_done,
            goals_left: odometry.goals_left,
        }
    });
    let tick_age_ns = clock::now_ns().saturating_sub(progress.stamp_ns);
    Status {
        scenario: scenario.name.clone(),
        mode: scenario.clock.mode.word().to_owned(),
        tick: progress.tick,
        time_s: progress.tick as f64 * scenario.clock.dt_s(),
        daemon_pid,
        world_pid,
        world_state: state_word(world_pid).to_owned(),
        tick_age_s: (progress.stamp_ns > 0).then_some(tick_age_ns as f64 * 1e-9),
        robots: robots.collect(),
    }
}
