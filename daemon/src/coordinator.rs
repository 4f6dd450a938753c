//! The coordinator: which process should run, and what the world must be told. Pure: facts in, actions out.
//!
//! The world decides who takes part and when (it owns the ticks); the coordinator owns the processes. It turns the
//! world's expectations into spawns, and what happens to processes into facts for the world. Operators talk to it
//! (`operators.rs`), also about who is a member (`membership.rs`) and about tasks (`tasks.rs`).

mod joining;
mod log;
mod member;
mod membership;
mod news;
mod operators;
mod pace;
mod resync;
mod stillness;
mod tasks;

use joining::Joining;
use log::Log;
pub use member::Member;
use model::{ProcessState, RobotIndex, RobotInstance, Scenario, TaskId, TimelineAction};
pub use news::{News, describe};
pub use operators::{Answer, CONFIRM_WITHIN, NOISE_EVERY, WAITING_MAX};
use operators::{Noise, Refusal, Waiting, hint_for, refused, shown};
use protocol::daemon_to_world::{Absence, FaultId, Order, Ticket};
use protocol::operator_to_daemon::{Reply, TaskRecord};
use protocol::world_to_daemon::Notice;
use std::time::Duration;
pub use stillness::OpenTick;
use tasks::Tasks;
pub use tasks::{BATCH_MAX, OPEN_MAX, Place, Robots};

/// SIGBUS: what writing into a full tmpfs does.
pub(crate) const SIGBUS: i32 = 7;

/// The shell lets the coordinator look at the clock more often than this; what is beyond it, nothing ran.
const LOOKED_WITHIN: Duration = Duration::from_secs(1);
/// Signals that ask for the end and come within this time of one another are one request.
const SAME_REQUEST: Duration = Duration::from_millis(200);

/// A process that never gets a processor is given up after this many start limits all the same.
const START_LIMITS_MAX: u32 = 20;

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
    /// Start the agent of this instance.
    Spawn(RobotInstance),
    /// Send the process of this instance a signal.
    Signal(RobotInstance, Signal),
    /// Tell the world.
    Order(Order),
    /// Keep the records of these new tasks, of which this is the first, and say with [`Coordinator::kept`] whether that could
    /// be done. The world does not know of them yet.
    Keep {
        /// Names them.
        first: TaskId,
        /// The records.
        records: Vec<TaskRecord>,
    },
    /// Keep what has become of a task. It stands behind everything that follows: nothing is answered before.
    Record(TaskRecord),
    /// Answer the operator whose request got this ticket.
    Reply(Ticket, Reply),
    /// Tell whoever watches.
    Say(String),
    /// Tell the watcher of an event of this kind, of which there may be many.
    News {
        /// Its kind.
        kind: News,
        /// The robot that it is about, if it is about one and not in the log already.
        robot: Option<RobotIndex>,
        /// The event, in words.
        line: String,
    },
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

/// The pure state machine of a fleet.
pub struct Coordinator {
    scenario: Scenario,
    members: Vec<Member>,
    actions: Vec<Action>,
    stopping: bool,
    /// When the newest request for the end came.
    interrupted_at: Option<Duration>,
    tasks: Tasks,
    faults: FaultId,
    /// What operators asked for and the world has not answered, in the order in which it was asked for.
    waiting: Vec<Waiting>,
    /// Robots that the world has accepted and whose operator waits until they take part.
    joining: Vec<Joining>,
    noise: Noise,
    log: Log,
    /// When time was looked at last.
    looked_at: Option<Duration>,
    /// A tick of which it has been said that it waits.
    open_tick: Option<OpenTick>,
    /// Notices of the world that have not come, as far as is known.
    missed: Missed,
    /// The world has been asked how everything stands.
    resync: Option<resync::Resync>,
    /// The number of the next question.
    resyncs: u64,
    pace: pace::Pace,
}

/// Notices that found no room, since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Missed {
    /// Entries of the log: the outcome has them as well.
    pub entries: u64,
    /// All others.
    pub others: u64,
}

/// Whether a signal that asks for the end now belongs to the request of one before: `timeout` and service managers signal a
/// process and then its group, which the process is in.
pub(crate) fn is_same_request(before: Duration, now: Duration) -> bool {
    now.saturating_sub(before) < SAME_REQUEST
}

impl Coordinator {
    /// A fleet of which nothing runs yet.
    pub fn new(scenario: Scenario) -> Coordinator {
        let members = (0..scenario.robots.len()).map(|slot| Member::new(RobotIndex::of(slot))).collect();
        Coordinator {
            scenario,
            members,
            actions: Vec::new(),
            stopping: false,
            interrupted_at: None,
            tasks: Tasks::default(),
            faults: FaultId(0),
            waiting: Vec::new(),
            joining: Vec::new(),
            noise: Noise::default(),
            log: Log::default(),
            looked_at: None,
            open_tick: None,
            missed: Missed::default(),
            resync: None,
            resyncs: 0,
            pace: pace::Pace::default(),
        }
    }

