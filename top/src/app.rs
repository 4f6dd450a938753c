//! What is shown, and what keys do. Pure: looks at the fleet come in, requests for its daemon go out.

use crate::keys::Key;
use crate::rows::{Row, Sort, rows};
use model::{Fault, Mode, PaceChange, ProcessState, Task};
use protocol::operator_to_daemon::{Assign, NewTasks, Reply, Request};
use std::collections::{BTreeMap, VecDeque};
use watch::{Answer, Fleet, Frame, Vitals};

/// Events that are kept.
const EVENTS_MAX: usize = 200;
/// Places of a robot's trail.
const TRAIL_MAX: usize = 400;
/// Places of a trail are this far apart, m.
const TRAIL_STEP_M: f64 = 0.02;
/// Others do not hear a muted robot for this long, s.
const MUTE_S: f64 = 5.0;
/// Characters of a line that is typed.
const TYPED_MAX: usize = 40;

/// What a key asks for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Wish {
    /// The daemon is asked for this; its answer is shown.
    Ask(Request),
    /// The end.
    Quit,
}

/// What keys are for at the moment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) enum Input {
    /// Commands.
    #[default]
    Command,
    /// A part of the names of the robots that are shown.
    Filter,
    /// The goal of the selected robot, as typed so far.
    Goal(String),
    /// Whether the selected robot's process is to be killed.
    Kill(String),
    /// The help is shown.
    Help,
}

/// What a narrow terminal shows below the header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Pane {
    /// The robots.
    #[default]
    Table,
    /// The map.
    Map,
    /// What happened.
    Events,
}

/// A line about what was asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Said {
    /// It was done, or is under way.
    pub(crate) is_good: bool,
    /// The line.
    pub(crate) words: String,
}

/// Everything that is shown.
#[derive(Clone, Debug)]
pub(crate) struct App {
    /// What stays as it is.
    pub(crate) fleet: Fleet,
    /// Where everything is.
    pub(crate) frame: Frame,
    /// How everybody does, once it is known.
    pub(crate) vitals: Option<Vitals>,
    /// What happened: lines, the newest last.
    pub(crate) events: VecDeque<String>,
    /// Why the fleet cannot be seen at the moment.
    pub(crate) blind: Option<String>,
    /// What keys are for.
    pub(crate) input: Input,
    /// What a narrow terminal shows.
    pub(crate) pane: Pane,
    /// The column by which robots are sorted.
    pub(crate) sort: Sort,
    /// The other way round.
    pub(crate) reversed: bool,
    /// Only robots with this in their names are shown.
    pub(crate) filter: String,
    /// The newest answer.
    pub(crate) said: Said,
    /// The name of the selected robot.
    selected: Option<String>,
    trails: BTreeMap<u32, VecDeque<[f64; 2]>>,
}

impl App {
    /// Of a fleet of which nothing else is known yet.
    pub(crate) fn new(fleet: Fleet) -> App {
        App {
            fleet,
            frame: Frame::default(),
            vitals: None,
            events: VecDeque::new(),
            blind: None,
            input: Input::default(),
            pane: Pane::default(),
            sort: Sort::default(),
            reversed: false,
            filter: String::new(),
            said: Said::default(),
            selected: None,
            trails: BTreeMap::new(),
        }
    }

    /// A look at where everything is.
    pub(crate) fn take_frame(&mut self, frame: Frame) {
        for body in frame.bodies.iter().filter(|body| !body.is_obstacle()) {
            let trail = self.trails.entry(body.index).or_default();
            let [x_m, y_m] = body.position_m;
            if trail.back().is_none_or(|[x, y]| (x - x_m).hypot(y - y_m) >= TRAIL_STEP_M) {
                if trail.len() == TRAIL_MAX {
                    trail.pop_front();
                }
                trail.push_back(body.position_m);
            }
        }
        self.frame = frame;
        self.blind = None;
    }

