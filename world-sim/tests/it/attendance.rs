//! Which processes answer, and what becomes of those that do not.

use crate::driver::{instance, robot, scenario};
use model::Restart;
use protocol::daemon_to_world::{Absence, Order};
use shoal_world_sim::attendance::Attendance;
use shoal_world_sim::{RobotState, World};
use std::time::Duration;

const SIGNS: &dyn Fn(model::RobotInstance) -> u64 = &|_| 0;

/// One robot in the world, which is restarted when it dies.
fn present() -> (World, Attendance) {
    let mut robot = robot(0, [0.0, 0.0], [9.0, 0.0]);
    robot.restart = Restart::on_failure(1, 3);
    let mut world = World::new(&scenario(vec![robot]));
    tick(&mut world);
    (world, Attendance::new(4, Duration::from_secs(1), 500_000_000))
}

fn tick(world: &mut World) {
    world.open(&mut |_| true);
    world.close(&mut |_| None);
}

fn absent(cause: Absence) -> Order {
    Order::Absent { instance: instance(0, 0), cause }
}

#[test]
fn a_robot_that_dies_while_it_is_held_is_dead() {
    let (mut world, mut attendance) = present();
    attendance.take(&mut world, absent(Absence::Stopped), SIGNS);
    tick(&mut world);
    assert_eq!(world.state(0), Some((instance(0, 0), RobotState::Held { answers: false })));
    attendance.take(&mut world, absent(Absence::Died { signal: Some(9), code: None, words: String::new() }), SIGNS);
    tick(&mut world);
    assert_eq!(world.state(0), Some((instance(0, 1), RobotState::Dead { returns: Some(5) })));
}

#[test]
fn a_robot_that_answers_before_it_is_held_is_not_held() {
    for cause in [Absence::Overdue, Absence::Stopped] {
        let (mut world, mut attendance) = present();
        attendance.take(&mut world, absent(cause), SIGNS);
        assert!(attendance.is_silent(instance(0, 0)));
        attendance.welcome_back(&mut world, &|_| 1);
        assert!(!attendance.is_silent(instance(0, 0)));
        tick(&mut world);
        assert_eq!(world.state(0), Some((instance(0, 0), RobotState::Present { since: 0 })));
    }
}

#[test]
fn a_robot_that_is_stopped_before_it_enters_is_waited_for() {
    let mut world = World::new(&scenario(vec![robot(0, [0.0, 0.0], [9.0, 0.0])]));
    let mut attendance = Attendance::new(4, Duration::from_secs(1), 500_000_000);
    attendance.take(&mut world, absent(Absence::Stopped), SIGNS);
    assert!(attendance.misses(&mut world, &|_| false), "it is not ready, and has not been given up");
    attendance.take(&mut world, absent(Absence::NotStarted { why: String::new() }), SIGNS);
    assert!(!attendance.misses(&mut world, &|_| false));
}
