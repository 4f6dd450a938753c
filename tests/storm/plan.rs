//! The fleet of a seed: its scenario, its timeline, and how much room its rings have.

use crate::dice::Dice;
use model::{Mode, Radio, Scenario, Task, TimelineAction, TimelineEvent};
use nalgebra::Point2;
use shoal_tests::scenario;
use std::fmt::Write;

/// Robots that operators may add.
pub(crate) const GUESTS_MAX: usize = 4;
/// How long a process may take to become ready.
pub(crate) const START_LIMIT_MS: u64 = 800;
/// Ticks after the storm until the end: time enough for everybody to come back.
const SETTLE_TICKS: u64 = 120;

pub(crate) struct Plan {
    pub(crate) scenario: Scenario,
    pub(crate) orders_bytes: usize,
    pub(crate) notices_bytes: usize,
    /// From this tick on nothing bad happens.
    pub(crate) calm_tick: u64,
    /// The end is asked for at this tick, in the middle of the storm.
    pub(crate) break_off: Option<u64>,
    /// The weather does something once within this time, ms.
    pub(crate) pause_ms: u64,
}

impl Plan {
    /// A fleet of this many robots, or of as many as the seed wants.
    pub(crate) fn new(seed: u64, robots: Option<usize>) -> Plan {
        let mut dice = Dice::new(seed ^ 0x706c_616e);
        let robots = robots.unwrap_or_else(|| 2 + dice.below(9));
        let calm_tick = 60 + dice.below(120) as u64;
        let mode = dice.pick(&[Mode::Lockstep, Mode::Realtime]);
        let break_off = dice.permille(150).then(|| 1 + dice.below(calm_tick as usize) as u64);
        let mut scenario = base(seed, robots, calm_tick + SETTLE_TICKS, &mut dice);
        scenario.clock.mode = mode;
        scenario.events = timeline(robots, calm_tick, &mut dice);
        Plan {
            scenario,
            // The largest order, that of a new robot, takes about half a kilobyte.
            orders_bytes: dice.pick(&[1024, 2048, 256 * 1024]),
            notices_bytes: dice.pick(&[256, 1024, 1024 * 1024]),
            calm_tick,
            break_off,
            pause_ms: dice.pick(&[60, 200, 500]),
        }
    }

    /// The same fleet with rings in which what is said of a whole fleet at once has room.
    pub(crate) fn with_room(self) -> Plan {
        Plan { orders_bytes: self.orders_bytes.max(2048), notices_bytes: 1 << 20, ..self }
    }

    /// The same fleet without a timeline, in `lockstep` and with room for everything: what `single` runs as well.
    pub(crate) fn calm(seed: u64) -> Plan {
        let mut plan = Plan::new(seed, None);
        plan.scenario.clock.mode = Mode::Lockstep;
        plan.scenario.events.clear();
        Plan { orders_bytes: 1 << 20, notices_bytes: 1 << 20, calm_tick: 0, break_off: None, ..plan }
    }
}

fn base(seed: u64, robots: usize, ticks: u64, dice: &mut Dice) -> Scenario {
    let restart = if dice.permille(150) { "never" } else { "on-failure" };
    let mut text = format!(
        r#"
        [world]
        x_m = [-60, 60]
        y_m = [-60, 60]
        [clock]
        tick_hz = 10
        seed = {seed}
        duration_s = {}
        stop = "{}"
        [fleet]
        max_robots = {}
        straggler = "{}"
        straggler_limit_s = {}
        command_timeout_s = 0.5
        start_limit_s = {}
        [defaults]
        planner = "{}"
        radio_range_m = 5
        sensor_range_m = 3
        restart = "{restart}"
        "#,
        ticks as f64 / 10.0,
        dice.pick(&["duration", "duration", "arrived"]),
        robots + GUESTS_MAX,
        dice.pick(&["wait", "hold", "drop"]),
        dice.pick(&["0.3", "1"]),
        START_LIMIT_MS as f64 / 1000.0,
        dice.pick(&["straight", "straight", "apf"]),
    );
    if restart != "never" {
        let _ = writeln!(text, "restart_limit = {}", dice.pick(&["1", "3", "50", "50"]));
        let _ = writeln!(text, "restart_delay_s = {}", dice.pick(&["0", "0.3", "1.2"]));
    }
    for slot in 0..robots {
        let (y_m, goal_m) = (3.0 * slot as f64, 3.0 + dice.below(15) as f64);
        let _ = writeln!(text, "[[robot]]\nid = \"r{slot}\"\nstart_m = [0, {y_m}]\ngoal_m = [{goal_m}, {y_m}]");
    }
    scenario(&text)
}

/// Anything, at any time, whether it makes sense or not.
fn timeline(robots: usize, calm_tick: u64, dice: &mut Dice) -> Vec<TimelineEvent> {
    let mut events = Vec::new();
    for robot in 0..robots {
        if dice.permille(150) {
            events.push(TimelineEvent {
                tick: 1 + dice.below(calm_tick as usize) as u64,
                what: TimelineAction::Join { robot },
            });
        }
    }
    for _ in 0..dice.below(2 * robots) {
        let robot = dice.below(robots);
        let what = match dice.below(12) {
            0 => TimelineAction::Leave { robot },
            1..4 => TimelineAction::kill(robot),
            4..9 => TimelineAction::pause(robot, 1 + dice.below(25) as u64),
            9..11 => {
                let goal = Point2::new(20.0 - dice.below(40) as f64, dice.below(30) as f64);
                TimelineAction::Task { robot, task: Task { now: dice.permille(300), ..Task::to(goal) } }
            }
            _ => TimelineAction::Radio { robot: Some(robot), radio: Radio { delay_ticks: 2, drop: 0.3, noise_m: 0.1 } },
        };
        events.push(TimelineEvent { tick: dice.below(calm_tick as usize) as u64, what });
    }
    events.sort_by_key(|event| event.tick);
    events
}
