//! What happens to a fleet from outside.

use crate::agent::Fate;
use crate::dice::MS;
use crate::fleet::Fleet;
use daemon::coordinator::Signal;
use model::{Fault, PaceChange, ProcessState, Rate, RobotIndex, Task};
use protocol::operator_to_daemon::{Assign, NewRobot, NewTasks, Request};

/// Something that happens.
#[derive(Clone, Copy, Debug)]
enum Act {
    Kill,
    Crash,
    Stop,
    Resume,
    StopDaemon,
    StopWorld,
    SpoilStart,
    RefuseStarts,
    Task,
    Tasks,
    Add,
    Remove,
}

/// How often each happens, out of a hundred.
const ACTS: [(usize, Act); 12] = [
    (18, Act::Kill),
    (5, Act::Crash),
    (18, Act::Stop),
    (20, Act::Resume),
    (1, Act::StopDaemon),
    (1, Act::StopWorld),
    (6, Act::SpoilStart),
    (3, Act::RefuseStarts),
    (23, Act::Task),
    (1, Act::Tasks),
    (3, Act::Add),
    (1, Act::Remove),
];

impl Fleet {
    /// The weather's turn.
    pub(crate) fn rage(&mut self) {
        let mut number = self.shared.dice.below(100);
        let chosen = ACTS.iter().find(|(times, _)| number.checked_sub(*times).map(|rest| number = rest).is_none());
        let mut act = chosen.expect("they make a hundred").1;
        if self.broken_off && self.shared.dice.permille(300) {
            // A second request may follow the first.
            act = Act::StopDaemon;
        }
        self.shared.tell(|| format!("weather: {act:?}"));
        match act {
            Act::Kill => self.strike(|fleet, index| {
                let pid = fleet.kernel.processes[index].pid;
                fleet.kernel.signal(pid, Signal::Kill, &mut fleet.shared);
            }),
            Act::Crash => self.strike(|fleet, index| {
                let code = fleet.shared.dice.pick(&[0, 1, 3]);
                fleet.kernel.crash(index, code, &mut fleet.shared);
            }),
            Act::Stop => self.strike(|fleet, index| {
                let pid = fleet.kernel.processes[index].pid;
                fleet.kernel.signal(pid, Signal::Stop, &mut fleet.shared);
            }),
            Act::Resume => self.resume_one(),
            Act::StopDaemon if self.daemon_stopped < self.shared.now => {
                self.daemon_stopped = self.shared.now + self.shared.dice.between_ms(200, 6000);
                self.shared.coverage.daemon_stops += 1;
            }
            Act::StopWorld if self.world_stopped < self.shared.now => {
                self.world_stopped = self.shared.now + self.shared.dice.between_ms(200, 5000);
                self.shared.coverage.world_stops += 1;
            }
            Act::StopDaemon | Act::StopWorld => {}
            Act::SpoilStart => {
                let fate = self.shared.dice.pick(&[Fate::Fails, Fate::Hangs, Fate::Deaf, Fate::Mute]);
                self.kernel.fates.push(fate);
            }
            Act::RefuseStarts => self.kernel.refusals += 1,
            Act::Task => self.task(),
            Act::Tasks => {
                for _ in 0..20 + self.shared.dice.below(60) {
                    self.task();
                }
            }
            Act::Add => self.add(),
            Act::Remove => {
                let slot = self.shared.dice.below(self.daemon.coordinator.members().len()) as u32;
                if self.shared.dice.permille(400) {
                    let robot = self.daemon.coordinator.name(RobotIndex(slot)).to_owned();
                    // As often a robot gets a new process.
                    let request = match self.shared.dice.permille(500) {
                        true => Request::Remove { robot },
                        false => Request::Restart { robot },
                    };
                    let coverage = &mut self.shared.coverage;
                    match request {
                        Request::Remove { .. } => coverage.removals += 1,
                        _ => coverage.restarts_asked += 1,
                    }
                    self.operators.ask(request);
                    self.shared.calls.daemon = true;
                }
            }
        }
    }

    /// Does something to a process that lives.
    fn strike(&mut self, blow: impl FnOnce(&mut Fleet, usize)) {
        let alive: Vec<usize> =
            (0..self.kernel.processes.len()).filter(|index| self.kernel.processes[*index].lives()).collect();
        if !alive.is_empty() {
            let index = self.shared.dice.pick(&alive);
            blow(self, index);
        }
    }

    fn resume_one(&mut self) {
        let stopped: Vec<u32> =
            self.kernel.processes.iter().filter(|process| process.stopped).map(|process| process.pid).collect();
        if !stopped.is_empty() {
            let pid = self.shared.dice.pick(&stopped);
            self.kernel.signal(pid, Signal::Continue, &mut self.shared);
        }
    }

