//! The daemon's process, a turn at a time: the coordinator, and around it what the supervisor does between two sleeps.
//!
//! Everything that outlives a daemon (processes, rings, the gate, records) is outside of it.

use crate::dice::MS;
use crate::kernel::Kernel;
use crate::operators::Operators;
use crate::shared::Shared;
use bus::queue::OrderQueue;
use daemon::coordinator::{Action, Answer, CONFIRM_WITHIN, Coordinator, Robots};
use daemon::hearing::mutual;
use daemon::processes::Change;
use model::{RobotInstance, Scenario, TaskId};
use protocol::codec;
use protocol::daemon_to_robot::AgentSpec;
use protocol::daemon_to_world::{Order, Ticket};
use protocol::operator_to_daemon::{Reply, TaskRecord};
use protocol::world_to_daemon::Notice;
use std::time::Duration;

/// How often it looks at the clock while nothing happens, ns.
const HEARTBEAT_NS: u64 = 100 * MS;

/// The same while an operator waits for a robot to join, ns.
const JOINING_BEAT_NS: u64 = 5 * MS;

/// An operator waits no longer: what the coordinator grants the world, and a heartbeat or two.
const PATIENCE_NS: u64 = CONFIRM_WITHIN.as_nanos() as u64 + 3 * HEARTBEAT_NS;
/// Between two turns of a daemon that was not stopped passes less.
const AWAY_NS: u64 = 1000 * MS;

#[derive(Debug)]
struct Awaiting {
    ticket: Ticket,
    number: usize,
    since_ns: u64,
}

pub(crate) struct Daemon {
    pub(crate) coordinator: Coordinator,
    pub(crate) orders: OrderQueue,
    /// Operators whose request the world has not decided yet: the number of their request, and since when they wait, ns.
    awaiting: Vec<Awaiting>,
    turned_at: u64,
    /// Requests for the end that it has not seen yet.
    pub(crate) interrupts: u32,
    pub(crate) has_finished: bool,
    /// Notices of which it has said that it missed them.
    pub(crate) said_missed: u64,
    /// When it wants to run next, ns.
    pub(crate) wake: u64,
}

impl Daemon {
    pub(crate) fn new(
        scenario: &Scenario,
        kernel: &mut Kernel,
        operators: &mut Operators,
        shared: &mut Shared,
    ) -> Daemon {
        let mut daemon = Daemon {
            coordinator: Coordinator::new(scenario.clone()),
            orders: OrderQueue::default(),
            awaiting: Vec::new(),
            turned_at: shared.now,
            interrupts: 0,
            has_finished: false,
            said_missed: 0,
            wake: shared.now,
        };
        daemon.coordinator.begin();
        daemon.act(kernel, operators, shared);
        daemon
    }

    /// It keeps records of tasks, as the daemon of a fleet that is left running does.
    pub(crate) fn keep_records(&mut self) {
        self.coordinator.keep_records(Vec::new(), TaskId(0), Robots::New);
    }

    /// It dies: its operators hear no more of it.
    pub(crate) fn dies(&mut self, operators: &mut Operators) {
        for Awaiting { ticket, number, .. } in std::mem::take(&mut self.awaiting) {
            let (problem, hint) = ("nothing answers any more".to_owned(), String::new());
            operators.answer(number, Some(ticket), Reply::Unconfirmed { problem, hint });
        }
    }

    /// The daemon that comes after one that has died.
    pub(crate) fn after(dead: &Daemon, kernel: &mut Kernel, shared: &mut Shared) -> Daemon {
        let pid = |who: &RobotInstance| {
            let process = kernel.processes.iter().find(|process| process.instance == *who);
            process.map(|process| process.pid)
        };
        let begun: Vec<_> = shared.estate.specs.iter().map(|who| (*who, pid(who))).collect();
        shared.estate.eras += 1;
        let mut coordinator = Coordinator::adopted(dead.coordinator.scenario().clone(), &begun, shared.estate.eras);
        let records: Vec<TaskRecord> = shared.estate.records.values().cloned().collect();
        let next = records.last().map_or(TaskId(0), |record| TaskId(record.id.0 + 1));
        coordinator.keep_records(records, next, Robots::Running);
        // Where the world has died as well, that is noticed first.
        if !shared.estate.world_died {
            coordinator.resync();
        }
        Daemon {
            coordinator,
            orders: OrderQueue::default(),
            awaiting: Vec::new(),
            turned_at: shared.now,
            interrupts: dead.interrupts,
            has_finished: false,
            said_missed: dead.said_missed,
            wake: shared.now,
        }
    }

    /// A world that has died is followed by another one, which answers before it does anything else.
    fn see_to_world(&mut self, shared: &mut Shared) {
        if std::mem::take(&mut shared.estate.world_died) {
            self.coordinator.resync();
            shared.estate.world_begins = Some(shared.now + shared.dice.between_ms(10, 100));
        }
    }

    pub(crate) fn turn(&mut self, kernel: &mut Kernel, operators: &mut Operators, shared: &mut Shared) {
        let beat_ns = if self.coordinator.awaits_newcomers() { JOINING_BEAT_NS } else { HEARTBEAT_NS };
        self.wake = shared.now + beat_ns;
        let passed_ns = shared.now - std::mem::replace(&mut self.turned_at, shared.now);
        shared.daemon_awake_ns += if passed_ns > AWAY_NS { 0 } else { passed_ns };
        for _ in 0..std::mem::take(&mut self.interrupts) {
            self.coordinator.interrupt(Duration::from_nanos(shared.now));
        }
        self.reap(kernel, shared);
        self.see_to_world(shared);
        self.hear(shared);
        if shared.world_ended {
            return self.finish(kernel, operators, shared);
        }
        self.look_at_newcomers(shared);
        self.serve(operators, shared);
        self.flush(shared);
        let memory = &shared.memory;
        let now = Duration::from_nanos(shared.now);
        self.coordinator.time(now, &|instance| memory.is_ready(instance), &|_| Duration::ZERO, &|_| None);
        self.act(kernel, operators, shared);
        let longest_ns = self.awaiting.first().map_or(0, |awaiting| shared.daemon_awake_ns - awaiting.since_ns);
        assert!(longest_ns <= PATIENCE_NS, "an operator has been waiting for {} ms", longest_ns / MS);
    }

