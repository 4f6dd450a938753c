//! What happened in a run: the entries of its log.

use crate::body::{BodyKind, Drive};
use crate::ids::RobotIndex;
use crate::radio::Radio;
use crate::task::{GoalSource, Task, TaskEnd};
use crate::timeline::{Fault, FaultSource};
use serde::{Deserialize, Serialize};

/// An entry of the log of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// At which tick.
    pub tick: u64,
    /// The robot that it is about, if it is about one.
    pub robot: Option<RobotIndex>,
    /// What happened.
    pub kind: EventKind,
}

/// The first touch of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Touch {
    /// Simulated time, s: between the ticks.
    pub t_s: f64,
    /// The point where the surfaces met; of bodies that entered the world overlapping, the middle of the overlap, m.
    pub at_m: [f64; 2],
}

/// What a robot touched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Partner {
    /// Another robot.
    Robot(RobotIndex),
    /// An obstacle, by its place in the scenario.
    Obstacle(u32),
    /// A wall of the map.
    Map,
}

impl Partner {
    /// Its name, `obstacle` and its place, or `the map`. `name` knows the robots.
    pub fn words(self, name: &dyn Fn(RobotIndex) -> String) -> String {
        match self {
            Partner::Robot(other) => name(other),
            Partner::Obstacle(place) => format!("obstacle {place}"),
            Partner::Map => "the map".to_owned(),
        }
    }
}

/// How a process that should answer does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Silence {
    /// It did not answer within the straggler limit.
    Overdue,
    /// It was stopped (SIGSTOP).
    Stopped,
}

