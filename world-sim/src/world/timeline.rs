//! What happens to robots by a plan: the timeline, and faults on purpose, from the timeline and from operators.

use super::{UNKNOWN, World};
use model::{EventKind, Fault, FaultSource, GoalSource, Radio, RobotIndex, TimelineAction};
use protocol::world_to_robot::Impairment;

impl World {
    pub(super) fn apply_timeline(&mut self) {
        while let Some(event) = self.events.get(self.next_event).filter(|event| event.tick <= self.tick) {
            let what = event.what.clone();
            self.next_event += 1;
            match what {
                TimelineAction::Join { .. } => {} // The slot has been waiting for this tick since the start.
                TimelineAction::Leave { robot } => {
                    // The log says so if it is gone already.
                    let _ = self.leave(robot);
                }
                TimelineAction::Task { robot, task } => {
                    // The log says so if it was not taken; no operator waits for an answer.
                    let _ = self.task(RobotIndex::of(robot), task, GoalSource::Timeline);
                }
                TimelineAction::Fault { robot, fault, ticks } => {
                    let _ = self.inject(RobotIndex::of(robot), fault, ticks, FaultSource::Timeline);
                }
                TimelineAction::Radio { robot, radio } => self.change_radio(robot, radio),
            }
        }
    }

    /// The radio is like this from now on, for one robot or for all, those included that are added later.
    fn change_radio(&mut self, robot: Option<usize>, radio: Radio) {
        match robot {
            Some(slot) => self.faults[slot].radio = radio,
            None => {
                self.radio = radio;
                self.faults.iter_mut().for_each(|faults| faults.radio = radio);
            }
        }
        for slot in 0..self.faults.len() {
            self.impair(slot);
        }
        self.journal.note(self.tick, robot.map(RobotIndex::of), EventKind::Radio { radio });
    }

    /// Does something to a robot, or says why not.
    pub(super) fn inject(
        &mut self,
        index: RobotIndex,
        fault: Fault,
        ticks: Option<u64>,
        source: FaultSource,
    ) -> Result<(), String> {
        let result = self.try_inject(index.at(), fault, ticks, source);
        if let Err(why) = &result {
            let order = fault.word().to_owned();
            self.journal.note(self.tick, index, EventKind::Ignored { order, why: why.clone() });
        }
        result
    }

    fn try_inject(&mut self, slot: usize, fault: Fault, ticks: Option<u64>, source: FaultSource) -> Result<(), String> {
        let tick = self.tick;
        let until = ticks.map(|ticks| tick.saturating_add(ticks.max(1)));
        let Some(presence) = self.presences.get_mut(slot) else { return Err(UNKNOWN.to_owned()) };
        match fault {
            Fault::Kill => presence.kill(tick, source, &mut self.journal),
            Fault::Pause => presence.pause(tick, until, source, &mut self.journal),
            Fault::Resume => {
                let goes_on = presence.resume(tick);
                let why = format!("it is not paused and has no fault: the robot is {}", presence.state);
                if self.lift(slot, |_| true) || goes_on { Ok(()) } else { Err(why) }
            }
            Fault::Mute | Fault::Delay { .. } | Fault::Drop { .. } | Fault::Noise { .. } | Fault::SlowCpu { .. } => {
                if presence.is_gone() {
                    return Err(format!("the robot is {}", presence.state));
                }
                self.faults[slot].put(fault, until);
                self.faults_end = until.map_or(self.faults_end, |until| self.faults_end.min(until));
                let event = EventKind::Fault { source, fault, until_tick: until };
                self.journal.note(tick, RobotIndex::of(slot), event);
                self.impair(slot);
                Ok(())
            }
        }
    }

    /// Takes off the faults whose time is up.
    pub(super) fn end_faults(&mut self) {
        let tick = self.tick;
        if tick < self.faults_end {
            return;
        }
        for slot in 0..self.faults.len() {
            self.lift(slot, |until| until.is_some_and(|until| until <= tick));
        }
        self.faults_end = self.faults.iter().filter_map(|faults| faults.next_end()).min().unwrap_or(u64::MAX);
    }

    /// Takes off the faults of a robot whose end is such; whether there were any.
    fn lift(&mut self, slot: usize, ends: impl Fn(Option<u64>) -> bool) -> bool {
        let over = self.faults[slot].lift(ends);
        for fault in &over {
            self.journal.note(self.tick, RobotIndex::of(slot), EventKind::FaultOver { fault: *fault });
        }
        self.impair(slot);
        !over.is_empty()
    }

    /// Makes what a robot is told of its radio and its processor what it is now.
    pub(super) fn impair(&mut self, slot: usize) {
        let impairment = self.faults[slot].impairment();
        if std::mem::replace(&mut self.impairments[slot], impairment) != impairment
            && let Err(place) = self.impairments_changed.binary_search(&slot)
        {
            self.impairments_changed.insert(place, slot);
        }
        self.bodies[slot].hears_surely = impairment.radio().is_sure();
    }

    /// What the radio and faults do to the robot.
    pub fn impairment(&self, slot: usize) -> Impairment {
        self.impairments[slot]
    }
}
