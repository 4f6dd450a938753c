//! A running fleet in the terminal: a table of robots, a map in Braille dots, events, and keys that drive it.
//!
//! ```text
//! eyes   a thread that looks at the fleet    app    what is shown, and what keys do
//! keys   keys from bytes                     rows   the table
//! draw   the screen                          map    the map
//! shell  the terminal
//! ```
//! The robots do not notice: what is looked at lies in shared memory ([`watch`]). A terminal that takes nothing, or has gone,
//! holds up this process only.

mod app;
mod draw;
mod eyes;
mod keys;
mod map;
mod rows;
mod shell;

use app::App;
use bus::Address;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use serde_json::{Value, json};
use std::convert::Infallible;
use watch::WatchError;

/// How it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// A key.
    Quit,
    /// The fleet has ended.
    Over,
    /// A signal.
    Interrupted,
    /// The terminal has gone.
    TerminalGone,
}

/// Why nothing can be shown.
#[derive(Debug, thiserror::Error)]
pub enum TopError {
    /// The fleet cannot be seen.
    #[error(transparent)]
    Watch(#[from] WatchError),
    /// It ended before it was seen.
    #[error("it has ended since it was listed")]
    NoFleet,
    /// The terminal cannot be used.
    #[error("terminal: {0}")]
    Terminal(#[source] std::io::Error),
}

/// Shows the fleet at `address` in the terminal on standard input and output, until a key or a signal asks for the end, or
/// the fleet ends. The terminal is then what it was before.
///
/// # Errors
/// When the fleet cannot be seen, or the terminal cannot be used.
pub fn run(address: &Address, name: Option<&str>, interrupted: &dyn Fn() -> bool) -> Result<End, TopError> {
    shell::run(address, name, interrupted)
}

/// One look at a fleet, which takes a second: shares of processors are measured between two.
pub struct Look(App);

/// Takes one.
///
/// # Errors
/// When the fleet cannot be seen.
pub fn look(address: &Address, name: Option<&str>) -> Result<Look, TopError> {
    let (fleet, frame, vitals) = eyes::once(address, name)?;
    let mut app = App::new(fleet);
    app.take_vitals(vitals);
    if let Some(frame) = frame {
        app.take_frame(frame);
    }
    Ok(Look(app))
}

impl Look {
    /// The screen as lines of text, without colours.
    pub fn text(&self, width: u16, height: u16) -> String {
        screen(&self.0, width, height)
    }

    /// The number of robots.
    pub fn robots(&self) -> usize {
        self.0.fleet.members.len()
    }

    /// Everything that a screen tells and some more.
    pub fn json(&self) -> Value {
        let Look(app) = self;
        let vitals = app.vitals.as_ref();
        let robots: Vec<Value> = app
            .rows()
            .into_iter()
            .map(|row| {
                let body = app.frame.bodies.iter().find(|body| !body.is_obstacle() && body.index == row.index);
                json!({
                    "id": row.id, "slot": row.index, "state": row.state(), "incarnation": row.incarnation,
                    "position_m": body.map(|body| body.position_m), "yaw_rad": body.map(|body| body.yaw_rad),
                    "goal_m": row.goal_m, "goals_left": row.goals_left, "pose_age_p99_us": row.age_us,
                    "missed": row.missed, "cpu": row.cpu, "resident_bytes": row.resident_bytes,
                })
            })
            .collect();
        let status = vitals.map(|vitals| &vitals.status);
        let pulse = vitals.map(|vitals| &vitals.pulse);
        json!({
            "schema": "shoal.top/1", "fleet": app.fleet.id, "name": app.fleet.name, "scenario": app.fleet.scenario,
            "mode": app.fleet.mode, "tick": app.frame.tick.max(status.map_or(0, |status| status.tick)),
            "time_s": app.frame.time_s.max(status.map_or(0.0, |status| status.time_s)),
            "paused": status.map(|status| status.paused), "rate": status.and_then(|status| status.rate),
            "arrived": robots.iter().filter(|robot| robot["state"] == "arrived").count(),
            "contacts": app.frame.contacts, "unanswered": vitals.and_then(|vitals| vitals.unanswered.clone()),
            "verdict": pulse.map(|pulse| pulse.verdict), "because": pulse.map(|pulse| pulse.because.clone()),
            "window_s": pulse.map(|pulse| pulse.window_s), "all_robots": pulse.map(|pulse| &pulse.fleet),
            "world": pulse.map(|pulse| &pulse.world), "robots": robots,
            "events": vitals.map(|vitals| vitals.events.iter().map(|record| json!({
                "tick": record.event.tick, "robot": record.robot, "kind": record.event.kind.name().word(),
                "detail": record.detail,
            })).collect::<Vec<_>>()),
        })
    }
}

/// What is drawn, as lines of text.
fn screen(app: &App, width: u16, height: u16) -> String {
    let fine = |result: Result<Terminal<TestBackend>, Infallible>| result.unwrap_or_else(|never| match never {});
    let mut terminal = fine(Terminal::new(TestBackend::new(width.max(1), height.max(1))));
    let Ok(drawn) = terminal.draw(|frame| draw::draw(app, frame));
    let cells = drawn.buffer.content().chunks(usize::from(width.max(1)));
    let line = |cells: &[ratatui::buffer::Cell]| {
        let text: String = cells.iter().map(ratatui::buffer::Cell::symbol).collect();
        format!("{}\n", text.trim_end())
    };
    cells.map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::Key;
    use model::{Event, EventKind, Mode, ProcessState, RobotIndex};
    use protocol::operator_to_daemon::{EventRecord, RobotStatus, Status};
    use protocol::world_to_observer::FrameBody;
    use report::Verdict;
    use watch::{Body, Fleet, Frame, Load, Pulse, Vitals};

    /// Four robots: one at its goal, one under way, one that is stopped, one that is dead; with everything worse from one to
    /// the next.
    pub(crate) fn app(mode: Mode) -> App {
        let text = r#"
            [world]
            x_m = [-6, 6]
            y_m = [-3, 3]
            [layout]
            kind = "ring"
            robots = 4
            radius_m = 2
            [defaults]
            kind = "unicycle"
            [[obstacle]]
            shape = "disc"
            center_m = [0, 0]
            radius_m = 0.8
            [[obstacle]]
            shape = "polygon"
            corners_m = [[3, -2], [5, -2], [5, -1], [3, -1]]
        "#;
        let scenario = scenarios::parse("pond.toml", text, &scenarios::Overrides::default())
            .unwrap_or_else(|problems| panic!("{problems}"));
        let mut fleet = Fleet::of("abcd234", Some("lab"), &scenario);
        fleet.mode = mode;
        for (index, member) in fleet.members.iter_mut().enumerate() {
            member.id = format!("r{index:02}");
        }
        let mut app = App::new(fleet);
        let states = [ProcessState::Running, ProcessState::Running, ProcessState::Paused, ProcessState::Dead];
        let robots = states.into_iter().zip(0..).map(|(state, slot)| RobotStatus {
            id: format!("r{slot:02}"),
            index: RobotIndex(slot),
            incarnation: slot / 2,
            restarts: slot / 2,
            pid: (state != ProcessState::Dead).then_some(4700 + slot),
            state,
            planner: "lanes".to_owned(),
            position_m: Some([f64::from(slot) - 2.0, 2.0]),
            goal_m: Some([2.0 - f64::from(slot), -2.0]),
            arrived: slot == 0,
            goals_done: u32::from(slot == 0),
            goals_left: slot,
        });
        let status = Status {
            scenario: "pond".to_owned(),
            mode,
            tick: 512,
            time_s: 10.24,
            daemon_pid: 4600,
            world_pid: 4601,
            world_state: ProcessState::Running,
            robots: robots.collect(),
            ..Status::default()
        };
        let load = |slot: u32| Load {
            cpu: (slot < 3).then_some(0.001 * f64::from(slot + 1)),
            resident_bytes: Some(u64::from(slot + 1) << 20),
            pose_age_us: Some([10_000.0, 19_300.0 * f64::from(slot + 1)]),
            wake_us: Some([46.0, 354.0]),
            step_us: Some([3.0, 13.2]),
            periods: 50,
            missed: 0,
            missed_ever: u64::from(slot),
            ..Load::default()
        };
        let mut loads: std::collections::BTreeMap<RobotIndex, Load> =
            (0..4).map(|slot| (RobotIndex(slot), load(slot))).collect();
        // The robot that is dead is the worst of all.
        loads.entry(RobotIndex(3)).and_modify(|load| load.cpu = Some(0.9));
        let event = |number: u64, tick: u64, kind: EventKind, robot: u32| EventRecord {
            number,
            event: Event { tick, robot: Some(RobotIndex(robot)), kind },
            robot: Some(format!("r{robot:02}")),
            detail: String::new(),
        };
        app.take_vitals(Vitals {
            status,
            unanswered: None,
            events: vec![event(1, 0, EventKind::Joined { incarnation: 0 }, 0), event(2, 500, EventKind::Left, 3)],
            pulse: Pulse {
                window_s: 1.0,
                fleet: load(0),
                world: load(1),
                robots: loads,
                links: Vec::new(),
                verdict: Verdict::Valid,
                because: Vec::new(),
            },
        });
        let body = |slot: u32, step: f64| Body {
            index: slot,
            flags: match slot {
                0 => FrameBody::FLAG_ARRIVED,
                3 => FrameBody::FLAG_SILENT,
                _ => 0,
            },
            position_m: [f64::from(slot) * 1.5 - 2.0 + step, 2.0 - step],
            goal_m: Some([2.0 - f64::from(slot), -2.0]),
            ..Body::default()
        };
        for step in 0..40 {
            let bodies = (0..4).map(|slot| body(slot, 0.02 * f64::from(step))).collect();
            app.take_frame(Frame { tick: 512, time_s: 10.24, arrived: 1, contacts: 2, bodies });
        }
        app
    }

    #[test]
    fn a_screen_of_a_common_terminal() {
        insta::assert_snapshot!(screen(&app(Mode::Realtime), 80, 24));
    }

    #[test]
    fn a_screen_of_a_large_terminal() {
        let mut app = app(Mode::Lockstep);
        app.press(Key::Down);
        if let Some(vitals) = &mut app.vitals {
            (vitals.status.paused, vitals.pulse.verdict) = (true, Verdict::Starved);
            vitals.pulse.because = vec!["5.0 % of the periods were missed".to_owned()];
        }
        insta::assert_snapshot!(screen(&app, 200, 60));
    }

    #[test]
    fn a_screen_of_a_small_terminal_and_its_other_panes() {
        let mut app = app(Mode::Realtime);
        let mut screens = screen(&app, 40, 12);
        for _ in 0..2 {
            app.press(Key::Tab);
            screens += &format!("----\n{}", screen(&app, 40, 12));
        }
        insta::assert_snapshot!(screens);
    }

    #[test]
    fn lines_that_are_typed_and_the_help() {
        let mut app = app(Mode::Realtime);
        let last = |app: &App| screen(app, 80, 24).lines().last().unwrap_or_default().to_owned();
        let mut lines = vec![last(&app)];
        for keys in ["j", "g1,-", "\x1b/r0", "\rx", "n?"] {
            keys::keys(keys.as_bytes()).into_iter().for_each(|key| _ = app.press(key));
            lines.push(last(&app));
        }
        lines.push(screen(&app, 80, 24));
        insta::assert_snapshot!(lines.join("\n"));
    }

    /// Whatever the size, it is drawn; and what is wrong is said.
    #[test]
    fn no_terminal_is_too_small() {
        let mut app = app(Mode::Lockstep);
        for width in [1, 2, 3, 7, 20, 59, 60, 109, 110, 300] {
            for height in [1, 2, 3, 4, 15, 16, 17, 100] {
                assert_eq!(screen(&app, width, height).lines().count(), usize::from(height));
            }
        }
        assert!(app.vitals.is_some());
        if let Some(vitals) = &mut app.vitals {
            vitals.unanswered = Some("it was stopped".to_owned());
        }
        assert!(screen(&app, 80, 24).contains("the daemon does not answer: it was stopped"));
        app.blind = Some("its files are gone".to_owned());
        assert!(screen(&app, 80, 24).contains("not visible: its files are gone"));
        let nothing = App::new(app.fleet);
        assert!(screen(&nothing, 80, 24).contains("looking at the fleet"));
    }

    #[test]
    fn a_look_as_json() {
        let json = Look(app(Mode::Realtime)).json();
        assert_eq!(
            (&json["schema"], &json["name"], &json["arrived"]),
            (&json!("shoal.top/1"), &json!("lab"), &json!(1))
        );
        assert_eq!((&json["robots"][3]["state"], &json["robots"][3]["missed"]), (&json!("dead"), &json!(3)));
        assert_eq!((&json["events"][1]["kind"], &json["verdict"]), (&json!("left"), &json!("valid")));
    }
}