/// Declares the events: each with its data and its name.
macro_rules! events {
    ($( $(#[doc = $help:literal])+ $kind:ident $({ $($(#[doc = $about:literal])+ $field:ident: $type:ty,)+ })? = $word:literal; )+) => {
        /// What happened, with its data.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        pub enum EventKind {
            $( $(#[doc = $help])+ $kind $({ $($(#[doc = $about])+ $field: $type,)+ })?, )+
        }

        /// What happened, without its data: the names of events, as reports have them.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum EventName {
            $( $(#[doc = $help])+ #[serde(rename = $word)] $kind, )+
        }

        impl EventKind {
            /// Its name.
            pub fn name(&self) -> EventName {
                match self { $( EventKind::$kind { .. } => EventName::$kind, )+ }
            }
        }

        impl EventName {
            /// All of them, each with what it means.
            pub const ALL: &[(EventName, &str)] = &[ $( (EventName::$kind, concat!($($help),+)), )+ ];

            /// Its word.
            pub const fn word(self) -> &'static str {
                match self { $( EventName::$kind => $word, )+ }
            }
        }
    };
}

events! {
    /// The robot entered the world.
    Joined {
        /// How often its process was started before.
        incarnation: u32,
    } = "joined";
    /// The robot takes part again, with a new process.
    Restarted {
        /// How often its process was started before.
        incarnation: u32,
    } = "restarted";
    /// The robot takes part again, with the same process.
    Resumed {
        /// How often its process was started before.
        incarnation: u32,
        /// It had been held, and answers again.
        held: bool,
    } = "resumed";
    /// The robot left for good, as it was asked to.
    Left = "left";
    /// The robot was given a task.
    Task {
        /// Who gave it.
        source: GoalSource,
        /// The task.
        task: Task,
        /// How many goals it gave up for it.
        given_up: u32,
    } = "task";
    /// The robot reached the goal of a task.
    TaskDone {
        /// Who had given it.
        source: GoalSource,
    } = "task-done";
    /// The robot has a task no more that it has not done.
    TaskDropped {
        /// Who had given it.
        source: GoalSource,
        /// Why.
        why: TaskEnd,
    } = "task-dropped";
    /// The robot reached its last goal, for the first time.
    Arrived = "arrived";
    /// The robot had arrived at its last goal and left its tolerance.
    OffGoal {
        /// How far from it, m.
        distance_m: f64,
    } = "off-goal";
    /// Two bodies began to overlap.
    Contact {
        /// What the robot touched.
        with: Partner,
        /// Where and when first.
        touch: Touch,
    } = "contact";
    /// The timeline or an operator killed the robot's process.
    Killed {
        /// Who wanted it.
        source: FaultSource,
    } = "killed";
    /// The robot's process ended unasked.
    Died {
        /// The signal, if it was one.
        signal: Option<i32>,
        /// The exit code, if there was one.
        code: Option<i32>,
        /// What it printed last, or what else is known; may be empty.
        words: String,
    } = "died";
    /// The robot's process ended and is not restarted: `restart_limit` is reached.
    RestartLimit {
        /// Restarts in the window.
        restarts: u32,
        /// The window, ticks; `None` is the whole run.
        window_ticks: Option<u64>,
    } = "restart-limit";
    /// The timeline or an operator stopped the robot's process.
    Paused {
        /// Who wanted it.
        source: FaultSource,
        /// It goes on at this tick; `None`: when it is resumed.
        until_tick: Option<u64>,
    } = "paused";
    /// The robot did not answer and stands still until it does.
    Held {
        /// How it did not.
        silence: Silence,
    } = "held";
    /// The robot did not answer and was taken out.
    Dropped {
        /// How it did not.
        silence: Silence,
    } = "dropped";
    /// The robot's process could not be started, or was not ready in time.
    NotStarted {
        /// The cause, with the words of the kernel where it was the kernel that refused.
        why: String,
    } = "not-started";
    /// The robot could not hear one that it should hear, or could not be heard.
    Deaf {
        /// The cause, with the words of the kernel.
        why: String,
    } = "deaf";
    /// The radio changed.
    Radio {
        /// What it is from now on.
        radio: Radio,
    } = "radio";
    /// The timeline or an operator put a fault on the robot that lasts.
    Fault {
        /// Who wanted it.
        source: FaultSource,
        /// What it is.
        fault: Fault,
        /// It ends at this tick; `None`: when the robot is resumed.
        until_tick: Option<u64>,
    } = "fault";
    /// A fault is over.
    FaultOver {
        /// Which.
        fault: Fault,
    } = "fault-over";
    /// Time stood still for the world's process, and went on from there.
    Gap {
        /// For so long, ms.
        lost_ms: u64,
    } = "gap";
    /// The world's process ended, and another one went on from its last state.
    WorldRestarted {
        /// This many ticks were simulated after that state, and are lost.
        ticks: u64,
        /// No tick was open for so long, ms.
        away_ms: u64,
    } = "world-restarted";
    /// The world did not do what it was asked to.
    Ignored {
        /// What it was asked for.
        order: String,
        /// Why it was not done.
        why: String,
    } = "ignored";
    /// The robot's planner found no way and gave up.
    GaveUp = "gave-up";
    /// The robot's process sent a command that does not fit its body; it stands still instead. Logged once per robot.
    BadCommand {
        /// The command.
        drive: Drive,
        /// The body.
        body: BodyKind,
    } = "bad-command";
    /// An operator gave the robot a new process.
    Replaced {
        /// The incarnation that takes over.
        incarnation: u32,
    } = "replaced";
}

impl EventKind {
    /// Of a contact, where and when it was.
    pub fn touch(&self) -> Option<Touch> {
        if let EventKind::Contact { touch, .. } = self { Some(*touch) } else { None }
    }

    /// More about it, for people. `name` knows the robots.
    pub fn detail(&self, name: &dyn Fn(RobotIndex) -> String) -> String {
        let of_incarnation = |incarnation: u32| match incarnation {
            0 => String::new(),
            _ => format!("incarnation {incarnation}"),
        };
        let until = |tick: Option<u64>| match tick {
            Some(tick) => format!("until tick {tick}"),
            None => "until resumed".to_owned(),
        };
        match self {
            EventKind::Resumed { held: true, .. } => "answers again".to_owned(),
            EventKind::Joined { incarnation }
            | EventKind::Restarted { incarnation }
            | EventKind::Resumed { incarnation, .. } => of_incarnation(*incarnation),
            EventKind::Task { source, task, given_up } => {
                let yaw = task.yaw_rad.map_or_else(String::new, |yaw_rad| format!(", {yaw_rad} rad"));
                let when = match (task.now, given_up) {
                    (false, _) => "queued".to_owned(),
                    (true, 0) => "now".to_owned(),
                    (true, given_up) => format!("now, {given_up} goals are given up"),
                };
                let deadline =
                    task.deadline_s.map_or_else(String::new, |deadline_s| format!(", within {deadline_s} s"));
                format!("{source}: ({}, {}{yaw}), {when}{deadline}", task.goal.x, task.goal.y)
            }
            EventKind::TaskDone { source } => source.to_string(),
            EventKind::TaskDropped { source, why } => format!("{source}: {}", why.word()),
            EventKind::OffGoal { distance_m } => format!("{distance_m:.3} m"),
            EventKind::Contact { with, .. } => format!("with {}", with.words(name)),
            EventKind::Killed { source } => source.to_string(),
            EventKind::Replaced { incarnation } => of_incarnation(*incarnation),
            EventKind::Died { signal, code, words } => {
                let ending = match (signal, code) {
                    (Some(signal), _) => format!("signal {signal}"),
                    (None, Some(code)) => format!("exit code {code}"),
                    (None, None) => String::new(),
                };
                let parts = [ending.as_str(), words.as_str()];
                parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(": ")
            }
            EventKind::RestartLimit { restarts, window_ticks } => {
                let plural = if *restarts == 1 { "" } else { "s" };
                let window = window_ticks.map_or_else(String::new, |window| format!(" within {window} ticks"));
                format!("{restarts} restart{plural}{window}, which is its restart_limit: it stays dead")
            }
            EventKind::Paused { source, until_tick } => format!("{source}: {}", until(*until_tick)),
            EventKind::Fault { source, fault, until_tick } => format!("{source}: {fault}, {}", until(*until_tick)),
            EventKind::FaultOver { fault } => fault.to_string(),
            EventKind::Held { silence } | EventKind::Dropped { silence } => match silence {
                Silence::Overdue => "overdue".to_owned(),
                Silence::Stopped => "stopped".to_owned(),
            },
            EventKind::NotStarted { why } | EventKind::Deaf { why } => why.clone(),
            EventKind::Radio { radio: Radio { delay_ticks, drop, noise_m } } => {
                format!("delay {delay_ticks} ticks, drop {drop}, noise {noise_m} m")
            }
            EventKind::Gap { lost_ms } => format!("{lost_ms} ms"),
            EventKind::WorldRestarted { ticks, away_ms } => {
                format!("{ticks} ticks are lost, and no tick was open for {away_ms} ms")
            }
            EventKind::Ignored { order, why } => format!("{order}: {why}"),
            EventKind::GaveUp => "its method found no way".to_owned(),
            EventKind::BadCommand { drive, body } => format!("{drive:?} for a {}", body.word()),
            EventKind::Left | EventKind::Arrived => String::new(),
        }
    }
}

impl EventName {
    /// Whether it says that a robot lacked something that it needed, so that the run is not that of its scenario.
    pub fn impairs(self) -> bool {
        matches!(self, EventName::NotStarted | EventName::Deaf)
    }

    /// Whether it says that a robot did not answer in time.
    pub fn is_straggling(self) -> bool {
        matches!(self, EventName::Held | EventName::Dropped)
    }

    /// Whether the event gets a line of its own at `tick`. Joins at the start do not, and arrivals and contacts are counted.
    pub fn is_notable(self, tick: u64) -> bool {
        match self {
            EventName::Joined => tick > 0,
            EventName::Arrived | EventName::Contact => false,
            _ => true,
        }
    }
}

impl std::fmt::Display for EventName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.word())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TaskId;
    use nalgebra::Point2;

    #[test]
    fn an_event_says_what_its_data_say() {
        let task = |now: bool| Task { yaw_rad: now.then_some(1.5), now, ..Task::to(Point2::new(4.0, -2.5)) };
        let source = GoalSource::Operator(TaskId(7));
        let contact = |with| EventKind::Contact { with, touch: Touch::default() };
        let died = |signal, code, words: &str| EventKind::Died { signal, code, words: words.to_owned() };
        let cases = [
            (EventKind::Joined { incarnation: 0 }, "joined", ""),
            (EventKind::Restarted { incarnation: 2 }, "restarted", "incarnation 2"),
            (EventKind::Resumed { incarnation: 2, held: true }, "resumed", "answers again"),
            (EventKind::Task { source, task: task(false), given_up: 0 }, "task", "task 7: (4, -2.5), queued"),
            (
                EventKind::Task { source: GoalSource::Timeline, task: task(true), given_up: 3 },
                "task",
                "timeline: (4, -2.5, 1.5 rad), now, 3 goals are given up",
            ),
            (EventKind::TaskDropped { source, why: TaskEnd::RobotGone }, "task-dropped", "task 7: robot-gone"),
            (contact(Partner::Robot(RobotIndex(3))), "contact", "with r03"),
            (contact(Partner::Obstacle(3)), "contact", "with obstacle 3"),
            (contact(Partner::Map), "contact", "with the map"),
            (died(Some(11), None, "oh"), "died", "signal 11: oh"),
            (died(None, Some(3), ""), "died", "exit code 3"),
            (died(None, None, "gone"), "died", "gone"),
            (
                EventKind::RestartLimit { restarts: 3, window_ticks: Some(500) },
                "restart-limit",
                "3 restarts within 500 ticks, which is its restart_limit: it stays dead",
            ),
            (EventKind::Held { silence: Silence::Stopped }, "held", "stopped"),
            (EventKind::Killed { source: FaultSource::Operator }, "killed", "operator"),
            (EventKind::Replaced { incarnation: 2 }, "replaced", "incarnation 2"),
            (
                EventKind::Paused { source: FaultSource::Timeline, until_tick: Some(20) },
                "paused",
                "timeline: until tick 20",
            ),
            (
                EventKind::Fault { source: FaultSource::Operator, fault: Fault::Delay { ticks: 5 }, until_tick: None },
                "fault",
                "operator: delay of 5 ticks, until resumed",
            ),
        ];
        for (kind, word, detail) in cases {
            assert_eq!((kind.name().word(), &*kind.detail(&|robot| format!("r{:02}", robot.0))), (word, detail));
        }
        let json = serde_json::to_string(&EventName::NotStarted).unwrap();
        assert_eq!(json, "\"not-started\"");
        assert_eq!(serde_json::from_str::<EventName>(&json).unwrap(), EventName::NotStarted);
    }
}