    fn reap(&mut self, kernel: &mut Kernel, shared: &mut Shared) {
        for (instance, change, deaf_to) in kernel.reap() {
            shared.tell(|| format!("daemon: {instance:?} {change:?}"));
            match change {
                Change::Ended(ending) => self.coordinator.exited(instance, ending, None, deaf_to),
                Change::Stopped => self.coordinator.stopped(instance),
                Change::Continued => self.coordinator.continued(instance),
            }
        }
    }

    fn hear(&mut self, shared: &mut Shared) {
        while let Some(bytes) = shared.notices.pop() {
            let notice: Notice = codec::decode(&bytes).expect("both ends are the same build");
            if !matches!(notice, Notice::Log(_)) {
                shared.tell(|| format!("daemon <- {notice:?}"));
            }
            self.coordinator.notice(notice);
        }
        self.coordinator.missed(shared.missed);
    }

    fn look_at_newcomers(&mut self, shared: &Shared) {
        let memory = &shared.memory;
        for (newcomer, entered) in self.coordinator.newcomers() {
            let others = self.coordinator.members().iter().map(|member| member.instance.index);
            let told = &|index| memory.told(index);
            if let Some(neighbors) = mutual(newcomer, entered, others, told, &|who, of| memory.heard_of(who, of)) {
                self.coordinator.joined(newcomer, neighbors, Duration::from_nanos(shared.now));
            }
        }
    }

    fn serve(&mut self, operators: &mut Operators, shared: &Shared) {
        while let Some((number, request)) = operators.take() {
            match self.coordinator.request(&request, &|_, _| None) {
                Answer::Now(reply) => operators.answer(number, None, reply),
                Answer::Later(ticket) => {
                    self.awaiting.push(Awaiting { ticket, number, since_ns: shared.daemon_awake_ns });
                }
            }
        }
    }

    /// An order from outside of the coordinator: an operator's wish that has no request yet.
    pub(crate) fn order(&mut self, order: &Order, shared: &mut Shared) {
        let bytes = codec::encode(order).expect("it can be encoded");
        shared.note_bytes(&bytes);
        self.orders.add(order, bytes);
        self.flush(shared);
    }

    fn flush(&mut self, shared: &mut Shared) {
        self.orders.flush(&mut |bytes| shared.orders.push(bytes));
        shared.calls.world = true;
    }

    fn act(&mut self, kernel: &mut Kernel, operators: &mut Operators, shared: &mut Shared) {
        loop {
            let actions = self.coordinator.take_actions();
            if actions.is_empty() {
                return;
            }
            for action in actions {
                if let Action::Spawn(_) | Action::Signal(..) | Action::Reply(..) = &action {
                    shared.tell(|| format!("daemon: {action:?}"));
                }
                match action {
                    Action::Spawn(instance) => {
                        shared.estate.start(instance);
                        let Some(robot) = self.coordinator.scenario().robots.get(instance.index.at()) else { continue };
                        let spec = AgentSpec::new(self.coordinator.scenario(), robot, instance);
                        match kernel.spawn(spec, shared) {
                            Ok(pid) => self.coordinator.spawned(instance, pid, Duration::from_nanos(shared.now)),
                            Err(problem) => self.coordinator.not_spawned(instance, problem),
                        }
                    }
                    Action::Signal(instance, signal) => {
                        if let Some(pid) = self.coordinator.members()[instance.index.at()].pid {
                            kernel.signal(pid, signal, shared);
                        }
                    }
                    Action::Order(order) => self.order(&order, shared),
                    Action::Keep { first, records } => {
                        shared.estate.records.extend(records.into_iter().map(|record| (record.id, record)));
                        self.coordinator.kept(first, Ok(()));
                    }
                    Action::Record(record) => _ = shared.estate.records.insert(record.id, record),
                    Action::Reply(ticket, reply) => {
                        if let Some(index) = self.awaiting.iter().position(|awaiting| awaiting.ticket == ticket) {
                            operators.answer(self.awaiting.remove(index).number, Some(ticket), reply);
                        }
                    }
                    Action::Say(line) => {
                        // "12 events are left out here ...", "3 notices ... are lost ...".
                        let number = line.split(' ').next().and_then(|word| word.parse::<u64>().ok());
                        self.said_missed += number.unwrap_or(0);
                        shared.coverage.said += 1;
                    }
                    Action::News { .. } => shared.coverage.said += 1,
                    Action::KillFleet => panic!("nothing asked for a second end"),
                }
            }
        }
    }

    /// The world has ended.
    fn finish(&mut self, kernel: &mut Kernel, operators: &mut Operators, shared: &mut Shared) {
        self.coordinator.stopping();
        self.hear(shared);
        self.serve(operators, shared);
        self.coordinator.refuse_waiting();
        self.act(kernel, operators, shared);
        assert!(self.awaiting.is_empty(), "operators wait for ever: {:?}", self.awaiting);
        shared.memory.stopped = true;
        shared.calls.agents = true;
        self.has_finished = true;
    }
}
