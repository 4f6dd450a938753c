//! How things are shown, in records and in exports: colours, sizes, names of frames and levels of events.

use model::EventName;

/// The frame in which everything is.
pub(crate) const WORLD: &str = "world";
/// How high robots and obstacles are drawn, m.
pub(crate) const ROBOT_HEIGHT_M: f64 = 0.2;
pub(crate) const OBSTACLE_HEIGHT_M: f64 = 0.5;
/// How thick lines are drawn, m.
pub(crate) const LINE_M: f64 = 0.04;

/// Red, green, blue and opacity, 0 to 1.
pub(crate) type Color = [f64; 4];
pub(crate) const GREY: Color = [0.45, 0.48, 0.52, 1.0];
pub(crate) const MOVING: Color = [0.85, 0.45, 0.2, 1.0];
pub(crate) const DARK: Color = [0.1, 0.1, 0.12, 1.0];
/// Tell robots apart; from the palette of Okabe and Ito, which the colour-blind can tell apart.
const ROBOTS: [Color; 6] = [
    [0.0, 0.45, 0.7, 1.0],
    [0.9, 0.62, 0.0, 1.0],
    [0.0, 0.62, 0.45, 1.0],
    [0.8, 0.47, 0.65, 1.0],
    [0.34, 0.71, 0.91, 1.0],
    [0.84, 0.37, 0.0, 1.0],
];

/// The colour of a robot.
pub(crate) fn color_of(slot: u32) -> Color {
    ROBOTS[slot as usize % ROBOTS.len()]
}

/// The frame that moves with a moving obstacle.
pub(crate) fn obstacle_frame(index: u32) -> String {
    format!("obstacle-{index}")
}

/// The level of an event: 2 info, 3 warning, 4 error.
pub(crate) fn level(name: EventName) -> u64 {
    use EventName::{
        BadCommand, Contact, Deaf, Died, Dropped, Gap, GaveUp, Held, Ignored, Killed, NotStarted, OffGoal,
        RestartLimit, WorldRestarted,
    };
    match name {
        Contact | Died | Dropped | NotStarted | Deaf | BadCommand | RestartLimit | WorldRestarted => 4,
        Held | Killed | Gap | GaveUp | Ignored | OffGoal => 3,
        _ => 2,
    }
}
