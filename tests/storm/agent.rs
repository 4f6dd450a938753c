//! A robot's process, a turn at a time: the core of an agent, and around it what its shell does between two sleeps.

use crate::dice::MS;
use crate::shared::{Board, Shared};
use daemon::coordinator::Ending;
use model::{Mode, RobotIndex, RobotInstance};
use protocol::daemon_to_robot::AgentSpec;
use protocol::inputs::{AgentNote, StepNote};
use protocol::robot_to_robot::SharedPose;
use protocol::world_to_robot::{NeighborRef, Odometry, Piece};
use robot_agent::note::note_step;
use robot_agent::{Agent, AgentInputs, AgentOutputs, Duty, Time, duty};

/// Sleeps until it is called.
pub(crate) const FOREVER: u64 = u64::MAX;

/// What a process does when its turn is over.
pub(crate) enum Next {
    /// It sleeps until then, or until it is called.
    Sleep(u64),
    /// It ends; `deaf_to` says whom it could not hear, if that is why.
    End { ending: Ending, deaf_to: Option<RobotIndex> },
}

/// What the machine holds for a process that starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    /// It comes up.
    Well,
    /// It ends before it is ready.
    Fails,
    /// It never becomes ready.
    Hangs,
    /// It ends when it hears another robot for the first time.
    Deaf,
    /// The world cannot read what it says.
    Mute,
}

/// Where it is in its life.
enum Stage {
    Starting,
    AwaitMeeting,
    AwaitStart,
    Serving,
}

/// What is said is said piece by piece: a process may be killed between any two.
enum Saying {
    Pose,
    Command,
    Answer,
}

pub(crate) struct AgentProcess {
    instance: RobotInstance,
    agent: Agent,
    mode: Mode,
    fate: Fate,
    stage: Stage,
    /// The newest tick that it has seen.
    last: Option<u64>,
    /// `realtime`: when its period begins, ns.
    due_ns: u64,
    saying: Option<(Saying, SharedPose, AgentOutputs, Odometry)>,
    heard: Vec<(NeighborRef, SharedPose)>,
    /// Of which list of neighbours they are.
    version: u32,
    pieces: Vec<Piece>,
}

impl AgentProcess {
    pub(crate) fn new(spec: AgentSpec, fate: Fate) -> AgentProcess {
        AgentProcess {
            instance: spec.instance,
            mode: spec.clock.mode,
            agent: Agent::new(spec).expect("the method exists"),
            fate,
            stage: Stage::Starting,
            last: None,
            due_ns: 0,
            saying: None,
            heard: Vec::new(),
            version: 0,
            pieces: Vec::new(),
        }
    }

    pub(crate) fn turn(&mut self, shared: &mut Shared) -> Next {
        if shared.memory.stopped {
            return ends(0, None);
        }
        match self.stage {
            Stage::Starting => self.start(shared),
            Stage::AwaitMeeting => self.meet(shared),
            Stage::AwaitStart => self.find_phase(shared),
            Stage::Serving => self.serve(shared),
        }
    }

    fn meet(&mut self, shared: &mut Shared) -> Next {
        if !shared.memory.meeting {
            return Next::Sleep(FOREVER);
        }
        if shared.memory.start_ns.is_none() {
            shared.memory.slots[self.instance.index.at()].met = Some(self.instance.incarnation);
            shared.calls.world = true;
        }
        self.stage = Stage::AwaitStart;
        Next::Sleep(shared.now + MS)
    }

    fn find_phase(&mut self, shared: &mut Shared) -> Next {
        let Some(start_ns) = shared.memory.start_ns else { return Next::Sleep(FOREVER) };
        let (period_ns, phases) = (self.period_ns(), u64::from(self.agent.spec().max_robots) + 1);
        let first_ns = start_ns + period_ns * (u64::from(self.instance.index.0) + 1) / phases;
        self.due_ns = first_ns + shared.now.saturating_sub(first_ns).div_ceil(period_ns) * period_ns;
        self.stage = Stage::Serving;
        Next::Sleep(self.due_ns)
    }

    fn start(&mut self, shared: &mut Shared) -> Next {
        match self.fate {
            Fate::Hangs => return Next::Sleep(FOREVER),
            Fate::Fails => return ends(shared.dice.pick(&[0, 3]), None),
            Fate::Well | Fate::Deaf | Fate::Mute => {}
        }
        let board = Board { is_readable: self.fate != Fate::Mute, ..Board::default() };
        let new = shared.memory.boards.insert(self.instance, board);
        assert!(new.is_none(), "{:?} has a board already", self.instance);
        shared.memory.slots[self.instance.index.at()].ready = Some(self.instance.incarnation);
        shared.calls.world = true;
        self.stage = if self.mode == Mode::Realtime { Stage::AwaitMeeting } else { Stage::Serving };
        Next::Sleep(shared.now + MS)
    }

