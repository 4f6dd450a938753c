//! The coordinator: which process should run, and what the world must be told. Pure: facts in, actions out.
//!
//! The world decides who takes part and when (it owns the ticks); the coordinator owns the processes. It turns the
//! world's expectations into spawns, and what happens to processes into facts for the world. Operators talk to it.

use planners::{Kind, ParamValues};
use protocol::Seat;
use protocol::daemon_to_world::{Absence, Order};
use protocol::operator_to_daemon::{Reply, Request};
use protocol::world_to_daemon::{Event, Notice};
use scenarios::{Scenario, StragglerPolicy, What};
use std::time::Duration;

/// How a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ending {
    /// The signal that killed it, if one did.
    pub signal: Option<i32>,
    /// Its exit code, if it ended by itself.
    pub code: Option<i32>,
}

impl Ending {
    /// In words, for logs and errors.
    pub fn describe(&self) -> String {
        match (self.signal, self.code) {
            (Some(signal), _) => format!("killed by signal {signal}"),
            (_, Some(code)) => format!("ended with code {code}"),
            _ => "ended".to_owned(),
        }
    }
}

/// Something that the shell is to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Start the agent of this seat.
    Spawn(Seat),
    /// Send the process of this seat a signal.
    Signal(Seat, Signal),
    /// Tell the world.
    Order(Order),
    /// Tell whoever watches.
    Say(String),
    /// End every process of the fleet at once.
    KillFleet,
}

/// The signals that the coordinator uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// SIGKILL.
    Kill,
    /// SIGSTOP.
    Stop,
    /// SIGCONT.
    Continue,
}

/// Where a robot's process is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// There is none, and none is wanted yet.
    Awaited,
    /// Started, not yet in the world.
    Starting,
    /// In the world.
    Running,
    /// Stopped by the timeline.
    Paused,
    /// Stopped by somebody else.
    Stopped,
    /// It left the world as it should.
    Left,
    /// It died.
    Dead,
}

impl State {
    /// The word for tables.
    pub fn word(self) -> &'static str {
        match self {
            State::Awaited => "awaited",
            State::Starting => "starting",
            State::Running => "running",
            State::Paused => "paused",
            State::Stopped => "stopped",
            State::Left => "left",
            State::Dead => "dead",
        }
    }
}

/// What the coordinator knows of one robot.
#[derive(Clone, Debug)]
pub struct Member {
    /// The life that runs, ran last, or is awaited.
    pub seat: Seat,
    /// Its process, until it is reaped.
    pub pid: Option<u32>,
    /// Where it is.
    pub state: State,
    /// The life to start as soon as the present process is reaped.
    next: Option<Seat>,
    /// When the present process was started.
    started_at: Duration,
}

/// The pure state machine of a fleet.
pub struct Coordinator {
    scenario: Scenario,
    members: Vec<Member>,
    actions: Vec<Action>,
    stopping: bool,
    interrupts: u32,
    tasks: u32,
}

impl Coordinator {
    /// A fleet of which nothing runs yet.
    pub fn new(scenario: Scenario) -> Coordinator {
        let members = (0..scenario.robots.len()).map(|slot| Member::new(slot as u32)).collect();
        Coordinator { scenario, members, actions: Vec::new(), stopping: false, interrupts: 0, tasks: 0 }
    }

    /// Starts the agents of all robots that are in the world from the beginning, without waiting for the world to ask.
    pub fn begin(&mut self) {
        let joins: Vec<usize> = (self.scenario.events.iter())
            .filter_map(|event| if let What::Join { robot } = event.what { Some(robot) } else { None })
            .collect();
        for slot in (0..self.members.len()).filter(|slot| !joins.contains(slot)) {
            self.start(Seat { slot: slot as u32, incarnation: 0 });
        }
    }

    /// Something for whoever watches.
    pub fn say(&mut self, line: String) {
        self.actions.push(Action::Say(line));
    }

    /// What is to be done, in order.
    pub fn take_actions(&mut self) -> Vec<Action> {
        std::mem::take(&mut self.actions)
    }

    /// The scenario, with the robots that were added since.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The robots, by slot.
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// Whether somebody asked the run to end before its time.
    pub fn interrupted(&self) -> bool {
        self.interrupts > 0
    }

    /// The name of the robot in a slot.
    pub fn name(&self, slot: u32) -> &str {
        self.scenario.robots.get(slot as usize).map_or("?", |robot| robot.id.as_str())
    }

