//! Restart policies: fleets whose robots have different ones, and what each policy has to come to, found from the log alone.

use crate::checks::of_this_robot;
use crate::dice::Dice;
use crate::fleet::Fleet;
use crate::plan::Plan;
use model::{Event, EventKind, ProcessState, Restart, RestartPolicy, RobotIndex};

impl Plan {
    /// The same fleet; every robot has a restart policy of its own.
    pub(crate) fn with_policies(mut self, seed: u64) -> Plan {
        let mut dice = Dice::new(seed ^ 0x0070_6f6c);
        for robot in &mut self.scenario.robots {
            robot.restart = Restart {
                policy: dice.pick(&[RestartPolicy::OnFailure, RestartPolicy::OnFailure, RestartPolicy::Always]),
                limit: 1 + dice.below(4) as u32,
                window_ticks: dice.permille(700).then(|| 5 + dice.below(60) as u64),
                delay_ticks: 1 + dice.below(8) as u64,
                backoff: dice.pick(&[1.0, 1.5, 3.0]),
                delay_ticks_max: dice.pick(&[4, 20, 60]),
            };
        }
        self
    }
}

/// How a life ended, if this is an entry about that: with exit code 0, or not.
fn ending(event: &Event) -> Option<bool> {
    match event.kind {
        EventKind::Died { code, .. } => Some(code == Some(0)),
        EventKind::Killed { .. } | EventKind::NotStarted { .. } | EventKind::Deaf { .. } => Some(false),
        _ => None,
    }
}

/// Each end of a process was followed by a restart, by none, or by the word that the limit is reached, as the policy of its
/// robot says; and the coordinator shows it. The number of ends at a limit.
pub(crate) fn are_by_the_policy(fleet: &Fleet) -> u64 {
    let world = &fleet.world.world;
    let mut at_limit = 0;
    if world.outcome().events_lost > 0 {
        return 0;
    }
    for slot in 0..world.slots() {
        let (Some((instance, _)), Some(robot)) = (world.state(slot), world.robot(slot)) else { continue };
        let policy = robot.restart;
        let shown = fleet.daemon.coordinator.members()[slot].state;
        let mut restarts: Vec<u64> = Vec::new();
        let events = of_this_robot(world, slot);
        // Which life it is; of a robot that has the slot of another one, from the first word about that on.
        let is_first =
            events.len() == world.events().iter().filter(|event| event.robot == Some(RobotIndex::of(slot))).count();
        let mut life = is_first.then_some(0);
        let (mut is_over, mut is_limited) = (None, false);
        for event in events {
            match event.kind {
                // Where a restart was to come anyway, it is that one.
                EventKind::Replaced { incarnation } => {
                    let fits = life.is_none_or(|life| incarnation == life || incarnation == life + 1);
                    assert!(fits, "robot {}: {event:?} in life {life:?}", robot.id);
                    assert_ne!(is_over, Some(true), "robot {}: its limit is reached, and nothing says so", robot.id);
                    (life, is_over, is_limited) = (Some(incarnation), None, false);
                    continue;
                }
                EventKind::Joined { incarnation } | EventKind::Restarted { incarnation } => {
                    assert!(
                        life.is_none_or(|life| incarnation == life),
                        "robot {}: {event:?} in life {life:?}",
                        robot.id
                    );
                    life = Some(incarnation);
                }
                _ => {}
            }
            if let EventKind::RestartLimit { restarts, window_ticks } = event.kind {
                assert_eq!(is_over.take(), Some(true), "robot {}: {event:?} has no reason", robot.id);
                assert_eq!((restarts, window_ticks), (policy.limit, policy.window_ticks));
                at_limit += 1;
                is_over = Some(false);
                is_limited = true;
                continue;
            }
            assert_ne!(is_over, Some(true), "robot {}: its limit is reached, and nothing says so: {event:?}", robot.id);
            let takes_part = matches!(event.kind, EventKind::Joined { .. } | EventKind::Restarted { .. });
            assert!(is_over.is_none() || !takes_part, "robot {}: {event:?} after its end", robot.id);
            let Some(is_clean) = ending(event) else { continue };
            assert_eq!(is_over, None, "robot {}: {event:?} after its end", robot.id);
            let is_wanted = match policy.policy {
                RestartPolicy::Never => false,
                RestartPolicy::OnFailure => !is_clean,
                RestartPolicy::Always => true,
            };
            let is_recent = |at: &&u64| policy.window_ticks.is_none_or(|window| event.tick - **at < window);
            let is_full = restarts.iter().filter(is_recent).count() >= policy.limit as usize;
            match (is_wanted, is_full) {
                (false, _) => is_over = Some(false),
                (true, true) => is_over = Some(true),
                (true, false) => {
                    restarts.push(event.tick);
                    life = life.map(|life| life + 1);
                }
            }
        }
        assert_ne!(is_over, Some(true), "robot {}: its limit is reached, and nothing says so", robot.id);
        let is_it = life.is_none_or(|life| instance.incarnation == life);
        assert!(is_it, "robot {}: {instance:?} in life {life:?}, restarts at {restarts:?}", robot.id);
        // Another robot may have been refused its slot since.
        let is_shown = matches!(shown, ProcessState::RestartLimit | ProcessState::Left | ProcessState::Refused);
        let is_known = !is_limited || is_shown || fleet.shared.missed.others > 0;
        assert!(is_known, "robot {} is shown as {shown:?}", robot.id);
    }
    at_limit
}