    fn task(&mut self) {
        let members = self.daemon.coordinator.members().len();
        // One more than there are: that of the last one is unknown.
        let slot = self.shared.dice.below(members + 1) as u32;
        let robot = if slot as usize == members { "unknown" } else { self.daemon.coordinator.name(RobotIndex(slot)) }
            .to_owned();
        let goal_m = [20.0 - self.shared.dice.below(40) as f64, self.shared.dice.below(40) as f64];
        let now = self.shared.dice.permille(50);
        let priority = self.shared.dice.below(5) as i32 - 2;
        let deadline_s = self.shared.dice.permille(200).then(|| 0.1 + self.shared.dice.below(50) as f64 * 0.1);
        let tasks = vec![Task { now, priority, deadline_s, ..Task::to(goal_m) }];
        self.operators.ask(Request::Task(NewTasks { assign: Assign::Robot(robot), tasks, key: None }));
        if self.shared.coverage.tasks_asked > 0 && self.shared.dice.permille(250) {
            let id = self.shared.dice.below(self.shared.coverage.tasks_asked as usize);
            self.operators.ask(Request::Cancel(id.to_string()));
        }
        self.shared.calls.daemon = true;
        self.shared.coverage.tasks_asked += 1;
    }

    /// An operator may want a fault, of any robot, whether it makes sense or not.
    pub(crate) fn harm(&mut self) {
        let Some(dice) = self.mischief.as_mut() else { return };
        if !dice.permille(250) {
            return;
        }
        let slot = dice.below(self.daemon.coordinator.members().len()) as u32;
        let fault = match dice.below(12) {
            0 => Fault::Kill,
            1..4 => Fault::Pause,
            4..7 => Fault::Resume,
            7 | 8 => Fault::Mute,
            9 => Fault::Delay { ticks: dice.below(9) as u32 },
            10 => Fault::Drop { share: 0.5 },
            _ => Fault::Noise { sigma_m: 0.1 },
        };
        // Nothing that only another operator could end.
        let for_s = fault.lasts().then(|| 0.05 * (1 + dice.below(60)) as f64);
        let robot = self.daemon.coordinator.name(RobotIndex(slot)).to_owned();
        self.operators.ask(Request::Inject { robot, fault, for_s });
        self.shared.calls.daemon = true;
        self.shared.coverage.faults_asked += 1;
    }

    /// An operator may want another pace.
    pub(crate) fn change_pace(&mut self) {
        let Some(dice) = self.pacer.as_mut() else { return };
        if !dice.permille(300) {
            return;
        }
        let change = match dice.below(6) {
            0 | 1 => PaceChange::Pause,
            2 | 3 => PaceChange::Step { ticks: 1 + dice.below(9) as u64 },
            4 => PaceChange::Resume { rate: None },
            _ => PaceChange::Resume { rate: Some(dice.pick(&[Rate::Max, Rate::Factor(0.5), Rate::Factor(20.0)])) },
        };
        self.ask_pace(change);
    }

    fn ask_pace(&mut self, change: PaceChange) {
        self.operators.ask(Request::Pace(change));
        self.shared.calls.daemon = true;
        self.shared.coverage.paces_asked += 1;
    }

    fn add(&mut self) {
        self.guests += 1;
        let y_m = -3.0 * (self.guests % 15) as f64;
        // Every other one has the name of one that has left, if there is any.
        let members = self.daemon.coordinator.members().iter();
        let mut left = members.filter(|member| member.state == ProcessState::Left).map(|member| member.instance.index);
        let again =
            left.next_back().filter(|_| self.guests.is_multiple_of(2)).map(|index| self.daemon.coordinator.name(index));
        self.shared.coverage.names_again += u64::from(again.is_some());
        let id = Some(again.map_or_else(|| format!("g{}", self.guests), str::to_owned));
        let (start_m, goal_m) = ([-20.0, y_m], [20.0, y_m]);
        self.operators.ask(Request::Add(NewRobot { id, start_m, goal_m, ..NewRobot::default() }));
        self.shared.calls.daemon = true;
        self.shared.coverage.robots_asked += 1;
    }

    /// The storm is over: whatever stands still goes on, and nothing more happens.
    pub(crate) fn calm_down(&mut self) {
        self.shared.calm = true;
        self.shared.tell(|| "weather: calm".to_owned());
        self.daemon_stopped = 0;
        self.world_stopped = 0;
        if self.pacer.take().is_some() {
            self.ask_pace(PaceChange::Resume { rate: Some(Rate::Max) });
        }
        self.kernel.calm_down(&mut self.shared);
        self.shared.calls.daemon = true;
        self.shared.calls.world = true;
    }

    /// When it does something next, ns.
    pub(crate) fn next_gust(&mut self) -> u64 {
        self.shared.now + self.shared.dice.between_ms(0, self.pause_ms) + MS / 7
    }
}