    /// The world has something to say.
    pub fn notice(&mut self, notice: Notice) {
        match notice {
            Notice::Expect { seat, .. } => self.expect(seat),
            Notice::Entered { seat, .. } => self.with_current(seat, |member| member.state = State::Running),
            Notice::Kill { seat } => self.signal(seat, Signal::Kill, None),
            Notice::Pause { seat } => self.signal(seat, Signal::Stop, Some(State::Paused)),
            Notice::Resume { seat } => self.signal(seat, Signal::Continue, Some(State::Running)),
            Notice::Left { seat } => self.with_current(seat, |member| member.state = State::Left),
            Notice::Log(event) => {
                if is_news(&event) {
                    let line = describe(&self.scenario, &event);
                    self.actions.push(Action::Say(line));
                }
            }
        }
    }

    /// The shell started a process.
    pub fn spawned(&mut self, seat: Seat, pid: u32, now: Duration) {
        self.with_current(seat, |member| {
            member.pid = Some(pid);
            member.state = State::Starting;
            member.started_at = now;
        });
    }

    /// The shell could not start a process.
    pub fn not_spawned(&mut self, seat: Seat, problem: &str) {
        self.with_current(seat, |member| member.state = State::Dead);
        let name = self.name(seat.slot).to_owned();
        self.actions.push(Action::Say(format!("{name} could not be started: {problem}")));
        self.actions.push(Action::Order(Order::Absent { seat, cause: Absence::NotStarted }));
    }

    /// A process ended and has been reaped.
    pub fn exited(&mut self, seat: Seat, ending: Ending) {
        let Some(member) = self.members.get_mut(seat.slot as usize).filter(|member| member.seat == seat) else {
            return;
        };
        let was = member.state;
        member.pid = None;
        if was != State::Left {
            member.state = State::Dead;
        }
        let next = member.next.take();
        if was != State::Left && !self.stopping {
            let cause = match was {
                State::Starting if ending.signal.is_none() => Absence::NotStarted,
                _ => Absence::Died { signal: ending.signal, code: ending.code },
            };
            self.actions.push(Action::Order(Order::Absent { seat, cause }));
        }
        if let Some(next) = next {
            self.start(next);
        }
    }

    /// A process was stopped by a signal.
    pub fn stopped(&mut self, seat: Seat) {
        let wait = self.scenario.fleet.straggler == StragglerPolicy::Wait;
        let mut unasked = false;
        self.with_current(seat, |member| {
            unasked = member.state != State::Paused;
            if unasked {
                member.state = State::Stopped;
            }
        });
        if unasked && !wait && !self.stopping {
            self.actions.push(Action::Order(Order::Absent { seat, cause: Absence::Stopped }));
        }
    }

    /// A stopped process goes on. The world notices by itself when the robot answers again.
    pub fn continued(&mut self, seat: Seat) {
        self.with_current(seat, |member| {
            if member.state == State::Stopped {
                member.state = State::Running;
            }
        });
    }

    /// Time has passed: whoever is not ready within the start limit is given up.
    pub fn time(&mut self, now: Duration, ready: &dyn Fn(Seat) -> bool) {
        let limit = Duration::from_secs_f64(self.scenario.fleet.start_limit_s);
        let late: Vec<Seat> = self
            .members
            .iter()
            .filter(|member| member.state == State::Starting && member.pid.is_some())
            .filter(|member| now.saturating_sub(member.started_at) > limit)
            .map(|member| member.seat)
            .filter(|seat| !ready(*seat))
            .collect();
        for seat in late {
            self.actions.push(Action::Order(Order::Absent { seat, cause: Absence::NotStarted }));
            self.signal(seat, Signal::Kill, Some(State::Dead));
        }
    }

    /// Somebody wants the run to end: the first time in good order, the second time at once.
    pub fn interrupt(&mut self) {
        self.interrupts += 1;
        if self.interrupts == 1 {
            self.actions.push(Action::Say("stopping (once more to stop at once)".to_owned()));
            self.actions.push(Action::Order(Order::Stop));
        } else {
            self.actions.push(Action::KillFleet);
        }
    }

    /// Whoever watches has seen enough: the run ends in good order.
    pub fn enough(&mut self) {
        self.actions.push(Action::Order(Order::Stop));
    }

    /// The world is done: from here on processes may end without anybody minding.
    pub fn stopping(&mut self) {
        self.stopping = true;
    }

