//! Whether the tasks of a run were done in time.

use model::{Event, EventKind, GoalSource, Scenario, TimelineAction};
use std::collections::BTreeMap;

/// Tasks that were given until a time.
pub(crate) struct Tasks<'a> {
    pub(crate) given: usize,
    /// Those that were done by then.
    pub(crate) done: usize,
    /// The names of the robots whose tasks were not.
    pub(crate) late: Vec<&'a str>,
}

/// The tasks that were given until this time, s.
///
/// What the timeline was to give counts, whether the world could give it or not. Of an operator's task counts that a robot had
/// it, and not which one did it in the end.
pub(crate) fn given_until<'a>(by_s: f64, scenario: &'a Scenario, events: &[Event]) -> Tasks<'a> {
    // A time of the scenario is that of its tick.
    let by_tick = (by_s * scenario.clock.tick_hz).round() as u64;
    // By robot: tasks given and tasks done.
    let mut timeline: BTreeMap<usize, [usize; 2]> = BTreeMap::new();
    for event in scenario.events.iter().filter(|event| event.tick <= by_tick) {
        if let TimelineAction::Task { robot, .. } = event.what {
            timeline.entry(robot).or_default()[0] += 1;
        }
    }
    // By number: who had it last, and whether it is done.
    let mut sent = BTreeMap::new();
    for event in events.iter().filter(|event| event.tick <= by_tick) {
        let Some(robot) = event.robot.map(model::RobotIndex::at) else { continue };
        match event.kind {
            EventKind::Task { source: GoalSource::Operator(id), .. } => _ = sent.insert(id, (robot, false)),
            EventKind::TaskDone { source: GoalSource::Operator(id) } => _ = sent.insert(id, (robot, true)),
            EventKind::TaskDone { source: GoalSource::Timeline } => timeline.entry(robot).or_default()[1] += 1,
            _ => {}
        }
    }
    let given = timeline.values().map(|[given, _]| given).sum::<usize>() + sent.len();
    let done = timeline.values().map(|[_, done]| done).sum::<usize>() + sent.values().filter(|(_, done)| *done).count();
    let open = timeline.iter().filter(|(_, [given, done])| done < given).map(|(robot, _)| *robot);
    let mut robots: Vec<usize> = open.chain(sent.values().filter(|(_, done)| !done).map(|(robot, _)| *robot)).collect();
    robots.sort_unstable();
    robots.dedup();
    let name = |robot: usize| scenario.robots.get(robot).map_or("?", |robot| robot.id.as_str());
    Tasks { given, done, late: robots.into_iter().map(name).collect() }
}