    /// Starts the agents of all robots that are in the world from the beginning, without waiting for the world to ask.
    pub fn begin(&mut self) {
        let joins: Vec<usize> = (self.scenario.events.iter())
            .filter_map(|event| if let TimelineAction::Join { robot } = event.what { Some(robot) } else { None })
            .collect();
        for slot in (0..self.members.len()).filter(|slot| !joins.contains(slot)) {
            self.start(RobotInstance { index: RobotIndex::of(slot), incarnation: 0 });
        }
    }

    /// Something for whoever watches.
    pub fn say(&mut self, line: String) {
        self.actions.push(Action::Say(line));
    }

    /// An event around the run for the watcher, of a kind of which there may be many.
    pub fn news(&mut self, kind: News, line: &str) {
        self.actions.push(Action::News { kind, robot: None, line: line.to_owned() });
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
        self.interrupted_at.is_some()
    }

    /// The name of the robot in a slot.
    pub fn name(&self, index: RobotIndex) -> &str {
        self.scenario.robots.get(index.at()).map_or("?", |robot| robot.id.as_str())
    }

    /// The world has something to say.
    pub fn notice(&mut self, notice: Notice) {
        match notice {
            // What is said of before the answer to a question is part of the answer.
            Notice::Expect { .. } if self.is_resyncing() => {}
            Notice::Expect { instance, .. } => self.expect(instance),
            Notice::Entered { instance, tick } => {
                self.entered(instance);
                self.newcomer_entered(instance, tick);
            }
            Notice::Kill { instance } => self.kill(instance),
            Notice::Pause { instance } => self.signal(instance, Signal::Stop, Some(ProcessState::Paused)),
            Notice::Resume { instance } => self.signal(instance, Signal::Continue, Some(ProcessState::Running)),
            Notice::Left { instance } => {
                self.left(instance);
                self.newcomer_left(instance.index);
            }
            Notice::RestartLimit { instance } => self.restart_limit(instance),
            Notice::Answer { ticket, refused } => self.answered(ticket, refused),
            Notice::Task { id, step } => self.task_step(id, step),
            Notice::Pace(state) => self.pace(state),
            Notice::Standings(standings) => self.standings(standings),
            Notice::Log(event) => {
                self.newcomer_event(&event);
                let robots = &self.scenario.robots;
                let name =
                    |index: RobotIndex| robots.get(index.at()).map_or_else(String::new, |robot| robot.id.clone());
                self.log.add(&event, &name);
                if event.kind.name().is_notable(event.tick) {
                    let line = describe(&self.scenario, &event);
                    self.actions.push(Action::News { kind: News::Event(event.kind.name()), robot: None, line });
                }
            }
        }
    }

    /// The number of notices that have found no room by now. What is left out is said.
    pub fn missed(&mut self, missed: Missed) {
        let before = std::mem::replace(&mut self.missed, missed);
        let entries = missed.entries.saturating_sub(before.entries);
        if entries > 0 {
            self.say(format!("{entries} events are left out here, because the daemon did not keep up: see the report"));
        }
        let others = missed.others.saturating_sub(before.others);
        if others > 0 {
            self.say(format!("{others} notices of the world are lost, because the daemon was away for too long"));
        }
    }

    /// The shell started a process.
    pub fn spawned(&mut self, instance: RobotInstance, pid: u32, now: Duration) {
        self.with_current(instance, |member| {
            member.pid = Some(pid);
            (member.halted, member.stopped_at) = (false, None);
            member.started_at = now;
            member.ending_since = None;
        });
    }

    /// The shell could not start a process. The world's log says so, and a restart is the world's business.
    pub fn not_spawned(&mut self, instance: RobotInstance, problem: String) {
        self.with_current(instance, |member| member.state = ProcessState::Dead);
        self.actions.push(Action::Order(Order::Absent { instance, cause: Absence::NotStarted { why: problem } }));
    }

