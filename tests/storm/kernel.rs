//! The machine: processes that are started, stopped, killed and reaped, with the rules of a kernel.

use crate::agent::{AgentProcess, FOREVER, Fate, Next};
use crate::dice::MS;
use crate::shared::Shared;
use daemon::coordinator::{Ending, Signal};
use daemon::processes::Change;
use model::{RobotIndex, RobotInstance};
use protocol::daemon_to_robot::AgentSpec;

const KILLED: Ending = Ending { signal: Some(9), code: None };

/// A process that has not been reaped.
pub(crate) struct Process {
    pub(crate) pid: u32,
    pub(crate) instance: RobotInstance,
    agent: AgentProcess,
    /// When it wants to run next, ns.
    wake: u64,
    pub(crate) stopped: bool,
    /// It sleeps in the kernel, and no signal wakes it.
    is_blocked: bool,
    /// A signal that cannot be caught is on its way: it takes effect then, ns. What the process does before still counts.
    dies: Option<u64>,
    ended: Option<Ending>,
    deaf_to: Option<RobotIndex>,
    /// Its parent has died: how it ends is told to nobody.
    is_foster: bool,
    /// What its parent has not been told: of a stop and what follows, the newest alone.
    news: Option<Change>,
}

impl Process {
    pub(crate) fn lives(&self) -> bool {
        self.ended.is_none()
    }

    fn next(&self) -> u64 {
        let runs = if self.stopped || self.is_blocked { u64::MAX } else { self.wake };
        if self.lives() { runs.min(self.dies.unwrap_or(u64::MAX)) } else { u64::MAX }
    }
}

#[derive(Default)]
pub(crate) struct Kernel {
    pub(crate) processes: Vec<Process>,
    pids: u32,
    /// The next processes that are started fare like this.
    pub(crate) fates: Vec<Fate>,
    /// The number of next processes that cannot be started at all.
    pub(crate) refusals: usize,
}

impl Kernel {
    pub(crate) fn spawn(&mut self, spec: AgentSpec, shared: &mut Shared) -> Result<u32, String> {
        if self.refusals > 0 && !shared.calm {
            self.refusals -= 1;
            shared.coverage.not_spawned += 1;
            return Err("no process".to_owned());
        }
        let fate = self.fates.pop().filter(|_| !shared.calm).unwrap_or(Fate::Well);
        // Now and then a process starts late: later than anybody waits.
        let late = !shared.calm && shared.dice.permille(60);
        shared.coverage.late_starts += u64::from(late);
        shared.coverage.failed_starts += u64::from(fate != Fate::Well);
        let starts = if late { shared.dice.between_ms(900, 3000) } else { shared.dice.between_ms(20, 500) };
        self.pids += 1;
        let (pid, instance) = (1000 + self.pids, spec.instance);
        self.processes.push(Process {
            pid,
            instance,
            agent: AgentProcess::new(spec, fate),
            wake: shared.now + starts,
            stopped: false,
            is_blocked: false,
            dies: None,
            ended: None,
            deaf_to: None,
            is_foster: false,
            news: None,
        });
        shared.coverage.spawns += 1;
        Ok(pid)
    }

    pub(crate) fn signal(&mut self, pid: u32, signal: Signal, shared: &mut Shared) {
        let Some(process) = self.processes.iter_mut().find(|process| process.pid == pid && process.lives()) else {
            return;
        };
        match signal {
            // Now and then a process is blocked in the kernel, and ends much later, or not before the storm does.
            Signal::Kill if process.dies.is_none() && !shared.calm && shared.dice.permille(50) => {
                let later = shared.now + shared.dice.between_ms(100, 3000);
                process.dies = Some(if shared.dice.permille(500) { later } else { FOREVER });
                process.is_blocked = true;
                shared.tell(|| format!("kernel: {:?} is killed and does not end", process.instance));
                shared.coverage.slow_deaths += 1;
            }
            Signal::Kill => {
                let at = shared.now + shared.dice.between_ms(0, 4);
                process.dies.get_or_insert(at);
            }
            Signal::Stop if !process.stopped => {
                process.stopped = true;
                shared.coverage.stops += 1;
                process.news = Some(Change::Stopped);
                shared.calls.daemon = true;
            }
            Signal::Continue if process.stopped => {
                process.stopped = false;
                shared.coverage.resumes += 1;
                process.wake = shared.now + MS;
                process.news = Some(Change::Continued);
                shared.calls.daemon = true;
            }
            Signal::Stop | Signal::Continue => {}
        }
    }