    /// A look at how everybody does.
    pub(crate) fn take_vitals(&mut self, vitals: Vitals) {
        for record in &vitals.events {
            let robot = record.robot.as_deref().map_or_else(String::new, |robot| format!("{robot} "));
            let kind = record.event.kind.name().word();
            let time_s = record.event.tick as f64 / self.fleet.tick_hz;
            let detail = if record.detail.is_empty() { String::new() } else { format!(": {}", record.detail) };
            if self.events.len() == EVENTS_MAX {
                self.events.pop_front();
            }
            self.events.push_back(format!("{time_s:8.2} {robot}{kind}{detail}"));
        }
        self.vitals = Some(vitals);
    }

    /// The daemon has answered.
    pub(crate) fn take_reply(&mut self, reply: &Reply) {
        self.said = said(reply);
    }

    /// The robots that are shown, in their order on the screen.
    pub(crate) fn rows(&self) -> Vec<Row> {
        let Some(vitals) = &self.vitals else { return Vec::new() };
        rows(vitals, self.sort, self.reversed, &self.filter)
    }

    /// Which of these rows is selected: the first, if none was chosen.
    pub(crate) fn selected_in(&self, rows: &[Row]) -> Option<usize> {
        let chosen = self.selected.as_ref();
        rows.iter().position(|row| Some(&row.id) == chosen).or((!rows.is_empty()).then_some(0))
    }

    /// The selected robot.
    pub(crate) fn selected(&self) -> Option<Row> {
        let rows = self.rows();
        let index = self.selected_in(&rows)?;
        rows.into_iter().nth(index)
    }

    /// Where a robot has been, the newest place last, m.
    pub(crate) fn trail(&self, index: u32) -> impl Iterator<Item = [f64; 2]> {
        self.trails.get(&index).into_iter().flatten().copied()
    }

    /// Whether the fleet's ticks are held.
    pub(crate) fn is_paused(&self) -> bool {
        self.vitals.as_ref().is_some_and(|vitals| vitals.status.paused)
    }

    /// Somebody has pressed a key.
    pub(crate) fn press(&mut self, key: Key) -> Option<Wish> {
        if key == Key::Interrupt {
            return Some(Wish::Quit);
        }
        match std::mem::take(&mut self.input) {
            Input::Help => None,
            Input::Command => self.command(key),
            Input::Filter => {
                self.type_filter(key);
                None
            }
            Input::Goal(typed) => self.type_goal(typed, key),
            Input::Kill(robot) => match key {
                Key::Char('y') => self.ask(inject(robot, Fault::Kill, None)),
                _ => None,
            },
        }
    }

    fn command(&mut self, key: Key) -> Option<Wish> {
        let robot = self.selected();
        match key {
            Key::Char('q') => return Some(Wish::Quit),
            Key::Char('?' | 'h') => self.input = Input::Help,
            Key::Char('s') => self.sort = self.sort.next(),
            Key::Char('S') => self.reversed = !self.reversed,
            Key::Char('/') => self.input = Input::Filter,
            Key::Char('v') | Key::Tab => {
                self.pane = match self.pane {
                    Pane::Table => Pane::Map,
                    Pane::Map => Pane::Events,
                    Pane::Events => Pane::Table,
                }
            }
            Key::Esc => self.filter.clear(),
            Key::Up | Key::Char('k') => self.go(-1),
            Key::Down | Key::Char('j') => self.go(1),
            Key::PageUp => self.go(-10),
            Key::PageDown => self.go(10),
            Key::Home => self.go(isize::MIN),
            Key::End => self.go(isize::MAX),
            Key::Char(' ') => {
                let change = if self.is_paused() { PaceChange::Resume { rate: None } } else { PaceChange::Pause };
                return self.pace(change);
            }
            Key::Char('n') => return self.pace(PaceChange::Step { ticks: 1 }),
            Key::Char('N') => return self.pace(PaceChange::Step { ticks: 10 }),
            Key::Char('g' | 'x' | 'p' | 'm') => match robot {
                Some(robot) => return self.command_robot(key, robot),
                None => self.say(false, "no robot is selected"),
            },
            _ => {}
        }
        None
    }