    /// An operator asks for something. `near` says whether a robot of that radius would overlap a body at a place.
    /// Status needs measurements and is the shell's to answer.
    pub fn request(&mut self, request: &Request, near: &dyn Fn([f64; 2], f64) -> Option<u32>) -> Reply {
        match request {
            Request::Status => refused("status is not the coordinator's to give", None),
            Request::Add(new) => self.add(new, near),
            Request::Task { robot, goal_m, now } => self.task(robot, *goal_m, *now),
        }
    }

    fn add(
        &mut self,
        new: &protocol::operator_to_daemon::NewRobot,
        near: &dyn Fn([f64; 2], f64) -> Option<u32>,
    ) -> Reply {
        let slots = self.scenario.fleet.max_robots;
        if self.scenario.robots.len() >= slots {
            return refused(
                &format!("the fleet is full: {slots} robots"),
                Some("start it with a larger `fleet.max_robots` (`--set fleet.max_robots=N`)"),
            );
        }
        let kind = match new.kind.as_deref() {
            None => None,
            Some("point") => Some(Kind::Point),
            Some("unicycle") => Some(Kind::Unicycle),
            Some("two-link-arm") => Some(Kind::TwoLinkArm), // refused below, with the reason
            Some(other) => {
                return refused(&format!("unknown kind `{other}`"), Some("known kinds: point, unicycle"));
            }
        };
        let wish = scenarios::NewRobot {
            id: new.id.clone(),
            kind,
            radius_m: None,
            start: new.start_m.into(),
            start_yaw_rad: new.start_yaw_rad,
            goals: vec![new.goal_m.into()],
            planner: new.planner.clone(),
            params: ParamValues::new(),
        };
        let robot = match scenarios::add_robot(&self.scenario, &wish) {
            Ok(robot) => robot,
            Err(problems) => return refused(problems.to_string().trim_end(), None),
        };
        if let Some(slot) = near([robot.start.x, robot.start.y], robot.radius_m) {
            let name = self.name(slot).to_owned();
            return refused(
                &format!("start: robot `{name}` is there"),
                Some("choose another start, or try again later"),
            );
        }
        let slot = self.scenario.robots.len() as u32;
        let reply = Reply::Added { robot: robot.id.clone(), slot };
        self.actions.push(Action::Order(Order::Admit { slot, robot: Box::new(robot.clone()) }));
        self.scenario.robots.push(robot);
        self.members.push(Member::new(slot));
        reply
    }

    fn task(&mut self, name: &str, goal_m: [f64; 2], now: bool) -> Reply {
        let robots = &self.scenario.robots;
        let Some(slot) = robots.iter().position(|robot| robot.id == name) else {
            let known: Vec<&str> = robots.iter().map(|robot| robot.id.as_str()).collect();
            return refused(
                &format!("there is no robot `{name}`"),
                Some(&format!("known robots: {}", known.join(", "))),
            );
        };
        if let Some(problem) = scenarios::goal_problem(&self.scenario, &robots[slot], goal_m.into()) {
            return refused(&problem, Some("choose a goal in free space inside the world"));
        }
        if self.members[slot].state == State::Left {
            return refused(&format!("robot `{name}` has left"), None);
        }
        let task = self.tasks;
        self.tasks += 1;
        self.actions.push(Action::Order(Order::Task { task, slot: slot as u32, goal_m, now }));
        Reply::Tasked { task }
    }

    /// Starts the seat's process, after the process of the life before it is gone.
    fn expect(&mut self, seat: Seat) {
        if self.stopping {
            return;
        }
        match self.members.get_mut(seat.slot as usize) {
            // Begun already, and perhaps over already: a life is started once.
            Some(member) if member.seat == seat && member.state != State::Awaited => {}
            Some(member) if member.pid.is_some() => {
                member.next = Some(seat);
                let old = member.seat;
                self.signal(old, Signal::Kill, None);
            }
            Some(_) => self.start(seat),
            None => {}
        }
    }

    fn start(&mut self, seat: Seat) {
        if self.stopping {
            return;
        }
        if let Some(member) = self.members.get_mut(seat.slot as usize) {
            member.seat = seat;
            member.state = State::Starting;
            self.actions.push(Action::Spawn(seat));
        }
    }

    fn signal(&mut self, seat: Seat, signal: Signal, state: Option<State>) {
        let mut running = false;
        self.with_current(seat, |member| {
            running = member.pid.is_some();
            if let Some(state) = state {
                member.state = state;
            }
        });
        if running {
            self.actions.push(Action::Signal(seat, signal));
        }
    }