    /// Whatever stopped and blocked processes goes.
    pub(crate) fn calm_down(&mut self, shared: &mut Shared) {
        for process in self.processes.iter_mut().filter(|process| process.is_blocked && process.lives()) {
            process.dies = Some(shared.now + shared.dice.between_ms(0, 4));
        }
        let stopped: Vec<u32> =
            self.processes.iter().filter(|process| process.stopped).map(|process| process.pid).collect();
        stopped.into_iter().for_each(|pid| self.signal(pid, Signal::Continue, shared));
    }

    /// It ends by itself, as a process with a bug does.
    pub(crate) fn crash(&mut self, index: usize, code: i32, shared: &mut Shared) {
        if !self.processes[index].is_blocked {
            self.processes[index].ended = Some(Ending { signal: None, code: Some(code) });
            shared.coverage.deaths += 1;
            shared.calls.daemon = true;
        }
    }

    /// What has become of processes since the last call; those that have ended are gone afterwards.
    pub(crate) fn reap(&mut self) -> Vec<(RobotInstance, Change, Option<RobotIndex>)> {
        let mut changes = Vec::new();
        self.processes.retain_mut(|process| {
            let unknown = Ending { signal: None, code: None };
            let ended = process.ended.map(|ending| if process.is_foster { unknown } else { ending });
            let (news, ended) = (process.news.take(), ended.map(Change::Ended));
            changes.extend(ended.or(news).map(|change| (process.instance, change, process.deaf_to)));
            ended.is_none()
        });
        changes
    }

    /// The daemon has died: what has ended is gone, and the next daemon finds out which of the others are stopped.
    pub(crate) fn lose_parent(&mut self) {
        self.processes.retain(Process::lives);
        for process in &mut self.processes {
            (process.is_foster, process.news) = (true, process.stopped.then_some(Change::Stopped));
        }
    }

    /// Whether nothing is under way between processes and the daemon that reaps them.
    pub(crate) fn is_settled(&self) -> bool {
        self.processes.iter().all(|process| process.lives() && process.dies.is_none() && process.news.is_none())
    }

    /// Everybody who sleeps on what the world does looks at it soon.
    pub(crate) fn call_agents(&mut self, shared: &mut Shared) {
        for process in &mut self.processes {
            process.wake = process.wake.min(shared.now + shared.haste());
        }
    }

    /// The run is over: each process that can run has one turn, and ends in it.
    pub(crate) fn everybody_ends(&mut self, shared: &mut Shared) {
        for index in 0..self.processes.len() {
            if self.processes[index].lives() && !self.processes[index].stopped && !self.processes[index].is_blocked {
                self.run(index, shared);
                assert!(!self.processes[index].lives(), "the process of {:?} goes on", self.processes[index].instance);
            }
        }
    }

    /// The process that is to run next, and when.
    pub(crate) fn next(&self) -> Option<(u64, usize)> {
        self.processes.iter().enumerate().map(|(index, process)| (process.next(), index)).min()
    }

    pub(crate) fn run(&mut self, index: usize, shared: &mut Shared) {
        let process = &mut self.processes[index];
        if process.dies.is_some_and(|at| at <= shared.now) {
            process.ended = Some(KILLED);
            shared.coverage.deaths += 1;
        } else {
            match process.agent.turn(shared) {
                Next::Sleep(until) => process.wake = until,
                Next::End { ending, deaf_to } => (process.ended, process.deaf_to) = (Some(ending), deaf_to),
            }
        }
        shared.calls.daemon |= !process.lives();
    }
}
