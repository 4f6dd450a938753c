//! What is known of one robot: its present life, the one that is to come, and their process.

use model::{ProcessState, RobotIndex, RobotInstance};
use std::time::Duration;

/// What the coordinator knows of one robot.
#[derive(Clone, Debug)]
pub struct Member {
    /// The life that runs, ran last, or is awaited.
    pub instance: RobotInstance,
    /// Its process, until it is reaped.
    pub pid: Option<u32>,
    /// Where it is.
    pub state: ProcessState,
    /// The life to start as soon as the present process is reaped.
    pub(super) next: Option<RobotInstance>,
    /// The number of lives that the slot has had when its robot has left.
    pub(super) lives: u32,
    /// The first life of the present robot.
    pub(super) first_life: u32,
    /// An operator wants it to leave.
    pub(super) leaving: bool,
    /// The kernel says that its process is stopped, for any reason.
    pub(super) halted: bool,
    /// Since when it is stopped, if time was looked at before.
    pub(super) stopped_at: Option<Duration>,
    /// When the present process was started.
    pub(super) started_at: Duration,
    /// Since when its process is to end, because its robot has left or its next life waits for that, once the clock has
    /// been looked at.
    pub(super) ending_since: Option<Duration>,
}

impl Member {
    /// How often the robot was restarted.
    pub fn restarts(&self) -> u32 {
        self.instance.incarnation.saturating_sub(self.first_life)
    }

    /// The life that is to come, or the present one.
    pub(super) fn newest(&self) -> RobotInstance {
        self.next.unwrap_or(self.instance)
    }

    /// Whether its body may be in the world.
    pub fn in_world(&self) -> bool {
        use ProcessState::{Dead, Paused, RestartLimit, Running, Stopped};
        matches!(self.state, Running | Paused | Stopped | Dead | RestartLimit)
    }

    pub(super) fn new(index: RobotIndex) -> Member {
        let instance = RobotInstance { index, incarnation: 0 };
        Member {
            instance,
            pid: None,
            state: ProcessState::Awaited,
            next: None,
            lives: 0,
            first_life: 0,
            leaving: false,
            halted: false,
            stopped_at: None,
            started_at: Duration::ZERO,
            ending_since: None,
        }
    }

    /// Whether another robot may have its slot and its name.
    pub(super) fn is_free(&self) -> bool {
        matches!(self.state, ProcessState::Left | ProcessState::Refused) && self.next.is_none()
    }

    /// Another robot has the slot from here on; its first life. A process of the robot before may still be there.
    pub(super) fn come_again(&mut self) -> RobotInstance {
        (self.state, self.leaving) = (ProcessState::Awaited, false);
        let instance = RobotInstance { incarnation: self.lives, ..self.instance };
        self.first_life = self.lives;
        if self.pid.is_none() {
            self.instance = instance;
        }
        instance
    }
}
