//! The news of a fleet in words, for a terminal and for the log.

use model::{Event, EventName, RobotIndex, Scenario};

/// What kind of news there is: those that repeat are summed up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum News {
    /// An entry of the log.
    Event(EventName),
    /// The world's process was stopped.
    WorldStopped,
    /// The world's process goes on.
    WorldGoesOn,
    /// The process of a robot was stopped.
    RobotStopped,
    /// The process of a robot goes on.
    RobotGoesOn,
    /// A tick of `lockstep` waits for a robot.
    TickWaits,
    /// That tick goes on.
    TickGoesOn,
}

impl std::fmt::Display for News {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            News::Event(name) => name.fmt(f),
            News::WorldStopped => f.write_str("world-stopped"),
            News::WorldGoesOn => f.write_str("world-goes-on"),
            News::RobotStopped => f.write_str("robot-stopped"),
            News::RobotGoesOn => f.write_str("robot-goes-on"),
            News::TickWaits => f.write_str("tick-waits"),
            News::TickGoesOn => f.write_str("tick-goes-on"),
        }
    }
}

/// An entry of the log, in one line for people.
pub fn describe(scenario: &Scenario, event: &Event) -> String {
    let name = |robot: RobotIndex| scenario.robots.get(robot.at()).map_or_else(String::new, |robot| robot.id.clone());
    let time_s = event.tick as f64 * scenario.clock.dt_s();
    let who = event.robot.map_or_else(String::new, |robot| format!("{} ", name(robot)));
    let detail = match event.kind.detail(&name) {
        detail if detail.is_empty() => detail,
        detail => format!(": {detail}"),
    };
    format!("{time_s:8.2} s  {who}{}{detail}", event.kind.name())
}