    fn command_robot(&mut self, key: Key, robot: Row) -> Option<Wish> {
        match key {
            Key::Char('g') => self.input = Input::Goal(String::new()),
            Key::Char('x') => self.input = Input::Kill(robot.id),
            Key::Char('p') => {
                let goes_on = matches!(robot.process, ProcessState::Paused | ProcessState::Stopped);
                return self.ask(inject(robot.id, if goes_on { Fault::Resume } else { Fault::Pause }, None));
            }
            Key::Char('m') => return self.ask(inject(robot.id, Fault::Mute, Some(MUTE_S))),
            _ => {}
        }
        None
    }

    /// Selects the row that many further down.
    fn go(&mut self, by: isize) {
        let rows = self.rows();
        let Some(at) = self.selected_in(&rows) else { return };
        let to = at.saturating_add_signed(by).min(rows.len() - 1);
        self.selected = rows.get(to).map(|row| row.id.clone());
    }

    fn pace(&mut self, change: PaceChange) -> Option<Wish> {
        if self.fleet.mode == Mode::Realtime {
            self.say(
                false,
                "in realtime every robot has its own timer: there are no ticks to hold; `p` pauses a robot",
            );
            return None;
        }
        self.ask(Request::Pace(change))
    }

    fn ask(&mut self, request: Request) -> Option<Wish> {
        self.say(true, "...");
        Some(Wish::Ask(request))
    }

    /// Shows a line.
    pub(crate) fn say(&mut self, is_good: bool, words: &str) {
        self.said = Said { is_good, words: words.to_owned() };
    }

    fn type_filter(&mut self, key: Key) {
        match key {
            Key::Enter => return,
            Key::Esc => return self.filter.clear(),
            key => edit(&mut self.filter, key),
        }
        self.input = Input::Filter;
    }

    fn type_goal(&mut self, mut typed: String, key: Key) -> Option<Wish> {
        match key {
            Key::Esc => None,
            Key::Enter => {
                let robot = self.selected()?;
                let Some((goal_m, yaw_rad)) = goal(&typed) else {
                    self.say(false, &format!("`{typed}` is not X,Y or X,Y,YAW"));
                    return None;
                };
                let task = Task { yaw_rad, now: true, ..Task::to(goal_m) };
                let assign = Assign::Robot(robot.id);
                self.ask(Request::Task(NewTasks { assign, tasks: vec![task], key: None }))
            }
            key => {
                edit(&mut typed, key);
                self.input = Input::Goal(typed);
                None
            }
        }
    }
}

fn inject(robot: String, fault: Fault, for_s: Option<f64>) -> Request {
    Request::Inject { robot, fault, for_s }
}

fn edit(typed: &mut String, key: Key) {
    match key {
        Key::Backspace => _ = typed.pop(),
        Key::Char(c) if typed.chars().count() < TYPED_MAX => typed.push(c),
        _ => {}
    }
}

/// A goal as people type it: a place, m, and perhaps a heading, rad.
fn goal(typed: &str) -> Option<([f64; 2], Option<f64>)> {
    let words = typed.split([',', ' ']).filter(|word| !word.is_empty());
    let numbers: Option<Vec<f64>> =
        words.map(|word| word.parse().ok().filter(|number: &f64| number.is_finite())).collect();
    match numbers?[..] {
        [x_m, y_m] => Some(([x_m, y_m], None)),
        [x_m, y_m, yaw_rad] => Some(([x_m, y_m], Some(yaw_rad))),
        _ => None,
    }
}