    fn serve(&mut self, shared: &mut Shared) -> Next {
        if self.saying.is_some() {
            return self.say(shared);
        }
        let odometry = shared.memory.odometry[self.instance.index.at()];
        let counts = match self.mode {
            Mode::Realtime if shared.now < self.due_ns => return Next::Sleep(self.due_ns),
            Mode::Realtime => shared.now.saturating_sub(odometry.stamp_ns) <= self.odometry_age_ns_max(),
            _ => {
                if shared.memory.tick == self.last {
                    return Next::Sleep(FOREVER);
                }
                self.last = shared.memory.tick;
                Some(odometry.tick) == self.last
            }
        };
        match duty(self.instance, &odometry, counts) {
            Duty::Wait => self.rest(shared),
            Duty::Leave => ends(0, None),
            Duty::ShowLife => {
                shared.memory.slots[self.instance.index.at()].signs += 1;
                self.rest(shared)
            }
            Duty::Plan => self.plan(shared, odometry),
        }
    }

    /// When it has nothing more to do for now.
    fn rest(&mut self, shared: &Shared) -> Next {
        if self.mode != Mode::Realtime {
            return Next::Sleep(if shared.memory.tick == self.last { FOREVER } else { shared.now + MS });
        }
        let missed = shared.now.saturating_sub(self.due_ns) / self.period_ns();
        self.due_ns += self.period_ns() * missed.max(1);
        Next::Sleep(self.due_ns)
    }

    fn plan(&mut self, shared: &mut Shared, odometry: Odometry) -> Next {
        let (memory, slot) = (&shared.memory, self.instance.index.at());
        let before = if self.mode == Mode::Realtime { u64::MAX } else { odometry.tick };
        self.version = memory.versions[slot];
        self.heard.clear();
        self.heard.extend(memory.neighbors[slot].iter().filter_map(|who| {
            let instance = RobotInstance::from(*who);
            let poses = memory.boards.get(&instance)?.poses;
            Some((*who, poses.before(before).copied().unwrap_or_default()))
        }));
        if let (Fate::Deaf, false, Some((who, _))) = (self.fate, shared.calm, self.heard.first()) {
            return ends(3, Some(RobotIndex(who.index)));
        }
        self.pieces.clear();
        self.pieces.extend(memory.sensed[slot].iter().map(|index| memory.pieces[usize::from(*index)]));
        let time = match self.mode {
            Mode::Realtime => Time::Stamps { now_ns: shared.now },
            _ => Time::Ticks,
        };
        let radio = memory.impairments[slot].radio();
        let inputs =
            AgentInputs { odometry: &odometry, heard: &self.heard, borders: &[], radio, pieces: &self.pieces, time };
        let mut pose = SharedPose::default();
        let outputs = self.agent.step(&inputs, &mut pose);
        if let (Mode::Realtime, Some(tape)) = (self.mode, &mut shared.tape) {
            let mut note = StepNote::default();
            pose.stamp_ns = shared.now;
            note_step(&mut note, &inputs, &pose, &outputs, odometry.tick);
            tape.note(self.instance, &AgentNote::Step(note));
        }
        self.saying = Some((Saying::Pose, pose, outputs, odometry));
        self.say(shared)
    }

    fn say(&mut self, shared: &mut Shared) -> Next {
        while let Some((saying, pose, outputs, odometry)) = &mut self.saying {
            let board = shared.memory.boards.get_mut(&self.instance).expect("its process made it");
            let slot = &mut shared.memory.slots[self.instance.index.at()];
            match saying {
                Saying::Pose => {
                    pose.stamp_ns = shared.now;
                    board.poses.push(*pose);
                    *saying = Saying::Command;
                }
                Saying::Command => {
                    outputs.command(odometry, pose.stamp_ns, &mut board.command);
                    *saying = Saying::Answer;
                }
                Saying::Answer => {
                    slot.heard = Some((self.instance, self.version, self.heard.len()));
                    match self.mode {
                        Mode::Realtime => slot.signs += 1,
                        _ => slot.answer = Some((self.instance, odometry.tick)),
                    }
                    shared.calls.world = self.mode != Mode::Realtime;
                    self.saying = None;
                    return self.rest(shared);
                }
            }
            if shared.dice.permille(60) {
                return Next::Sleep(shared.now + shared.dice.between_ms(0, 3));
            }
        }
        self.rest(shared)
    }

    fn period_ns(&self) -> u64 {
        (1e9 / self.agent.spec().clock.tick_hz) as u64
    }

    fn odometry_age_ns_max(&self) -> u64 {
        (self.agent.spec().command_timeout_s * 1e9) as u64
    }
}

fn ends(code: i32, deaf_to: Option<RobotIndex>) -> Next {
    Next::End { ending: Ending { signal: None, code: Some(code) }, deaf_to }
}