    /// A process ended and has been reaped. `words` is what it printed last; `deaf_to`: the
    /// robot that it could not hear, if that was its reason.
    pub fn exited(
        &mut self,
        instance: RobotInstance,
        ending: Ending,
        words: Option<String>,
        deaf_to: Option<RobotIndex>,
    ) {
        let deaf = deaf_to.map(|to| {
            let words = words.as_deref().unwrap_or("it did not say why");
            Absence::Deaf { why: format!("cannot hear {}: {words}", self.name(to)) }
        });
        let Some(member) = self.members.get_mut(instance.index.at()).filter(|member| member.instance == instance)
        else {
            return;
        };
        let was = member.state;
        member.pid = None;
        let is_out = matches!(was, ProcessState::Left | ProcessState::Refused);
        if !is_out && was != ProcessState::RestartLimit {
            member.state = ProcessState::Dead;
        }
        let next = member.next.take();
        let its_process = self.process_of(instance);
        if !is_out && !self.stopping {
            let cause = match was {
                ProcessState::Starting if deaf.is_none() && matches!(ending.signal, None | Some(SIGBUS)) => {
                    let mut ended = format!("{its_process} {}", ending.describe());
                    if ending.code == Some(0) {
                        ended += " before it was ready (a wrapper has to stay until the agent ends)";
                        if self.scenario.robots.get(instance.index.at()).is_some_and(|robot| robot.agent.is_some()) {
                            ended += "; does it run an agent?";
                        }
                    }
                    Absence::NotStarted {
                        why: words.map_or_else(|| ended.clone(), |words| format!("{ended}: {words}")),
                    }
                }
                _ => deaf.unwrap_or(Absence::Died {
                    signal: ending.signal,
                    code: ending.code,
                    words: words.unwrap_or_default(),
                }),
            };
            self.actions.push(Action::Order(Order::Absent { instance, cause }));
        }
        if let Some(next) = next {
            self.start(next);
        }
    }

    /// The process of an instance, for messages: with the command, if its robot names one.
    fn process_of(&self, instance: RobotInstance) -> String {
        match self.scenario.robots.get(instance.index.at()).and_then(|robot| robot.agent.as_ref()) {
            Some(command) => format!("its process `{command}`"),
            None => "its process".to_owned(),
        }
    }

    /// Time has passed: whoever is not ready within the start limit is given up, and operators do not wait for ever.
    /// `waited` says how long a process has waited for a processor since it began: that is not its own time. `words` is what
    /// a process has printed last.
    pub fn time(
        &mut self,
        now: Duration,
        ready: &dyn Fn(RobotInstance) -> bool,
        waited: &dyn Fn(u32) -> Duration,
        words: &dyn Fn(RobotInstance) -> Option<String>,
    ) {
        // A daemon that has been away itself, as with the whole machine, learns nothing about others from that.
        let away = self.looked_at.map_or(Duration::ZERO, |before| now.saturating_sub(before + LOOKED_WITHIN));
        self.looked_at = Some(now);
        let is_resyncing = self.is_resyncing();
        for member in &mut self.members {
            // When those were started that a daemon of before has started, nobody knows.
            member.started_at = if is_resyncing { now } else { member.started_at + away };
            member.ending_since = member.ending_since.map(|since| since + away);
        }
        self.waiting.iter_mut().filter_map(|waiting| waiting.since.as_mut()).for_each(|since| *since += away);
        self.joining_was_away(away);
        self.tasks.was_away(away);
        self.answer_late(now);
        let limit = Duration::from_secs_f64(self.scenario.fleet.start_limit_s);
        let late: Vec<RobotInstance> = self
            .members
            .iter()
            .filter(|member| member.state == ProcessState::Starting && member.pid.is_some())
            .filter(|member| now.saturating_sub(member.started_at) > limit && !ready(member.instance))
            .filter(|member| {
                let took = now.saturating_sub(member.started_at);
                took > limit * START_LIMITS_MAX || took.saturating_sub(member.pid.map_or(took, waited)) > limit
            })
            .map(|member| member.instance)
            .collect();
        for instance in late {
            let limit_s = self.scenario.fleet.start_limit_s;
            let mut why = match self.scenario.robots.get(instance.index.at()).and_then(|robot| robot.agent.as_ref()) {
                Some(command) => format!("`{command}` is not ready within {limit_s} s"),
                None => format!("not ready within {limit_s} s"),
            };
            why.extend(words(instance).map(|words| format!(": {words}")));
            self.actions.push(Action::Order(Order::Absent { instance, cause: Absence::NotStarted { why } }));
            self.signal(instance, Signal::Kill, Some(ProcessState::Dead));
        }
        self.await_ends(now, limit);
    }

    /// The process of a robot that has left ends by itself, unless it hangs, or is stopped. One that was killed to make room
    /// for the next life ends, unless it is blocked in the kernel: then that life is given up.
    fn await_ends(&mut self, now: Duration, limit: Duration) {
        let is_to_end = |member: &&mut Member| member.state == ProcessState::Left || member.next.is_some();
        for member in self.members.iter_mut().filter(|member| member.pid.is_some()).filter(is_to_end) {
            if now.saturating_sub(*member.ending_since.get_or_insert(now)) <= limit {
                continue;
            }
            member.ending_since = None;
            self.actions.push(match member.next.take() {
                None => Action::Signal(member.instance, Signal::Kill),
                Some(instance) => {
                    let why = "the process of its life before was killed but does not exit".to_owned();
                    Action::Order(Order::Absent { instance, cause: Absence::NotStarted { why } })
                }
            });
        }
    }