/// What the daemon said, in a line.
fn said(reply: &Reply) -> Said {
    let Answer { done, words, hint } = Answer::of(reply);
    let hint = hint.map_or_else(String::new, |hint| format!(" ({hint})"));
    Said { is_good: done, words: format!("{words}{hint}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::app;

    fn press(app: &mut App, keys: &str) -> Option<Wish> {
        keys.chars().fold(None, |_, c| app.press(if c == '\n' { Key::Enter } else { Key::Char(c) }))
    }

    fn asked(app: &mut App, keys: &str) -> Request {
        match press(app, keys) {
            Some(Wish::Ask(request)) => request,
            other => panic!("{keys}: {other:?}"),
        }
    }

    fn names(app: &App) -> String {
        app.rows().iter().map(|row| row.id.as_str()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn keys_ask_for_what_they_say() {
        let mut app = app(Mode::Lockstep);
        let mute = asked(&mut app, "jm");
        assert_eq!(mute, Request::Inject { robot: "r01".to_owned(), fault: Fault::Mute, for_s: Some(MUTE_S) });
        assert_eq!(asked(&mut app, "p"), inject("r01".to_owned(), Fault::Pause, None));
        assert_eq!(asked(&mut app, "jp"), inject("r02".to_owned(), Fault::Resume, None), "it is paused");
        assert_eq!((press(&mut app, "xn"), app.input.clone()), (None, Input::Command));
        assert_eq!(asked(&mut app, "xy"), inject("r02".to_owned(), Fault::Kill, None));
        assert_eq!(asked(&mut app, " "), Request::Pace(PaceChange::Pause));
        assert_eq!(asked(&mut app, "n"), Request::Pace(PaceChange::Step { ticks: 1 }));
        let Request::Task(task) = asked(&mut app, "g4,-2.5\n") else { panic!("it is a task") };
        assert_eq!((task.assign, task.tasks[0].goal), (Assign::Robot("r02".to_owned()), [4.0, -2.5].into()));
        assert!(task.tasks[0].now);
        assert_eq!(press(&mut app, "g4\n"), None);
        assert!(!app.said.is_good && app.said.words.contains("`4`"));
        assert_eq!(app.press(Key::Interrupt), Some(Wish::Quit));
        assert_eq!(press(&mut app, "q"), Some(Wish::Quit));
    }

    #[test]
    fn a_fleet_in_realtime_is_not_paused() {
        let mut app = app(Mode::Realtime);
        assert_eq!(press(&mut app, " "), None);
        assert!(app.said.words.contains("realtime"));
    }

    #[test]
    fn the_selected_robot_stays_selected_when_the_order_changes() {
        let mut app = app(Mode::Lockstep);
        assert_eq!(names(&app), "r00 r01 r02 r03");
        press(&mut app, "j");
        press(&mut app, "S");
        assert_eq!(names(&app), "r03 r02 r01 r00");
        assert_eq!(app.selected().unwrap().id, "r01");
        press(&mut app, "S/3\n");
        assert_eq!((names(&app), app.selected().unwrap().id), ("r03".to_owned(), "r03".to_owned()));
        app.press(Key::Esc);
        assert_eq!((names(&app), app.selected().unwrap().id), ("r00 r01 r02 r03".to_owned(), "r01".to_owned()));
        app.press(Key::End);
        assert_eq!(app.selected().unwrap().id, "r03");
        app.press(Key::Home);
        press(&mut app, "k");
        assert_eq!(app.selected().unwrap().id, "r00");
        press(&mut app, "/nobody\n");
        assert_eq!((app.selected(), press(&mut app, "x"), app.said.is_good), (None, None, false));
    }

    #[test]
    fn robots_are_sorted_by_what_is_chosen() {
        let mut app = app(Mode::Lockstep);
        let mut orders = Vec::new();
        for _ in 0..Sort::ALL.len() {
            orders.push(format!("{:?}: {}", app.sort, names(&app)));
            press(&mut app, "s");
        }
        assert_eq!(
            orders,
            [
                "Robot: r00 r01 r02 r03",
                "State: r00 r03 r02 r01",
                "Age: r03 r02 r01 r00",
                "Misses: r03 r02 r01 r00",
                "Cpu: r03 r02 r01 r00",
                "Memory: r03 r02 r01 r00",
            ]
        );
    }

    #[test]
    fn trails_and_events_are_bounded() {
        let mut app = app(Mode::Lockstep);
        for step in 0..TRAIL_MAX + 50 {
            let body = watch::Body { position_m: [step as f64, 0.0], ..watch::Body::default() };
            app.take_frame(Frame { bodies: vec![body], ..Frame::default() });
        }
        assert_eq!(app.trail(0).count(), TRAIL_MAX);
        assert_eq!(app.trail(0).last(), Some([(TRAIL_MAX + 49) as f64, 0.0]));
        let vitals = app.vitals.clone().unwrap();
        for _ in 0..EVENTS_MAX {
            app.take_vitals(vitals.clone());
        }
        assert_eq!(app.events.len(), EVENTS_MAX);
    }
}