    /// Does something to the member whose present life this is; older lives are nobody's business any more.
    fn with_current(&mut self, seat: Seat, change: impl FnOnce(&mut Member)) {
        if let Some(member) = self.members.get_mut(seat.slot as usize).filter(|member| member.seat == seat) {
            change(member);
        }
    }
}

impl Member {
    /// Whether its body may be in the world.
    pub fn in_world(&self) -> bool {
        matches!(self.state, State::Running | State::Paused | State::Stopped | State::Dead)
    }

    fn new(slot: u32) -> Member {
        let seat = Seat { slot, incarnation: 0 };
        Member { seat, pid: None, state: State::Awaited, next: None, started_at: Duration::ZERO }
    }
}

fn refused(problem: &str, hint: Option<&str>) -> Reply {
    Reply::Refused { problem: problem.to_owned(), hint: hint.map(str::to_owned) }
}

/// Whether an entry of the log is worth a line while the run goes on: the first robots' joining is not, and who has
/// arrived is counted in the live line.
pub fn is_news(event: &Event) -> bool {
    event.kind != "arrived" && (event.kind != "joined" || event.tick > 0)
}

/// An entry of the log, in one line for people.
pub fn describe(scenario: &Scenario, event: &Event) -> String {
    let time_s = event.tick as f64 * scenario.clock.dt_s();
    let robot = event.slot.and_then(|slot| scenario.robots.get(slot as usize));
    let who = robot.map_or(String::new(), |robot| format!("{} ", robot.id));
    let detail = if event.detail.is_empty() { String::new() } else { format!(": {}", event.detail) };
    format!("{time_s:8.2} s  {who}{}{detail}", event.kind)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL_READY: &dyn Fn(Seat) -> bool = &|_| true;
    const NOBODY_NEAR: &dyn Fn([f64; 2], f64) -> Option<u32> = &|_, _| None;

    fn seat(slot: u32, incarnation: u32) -> Seat {
        Seat { slot, incarnation }
    }

    /// Two robots that are there from the start, started and in the world.
    fn running(set: &[&str]) -> Coordinator {
        let entry = scenarios::find_catalog("head-on").expect("it is in the catalog");
        let set = set.iter().map(|text| (*text).to_owned()).collect();
        let overrides = scenarios::Overrides { set, ..scenarios::Overrides::default() };
        let scenario = scenarios::parse(entry.name, entry.text, &overrides).expect("it is valid");
        let mut coordinator = Coordinator::new(scenario);
        coordinator.begin();
        let spawns = coordinator.take_actions();
        assert_eq!(spawns, [Action::Spawn(seat(0, 0)), Action::Spawn(seat(1, 0))]);
        for slot in [0, 1] {
            coordinator.spawned(seat(slot, 0), 100 + slot, Duration::ZERO);
            coordinator.notice(Notice::Expect { seat: seat(slot, 0), tick: 0 });
            coordinator.notice(Notice::Entered { seat: seat(slot, 0), tick: 0 });
        }
        assert_eq!(coordinator.take_actions(), [], "the world asks for what was begun already");
        coordinator
    }

    fn killed() -> Ending {
        Ending { signal: Some(9), code: None }
    }

    fn died(who: Seat) -> Action {
        Action::Order(Order::Absent { seat: who, cause: Absence::Died { signal: Some(9), code: None } })
    }

    #[test]
    fn a_death_is_a_fact_for_the_world() {
        let mut coordinator = running(&[]);
        coordinator.exited(seat(1, 0), killed());
        assert_eq!(coordinator.take_actions(), [died(seat(1, 0))]);
        assert_eq!(coordinator.members()[1].state, State::Dead);
    }

    #[test]
    fn the_next_life_starts_when_the_old_process_is_reaped() {
        let mut coordinator = running(&[]);
        coordinator.notice(Notice::Kill { seat: seat(0, 0) });
        coordinator.notice(Notice::Expect { seat: seat(0, 1), tick: 50 });
        let actions = coordinator.take_actions();
        assert!(actions.iter().all(|action| *action == Action::Signal(seat(0, 0), Signal::Kill)), "{actions:?}");
        coordinator.exited(seat(0, 0), killed());
        assert_eq!(coordinator.take_actions(), [died(seat(0, 0)), Action::Spawn(seat(0, 1))]);
        coordinator.spawned(seat(0, 1), 200, Duration::ZERO);
        coordinator.exited(seat(0, 0), killed());
        assert_eq!(coordinator.take_actions(), [], "nobody minds an older life");
    }

    #[test]
    fn a_stop_is_a_matter_of_policy_unless_the_timeline_asked_for_it() {
        for (policy, expected) in [("wait", 0), ("hold", 1), ("drop", 1)] {
            let mut coordinator = running(&[&format!("fleet.straggler={policy:?}")]);
            coordinator.stopped(seat(0, 0));
            assert_eq!(coordinator.take_actions().len(), expected, "{policy}");
            assert_eq!(coordinator.members()[0].state, State::Stopped);
            coordinator.continued(seat(0, 0));
            assert_eq!(coordinator.members()[0].state, State::Running);
        }
        let mut coordinator = running(&[]);
        coordinator.notice(Notice::Pause { seat: seat(0, 0) });
        coordinator.stopped(seat(0, 0));
        assert_eq!(coordinator.take_actions(), [Action::Signal(seat(0, 0), Signal::Stop)]);
    }

    #[test]
    fn whoever_is_not_ready_in_time_is_given_up() {
        let mut coordinator = running(&["fleet.start_limit_s=2"]);
        coordinator.exited(seat(0, 0), killed());
        coordinator.notice(Notice::Expect { seat: seat(0, 1), tick: 50 });
        coordinator.take_actions();
        coordinator.time(Duration::from_secs(10), &|_| false);
        assert_eq!(coordinator.take_actions(), [], "it is not even started");
        coordinator.spawned(seat(0, 1), 200, Duration::from_secs(10));
        coordinator.take_actions();
        coordinator.time(Duration::from_secs(13), ALL_READY);
        assert_eq!(coordinator.take_actions(), [], "it waits for its tick, and is ready");
        coordinator.time(Duration::from_secs(11), &|_| false);
        assert_eq!(coordinator.take_actions(), [], "there is time left");
        coordinator.time(Duration::from_secs(13), &|_| false);
        let given_up = Action::Order(Order::Absent { seat: seat(0, 1), cause: Absence::NotStarted });
        assert_eq!(coordinator.take_actions(), [given_up, Action::Signal(seat(0, 1), Signal::Kill)]);
    }

    #[test]
    fn the_second_interrupt_ends_everything_at_once() {
        let mut coordinator = running(&[]);
        coordinator.interrupt();
        assert!(coordinator.take_actions().contains(&Action::Order(Order::Stop)));
        coordinator.interrupt();
        assert_eq!(coordinator.take_actions(), [Action::KillFleet]);
    }

    #[test]
    fn operators_are_served_or_told_why_not() {
        let add = |id: &str, start_m| {
            let new = protocol::operator_to_daemon::NewRobot {
                id: Some(id.to_owned()),
                start_m,
                goal_m: [0.0, 2.5],
                ..Default::default()
            };
            Request::Add(new)
        };
        let mut coordinator = running(&["fleet.max_robots=3"]);
        let refusal = |reply| match reply {
            Reply::Refused { problem, .. } => problem,
            other => panic!("not refused: {other:?}"),
        };
        assert!(refusal(coordinator.request(&add("east", [0.0, -2.0]), NOBODY_NEAR)).contains("taken"));
        let near: &dyn Fn([f64; 2], f64) -> Option<u32> = &|_, _| Some(1);
        assert!(refusal(coordinator.request(&add("north", [0.0, -2.0]), near)).contains("is there"));
        assert_eq!(coordinator.take_actions(), []);
        let added = coordinator.request(&add("north", [0.0, -2.0]), NOBODY_NEAR);
        assert_eq!(added, Reply::Added { robot: "north".to_owned(), slot: 2 });
        assert!(matches!(&coordinator.take_actions()[..], [Action::Order(Order::Admit { slot: 2, .. })]));
        assert!(refusal(coordinator.request(&add("south", [0.0, -2.0]), NOBODY_NEAR)).contains("full"));

        let task = |robot: &str, goal_m| Request::Task { robot: robot.to_owned(), goal_m, now: false };
        assert_eq!(coordinator.request(&task("north", [0.0, 1.0]), NOBODY_NEAR), Reply::Tasked { task: 0 });
        assert!(refusal(coordinator.request(&task("nobody", [0.0, 1.0]), NOBODY_NEAR)).contains("no robot"));
        assert!(refusal(coordinator.request(&task("north", [1e9, 1.0]), NOBODY_NEAR)).contains("outside"));
    }
}
