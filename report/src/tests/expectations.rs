//! What a scenario expects of a run, in time and in number.

use super::*;

#[test]
fn tasks_have_to_be_done_in_time() {
    let task = |source| EventKind::Task { source, task: Task::to([1.0, 2.0]), given_up: 0 };
    let done = |source| EventKind::TaskDone { source };
    let operator = |id| GoalSource::Operator(TaskId(id));
    let given = |tick, robot| TimelineEvent { tick, what: TimelineAction::Task { robot, task: Task::to([1.0, 2.0]) } };
    let check = |by_s: f64, timeline: &[TimelineEvent], events: &[Event], expected: &[&str]| {
        let mut facts = single();
        facts.scenario.expect.tasks_done_by_s = Some(by_s);
        facts.scenario.events = timeline.to_vec();
        facts.outcome.events = events.to_vec();
        let report = assemble(facts);
        assert_eq!(
            (report.unmet, report.exit_code),
            (expected.iter().map(|text| (*text).to_owned()).collect(), i32::from(!expected.is_empty()))
        );
    };
    check(8.0, &[], &[], &[]);
    // 8 s is tick 400.
    let timeline = [given(50, 0), given(60, 0), given(100, 1)];
    let log = |last| {
        let of = GoalSource::Timeline;
        let given = [event(50, 0, task(of)), event(60, 0, task(of)), event(100, 1, task(of))];
        let done = [event(300, 0, done(of)), event(390, 1, done(of)), event(last, 0, done(of))];
        [given, done].concat()
    };
    check(8.0, &timeline, &log(400), &[]);
    let late = "expected all tasks to be done by 8 s, 2 of 3 were; not those of r00";
    check(8.0, &timeline, &log(401), &[late]);
    // What comes later is not looked at.
    check(8.0, &[&timeline[..], &[given(401, 2)]].concat(), &log(400), &[]);
    // A task that the world could not give is not done: the log has no task then.
    check(8.0, &[given(100, 2)], &[], &["expected all tasks to be done by 8 s, 0 of 1 were; not those of r02"]);
    // Of an operator's task it counts that it was done, by whomever.
    let moved = [event(10, 0, task(operator(7))), event(20, 1, task(operator(7))), event(30, 1, done(operator(7)))];
    check(8.0, &[], &moved, &[]);
    let dropped = event(25, 1, EventKind::TaskDropped { source: operator(7), why: TaskEnd::Overdue });
    let words = "expected all tasks to be done by 8 s, 0 of 1 were; not those of r01";
    check(8.0, &[], &[moved[0].clone(), moved[1].clone(), dropped], &[words]);
    check(0.5, &[], &moved, &[&words.replace("8 s", "0.5 s")]);
}

#[test]
fn unmet_expectations_are_explained() {
    let check = |change: &dyn Fn(&mut RunFacts), expected: &[&str]| {
        let mut facts = single();
        change(&mut facts);
        assert_eq!(assemble(facts).unmet, expected);
    };
    check(&|_| {}, &[]);
    check(&|facts| facts.scenario.expect.makespan_s_max = Some(11.0), &[]);
    check(
        &|facts| facts.scenario.expect.makespan_s_max = Some(10.9),
        &["expected all to arrive within 10.9 s, the last took 11.00 s"],
    );
    check(
        &|facts| facts.scenario.expect.clearance_m_min = Some(0.5),
        &["expected a clearance of 0.5 m, got 0.312 m to robots"],
    );
    check(&|facts| facts.scenario.expect.arrived_min = Some(4), &["expected at least 4 robots to arrive, 3 did"]);
    check(
        &|facts| {
            facts.outcome.robot_contacts = 2;
            facts.outcome.events.push(contact(210, 1, 2));
        },
        &["expected no contact, got 2: r01/r02 at 4.20 s, ..."],
    );
    check(
        &|facts| {
            (facts.outcome.robot_contacts, facts.scenario.expect.contacts_max) = (2, 2);
            facts.outcome.events.extend([contact(210, 1, 2), contact(310, 0, 2)]);
            facts.scenario.expect.no_contact_s = Some([5.0, 8.0]);
        },
        &["expected no contact from 5 s to 8 s, got 1: r00/r02 at 6.20 s"],
    );
    check(
        &|facts| {
            let killed = EventKind::Killed { source: FaultSource::Timeline };
            let died = EventKind::Died { signal: Some(9), code: None, words: String::new() };
            let back = |incarnation| EventKind::Restarted { incarnation };
            facts.outcome.events.extend([
                event(100, 0, killed.clone()),
                event(110, 1, died),
                event(120, 0, back(1)),
                event(200, 0, killed.clone()),
                event(210, 1, back(1)),
                event(220, 2, killed),
                event(225, 0, back(2)),
            ]);
            facts.scenario.expect.rejoin_s_max = Some(0.5);
        },
        &[
            "expected `r01` to rejoin within 0.5 s of 2.20 s, it took 2.00 s",
            "expected `r02` to rejoin within 0.5 s of 4.40 s, it did not",
        ],
    );
    check(
        &|facts| {
            facts.outcome.robots[1].arrived = false;
            facts.scenario.expect.makespan_s_max = Some(30.0);
        },
        &["expected all robots to arrive, 2 of 3 did; missing: r01", "expected all to arrive within 30 s, not all did"],
    );
}
