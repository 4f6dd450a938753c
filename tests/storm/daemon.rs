//! The daemon's process, a turn at a time: the coordinator, and around it what the supervisor does between two sleeps.
//!
//! Everything that outlives a daemon (processes, rings, the gate) is outside of it: a daemon that is killed and followed
//! by another one that adopts them is to be one more thing that the weather does.

use crate::dice::MS;
use crate::kernel::Kernel;
use crate::operators::Operators;
use crate::shared::Shared;
use bus::queue::OrderQueue;
use daemon::coordinator::{Action, Answer, CONFIRM_WITHIN, Coordinator};
use daemon::processes::Change;
use model::Scenario;
use protocol::codec;
use protocol::daemon_to_robot::AgentSpec;
use protocol::daemon_to_world::{Order, Ticket};
use protocol::world_to_daemon::Notice;
use std::collections::BTreeSet;
use std::time::Duration;

/// How often it looks at the clock while nothing happens, ns.
const HEARTBEAT_NS: u64 = 100 * MS;

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
    /// Every life that it has started.
    started: BTreeSet<model::RobotInstance>,
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
            started: BTreeSet::new(),
            interrupts: 0,
            has_finished: false,
            said_missed: 0,
            wake: shared.now,
        };
        daemon.coordinator.begin();
        daemon.act(kernel, operators, shared);
        daemon
    }

    pub(crate) fn turn(&mut self, kernel: &mut Kernel, operators: &mut Operators, shared: &mut Shared) {
        self.wake = shared.now + HEARTBEAT_NS;
        let passed_ns = shared.now - std::mem::replace(&mut self.turned_at, shared.now);
        shared.daemon_awake_ns += if passed_ns > AWAY_NS { 0 } else { passed_ns };
        for _ in 0..std::mem::take(&mut self.interrupts) {
            self.coordinator.interrupt(Duration::from_nanos(shared.now));
        }
        self.reap(kernel, shared);
        self.hear(shared);
        if shared.world_ended {
            return self.finish(kernel, operators, shared);
        }
        self.serve(operators, shared);
        self.flush(shared);
        let memory = &shared.memory;
        let now = Duration::from_nanos(shared.now);
        self.coordinator.time(now, &|instance| memory.is_ready(instance), &|_| Duration::ZERO);
        self.act(kernel, operators, shared);
        let longest_ns = self.awaiting.first().map_or(0, |awaiting| shared.daemon_awake_ns - awaiting.since_ns);
        assert!(longest_ns <= PATIENCE_NS, "an operator has been waiting for {} ms", longest_ns / MS);
    }

    fn reap(&mut self, kernel: &mut Kernel, shared: &Shared) {
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
                        assert!(self.started.insert(instance), "{instance:?} is started twice");
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
                    Action::Keep { .. } | Action::Record(_) => unreachable!("no records are kept here"),
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
