//! The timeline: events of a file, in order, and whether they make sense for the robots they name.

use crate::ground::Ground;
use crate::node::Node;
use crate::problems::{Report, known};
use crate::robots;
use crate::table::{self, Event as Keys, EventKind, Root};
use model::{Clock, Fault, Radio, RestartPolicy, Robot, Task, TimelineAction, TimelineEvent};
use std::collections::{HashMap, HashSet};

/// Ids of robots that enter later.
pub(crate) fn late(root: &Node) -> HashSet<String> {
    let joins = root.nodes(Root::event).iter().filter(|node| node.get(Keys::kind) == Some(EventKind::Join));
    joins.filter_map(|node| node.get(Keys::robot)).collect()
}

/// What events are checked against.
pub(crate) struct Stage<'a> {
    pub(crate) robots: &'a [Robot],
    /// No robot is missing from them because of another problem.
    pub(crate) all_known: bool,
    /// The radio that an event without values goes back to.
    pub(crate) radio: Radio,
    pub(crate) clock: Clock,
    /// The duration was given on the command line: what comes later does not happen, and that is no mistake.
    pub(crate) cut_short: bool,
    pub(crate) ground: Ground<'a>,
}

impl Stage<'_> {
    /// All events, sorted by tick; equal ticks keep the order of the file.
    pub(crate) fn events(&self, root: &Node, report: &mut Report) -> Vec<TimelineEvent> {
        let slots: HashMap<&str, usize> =
            self.robots.iter().enumerate().rev().map(|(slot, robot)| (robot.id.as_str(), slot)).collect();
        let nodes = root.nodes(Root::event);
        let mut events: Vec<(&Node, TimelineEvent)> =
            nodes.iter().filter_map(|node| Some((node, self.event(node, &slots, report)?))).collect();
        events.sort_by_key(|(_, event)| event.tick);
        self.check_lives(&events, report);
        events.into_iter().map(|(_, event)| event).collect()
    }

    fn event(&self, node: &Node, slots: &HashMap<&str, usize>, report: &mut Report) -> Option<TimelineEvent> {
        let at_s = node.get(Keys::at_s);
        if let Some(at_s) = at_s
            && self.tick(at_s) >= self.clock.ticks_max
            && !self.cut_short
        {
            let end_s = self.clock.ticks_max as f64 / self.clock.tick_hz;
            let message = format!("{at_s} s is not before the end of the run, {end_s} s");
            report.add_hint(
                node.at(Keys::at_s),
                &node.key(Keys::at_s),
                message,
                "let it happen earlier, or raise clock.duration_s",
            );
        }
        let kind = node.get(Keys::kind);
        let id = if kind == Some(EventKind::Radio) { node.get(Keys::receiver) } else { node.get(Keys::robot) };
        let robot = match id {
            None => None,
            Some(id) => match slots.get(id.as_str()) {
                Some(slot) => Some(*slot),
                None => {
                    if self.all_known {
                        self.unknown_robot(node, &id, report);
                    }
                    return None;
                }
            },
        };
        let goal = if kind == Some(EventKind::Task) { node.get(Keys::goal_m) } else { None };
        if let (Some(robot), Some(goal)) = (robot, goal) {
            let robot = &self.robots[robot];
            let what = format!("the task of `{}`", robot.id);
            self.ground.goal(robot, goal.at, &what, &node.key(Keys::goal_m), node.at(Keys::goal_m), report);
            robots::check_goal_yaw(robot, goal.yaw_rad, &node.key(Keys::goal_m), node.at(Keys::goal_m), report);
        }
        let what = match kind? {
            EventKind::Join => TimelineAction::Join { robot: robot? },
            EventKind::Leave => TimelineAction::Leave { robot: robot? },
            EventKind::Task => {
                let goal = goal?;
                let task = Task { yaw_rad: goal.yaw_rad, now: node.get(Keys::now), ..Task::to(goal.at) };
                TimelineAction::Task { robot: robot?, task }
            }
            kind @ (EventKind::Kill
            | EventKind::Pause
            | EventKind::Resume
            | EventKind::Mute
            | EventKind::Delay
            | EventKind::Drop
            | EventKind::Noise
            | EventKind::SlowCpu) => {
                let ticks = self.length(node, kind, report);
                TimelineAction::Fault { robot: robot?, fault: fault(node, kind)?, ticks }
            }
            EventKind::Radio => {
                let Radio { delay_ticks, drop, noise_m } = self.radio;
                let radio = Radio {
                    delay_ticks: node.get(Keys::delay_ticks).unwrap_or(delay_ticks),
                    drop: node.get(Keys::drop).unwrap_or(drop),
                    noise_m: node.get(Keys::noise_m).unwrap_or(noise_m),
                };
                TimelineAction::Radio { robot, radio }
            }
        };
        Some(TimelineEvent { tick: self.tick(at_s?), what })
    }

    /// How long a fault lasts, ticks; `None`: until the robot is resumed.
    fn length(&self, node: &Node, kind: EventKind, report: &mut Report) -> Option<u64> {
        let for_s = node.get(Keys::for_s)?;
        let ticks = self.tick(for_s);
        if ticks == 0 {
            let message = format!("a {} of {for_s} s is shorter than half a tick", kind.word());
            let hint = format!("a tick lasts {} s", self.clock.dt_s());
            report.add_hint(node.at(Keys::for_s), &node.key(Keys::for_s), message, hint);
        }
        Some(ticks)
    }

    fn tick(&self, time_s: f64) -> u64 {
        (time_s * self.clock.tick_hz).round() as u64
    }

    fn unknown_robot(&self, node: &Node, id: &str, report: &mut Report) {
        let ids: Vec<&str> = self.robots.iter().map(|robot| robot.id.as_str()).collect();
        let hint = match ids.len() {
            0 => "the scenario has no robots".to_string(),
            1..=20 => known("robots", id, &ids),
            many => {
                let near = crate::problems::nearest(id, ids.iter().copied());
                let near = near.map(|near| format!(" (did you mean `{near}`?)")).unwrap_or_default();
                format!("there are {many} robots, {} to {}{near}", ids[0], ids[many - 1])
            }
        };
        report.add_hint(
            node.at(Keys::robot),
            &node.key(Keys::robot),
            format!("unknown robot `{}`", id.escape_debug()),
            hint,
        );
    }

    /// Follows every robot through its events: it has to be there for what happens to it.
    fn check_lives(&self, events: &[(&Node, TimelineEvent)], report: &mut Report) {
        #[derive(Clone, Copy)]
        enum Life {
            Absent,
            Present,
            Left,
            Dead,
        }
        let mut lives = vec![Life::Present; self.robots.len()];
        for (_, event) in events {
            if let TimelineAction::Join { robot } = event.what {
                lives[robot] = Life::Absent;
            }
        }
        let mut joined = vec![false; self.robots.len()];
        for (node, event) in events {
            let (robot, joins) = match event.what {
                TimelineAction::Join { robot } => (robot, true),
                TimelineAction::Leave { robot }
                | TimelineAction::Task { robot, .. }
                | TimelineAction::Fault { robot, .. } => (robot, false),
                TimelineAction::Radio { robot: Some(robot), .. } => (robot, false),
                TimelineAction::Radio { robot: None, .. } => continue,
            };
            let id = &self.robots[robot].id;
            let problem = match lives[robot] {
                Life::Left if joins => Some(format!("`{id}` has left, and a robot that left does not come back")),
                Life::Left => Some(format!("`{id}` has left by then")),
                Life::Dead if !joins => Some(format!("`{id}` has been killed by then, and is not restarted")),
                _ if joins && joined[robot] => Some(format!("`{id}` has joined already")),
                Life::Absent if !joins => Some(format!("`{id}` has not joined by then")),
                _ => None,
            };
            if let Some(message) = problem {
                report.add(node.at(Keys::at_s), &node.path, message);
                continue;
            }
            match event.what {
                TimelineAction::Join { .. } => (lives[robot], joined[robot]) = (Life::Present, true),
                TimelineAction::Leave { .. } => lives[robot] = Life::Left,
                TimelineAction::Fault { fault: Fault::Kill, .. }
                    if self.robots[robot].restart.policy == RestartPolicy::Never =>
                {
                    lives[robot] = Life::Dead;
                }
                _ => {}
            }
        }
    }
}

/// The fault that an event of this kind is; `None` for one without its number, which has been reported, and for events
/// that are not faults.
fn fault(node: &Node, kind: EventKind) -> Option<Fault> {
    Some(match kind {
        EventKind::Kill => Fault::Kill,
        EventKind::Pause => Fault::Pause,
        EventKind::Resume => Fault::Resume,
        EventKind::Mute => Fault::Mute,
        EventKind::Delay => Fault::Delay { ticks: node.get(Keys::late_ticks)? },
        EventKind::Drop => Fault::Drop { share: node.get(Keys::lost)? },
        EventKind::Noise => Fault::Noise { sigma_m: node.get(Keys::sigma_m)? },
        EventKind::SlowCpu => Fault::SlowCpu { ms: node.get(Keys::slow_s)? * 1e3 },
        EventKind::Join | EventKind::Leave | EventKind::Task | EventKind::Radio => return None,
    })
}

/// The radio from the start.
pub(crate) fn radio(node: &Node) -> Radio {
    Radio {
        delay_ticks: node.get(table::Radio::delay_ticks),
        drop: node.get(table::Radio::drop),
        noise_m: node.get(table::Radio::noise_m),
    }
}