    /// A signal asks for the end of the run: the first time in good order, the second time immediately. What comes right after
    /// another one is not a second time.
    pub fn interrupt(&mut self, now: Duration) {
        if self.interrupted_at.is_some_and(|before| is_same_request(before, now)) {
            return;
        }
        if self.interrupted_at.replace(now).is_none() {
            self.actions.push(Action::Say("stopping (press Ctrl-C again to stop immediately)".to_owned()));
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

    /// Starts the instance's process, after the process of the life before it is gone.
    fn expect(&mut self, instance: RobotInstance) {
        if self.stopping {
            return;
        }
        match self.members.get_mut(instance.index.at()) {
            // Begun already, and over already: a life is started once. A world that was not told of its end asks again.
            Some(member) if member.instance == instance && member.state == ProcessState::Dead && self.resyncs > 0 => {
                self.died_unseen(instance);
            }
            Some(member) if member.instance == instance && member.state != ProcessState::Awaited => {}
            Some(member) if member.pid.is_some() => {
                member.next = Some(instance);
                let old = member.instance;
                self.signal(old, Signal::Kill, None);
            }
            Some(_) => self.start(instance),
            None => {}
        }
    }

    fn start(&mut self, instance: RobotInstance) {
        if self.stopping {
            return;
        }
        if let Some(member) = self.members.get_mut(instance.index.at()) {
            member.instance = instance;
            member.state = ProcessState::Starting;
            self.actions.push(Action::Spawn(instance));
        }
    }

    /// The robot is in the world. Its process may have ended since.
    fn entered(&mut self, instance: RobotInstance) {
        let mut halted = false;
        self.with_current(instance, |member| {
            if member.state == ProcessState::Starting {
                member.state = ProcessState::Running;
                halted = member.halted;
            }
        });
        if halted {
            self.stands_still(instance);
        }
    }

    /// The robot has left. A life of it that has not been started yet is not wanted any more.
    fn left(&mut self, instance: RobotInstance) {
        let Some(member) = self.members.get_mut(instance.index.at()) else { return };
        // A world that was not told of it yet knows an older life; one that is to come after this one has not left.
        let comes = |life: RobotInstance| self.waiting.iter().any(|waiting| waiting.ticket == Ticket::Admit(life));
        let is_older = member.instance.incarnation > instance.incarnation;
        if !is_older || self.resyncs > 0 && !comes(member.newest()) {
            member.state = ProcessState::Left;
            member.next = None;
            member.lives = instance.incarnation.max(member.instance.incarnation) + 1;
            let last = member.instance;
            self.withdraw(last);
        }
    }

    /// The robot stays dead. Its process may not have been reaped, and the process of an earlier instance may not either.
    fn restart_limit(&mut self, instance: RobotInstance) {
        let member = self.members.get_mut(instance.index.at());
        let member = member.filter(|member| member.instance.incarnation <= instance.incarnation);
        if let Some(member) = member.filter(|member| member.state != ProcessState::Left) {
            member.state = ProcessState::RestartLimit;
        }
    }

    /// The world has given up this life, which may still wait for the one before it to be gone.
    fn kill(&mut self, instance: RobotInstance) {
        if let Some(member) = self.members.get_mut(instance.index.at()) {
            member.next.take_if(|next| *next == instance);
        }
        if self.withdraw(instance) {
            self.with_current(instance, |member| member.state = ProcessState::Dead);
        }
        self.signal(instance, Signal::Kill, None);
    }

    /// The process of this life is not to be started after all; whether it was about to be.
    fn withdraw(&mut self, instance: RobotInstance) -> bool {
        let before = self.actions.len();
        self.actions.retain(|action| *action != Action::Spawn(instance));
        self.actions.len() < before
    }

    /// Signals a process, unless it has ended; `state` is where it is then.
    fn signal(&mut self, instance: RobotInstance, signal: Signal, state: Option<ProcessState>) {
        let mut lives = false;
        self.with_current(instance, |member| {
            lives = member.pid.is_some();
            let is_final = matches!(member.state, ProcessState::Left | ProcessState::RestartLimit);
            if let Some(state) = state.filter(|_| lives && !is_final) {
                member.state = state;
            }
        });
        if lives {
            self.actions.push(Action::Signal(instance, signal));
        }
    }

    /// Does something to the member whose present life this is; older lives are nobody's business any more.
    fn with_current(&mut self, instance: RobotInstance, change: impl FnOnce(&mut Member)) {
        if let Some(member) = self.members.get_mut(instance.index.at()).filter(|member| member.instance == instance) {
            change(member);
        }
    }
}

#[cfg(test)]
mod tests;
