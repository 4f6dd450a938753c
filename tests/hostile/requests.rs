//! Requests of operators, mutated: decoded, given to a coordinator, and what it orders given to a world.
//!
//! Nothing panics, memory is bounded by the size of the message, the fleet's state by its limits, every request has one
//! answer, and only what makes sense becomes an order. The number of messages is `SHOAL_FUZZ_MESSAGES`, and the first
//! seed `SHOAL_FUZZ_SEED`; with the former the test says how long it took:
//!
//! `SHOAL_FUZZ_MESSAGES=10000000 cargo test --release -p shoal --test hostile -- --nocapture mutated_requests`
//!
//! What it finds becomes a row of [`FOUND`] or of [`found`].

use crate::counting::{held, peak_of};
use crate::messages::{mutant, sensible};
use crate::random::Random;
use daemon::coordinator::{Action, Answer, BATCH_MAX, Coordinator, Ending, Place, Signal, WAITING_MAX};
use model::{Fault, PaceChange, RobotIndex, Scenario, Task};
use protocol::codec::{self, EXPANSION_MAX, RESERVE_MAX};
use protocol::daemon_to_robot::AgentSpec;
use protocol::daemon_to_world::{Order, Ticket};
use protocol::operator_to_daemon::{Assign, NewRobot, NewTasks, Reply, Request};
use protocol::world_to_daemon::Notice;
use scenarios::Overrides;
use std::collections::BTreeSet;
use std::time::Duration;
use world_sim::World;

/// Messages that one fleet gets before the next one takes its place.
const EPOCH: u64 = 20_000;
/// What an answer takes besides what decoding takes, bytes: it names all robots, and repeats a name.
const ANSWER_MAX: usize = 1 << 20;
/// What a fleet may hold, bytes: a full log, mostly.
const HELD_MAX: usize = 32 << 20;

/// Robots of every kind that drives about, an obstacle, and room for some more robots.
fn scenario() -> Scenario {
    let text = r#"
        [clock]
        stop = "duration"
        duration_s = 100000
        [world]
        x_m = [-20, 20]
        y_m = [-20, 20]
        [fleet]
        max_robots = 12
        [defaults]
        restart = "on-failure"
        restart_limit = 1000
        restart_delay_s = 0.1
        [[robot]]
        id = "a"
        start_m = [0, 0]
        goal_m = [5, 0]
        [[robot]]
        id = "b"
        kind = "unicycle"
        start_m = [0, 3]
        goal_m = [5, 3]
        [[robot]]
        id = "c"
        kind = "diff-drive"
        start_m = [0, 6]
        goal_m = [5, 6]
        [[obstacle]]
        shape = "disc"
        center_m = [-5, -5]
        radius_m = 1
    "#;
    scenarios::parse("fuzz.toml", text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}"))
}

/// A fleet without processes: its world, its coordinator, and what goes between them.
struct Fleet {
    coordinator: Coordinator,
    world: World,
    /// Requests that the world has not answered.
    asked: BTreeSet<Ticket>,
    robots_max: usize,
    pids: u32,
}

impl Fleet {
    fn new(scenario: &Scenario) -> Fleet {
        let mut fleet = Fleet {
            coordinator: Coordinator::new(scenario.clone()),
            world: World::new(scenario),
            asked: BTreeSet::new(),
            robots_max: scenario.fleet.max_robots,
            pids: 0,
        };
        fleet.coordinator.begin();
        fleet.act();
        fleet
    }

    /// One message of an operator.
    fn take(&mut self, bytes: &[u8]) -> Result<Reply, bool> {
        let Ok(request) = codec::decode::<Request>(bytes) else { return Err(false) };
        let place = |slot: usize| {
            let odometry = self.world.odometry(slot);
            Some(Place { at_m: [odometry.x_m, odometry.y_m], goal_m: None, says_left_m: Some(1.0) })
        };
        self.coordinator.tell_places((0..self.world.slots()).map(place).collect());
        match self.coordinator.request(&request, &|_, _| None) {
            Answer::Now(reply) => {
                check_words(&reply);
                assert_eq!(self.act(), 0, "{request:?} was refused, and something was ordered");
                Ok(reply)
            }
            Answer::Later(ticket) => {
                assert!(self.asked.insert(ticket), "{ticket:?} was given twice");
                assert!(makes_sense(&request), "{request:?}");
                let orders = if let Request::Task(new) = &request { new.tasks.len() } else { 1 };
                assert_eq!(self.act(), orders, "a request is one order, or one for each of its tasks");
                Err(true)
            }
        }
    }

    /// Does what the coordinator decided; how many orders of operators were among it.
    fn act(&mut self) -> usize {
        let mut orders = 0;
        loop {
            let actions = self.coordinator.take_actions();
            if actions.is_empty() {
                return orders;
            }
            for action in actions {
                match action {
                    Action::Spawn(instance) => {
                        self.pids += 1;
                        self.coordinator.spawned(instance, self.pids, Duration::ZERO);
                    }
                    Action::Signal(instance, Signal::Kill) => {
                        let ending = Ending { signal: Some(9), code: None };
                        self.coordinator.exited(instance, ending, None, None);
                    }
                    Action::Order(order) => {
                        orders += usize::from(order.ticket().is_some());
                        self.world.order(order);
                    }
                    Action::Reply(ticket, reply) => {
                        assert!(self.asked.remove(&ticket), "{ticket:?} was answered twice, or not asked for");
                        check_words(&reply);
                    }
                    Action::Keep { .. } | Action::Record(_) => unreachable!("no records are kept here"),
                    Action::Signal(..) | Action::Say(_) | Action::News { .. } | Action::KillFleet => {}
                }
            }
        }
    }

    /// The world does a tick: it answers what was asked. What a robot had to do that has gone it answers in the next.
    fn tick(&mut self) {
        for _ in 0..self.robots_max {
            self.world.open(&mut |_| true);
            self.world.close(&mut |_| None);
            for notice in self.world.take_notices() {
                self.coordinator.notice(notice);
            }
            self.act();
            for (newcomer, _) in self.coordinator.newcomers() {
                self.coordinator.joined(newcomer, 1, Duration::ZERO);
            }
            self.act();
            if self.coordinator.unanswered() == 0 && self.asked.is_empty() {
                break;
            }
        }
        self.cut_steps_short();
        assert!(self.asked.is_empty() && self.coordinator.unanswered() == 0, "{:?} without an answer", self.asked);
    }

    /// Steps of which there are very many end with a pause.
    fn cut_steps_short(&mut self) {
        if self.asked.is_empty() || !self.asked.iter().all(|ticket| matches!(ticket, Ticket::Pace(_))) {
            return;
        }
        let answer = self.coordinator.request(&Request::Pace(PaceChange::Pause), &|_, _| None);
        let Answer::Later(ticket) = answer else { panic!("the world is asked to pause: {answer:?}") };
        self.asked.insert(ticket);
        self.act();
        for notice in self.world.take_notices() {
            self.coordinator.notice(notice);
        }
        self.act();
    }

    fn check_bounds(&self) {
        assert!(self.coordinator.members().len() <= self.robots_max);
        assert!(self.world.slots() <= self.robots_max);
        assert!(self.coordinator.unanswered() <= WAITING_MAX && self.world.orders_waiting() <= 4 * WAITING_MAX);
    }
}

/// What is shown to people and written to logs.
fn check_words(reply: &Reply) {
    let (Reply::Refused { problem, hint: Some(text) }
    | Reply::Failed { problem, hint: text }
    | Reply::Unconfirmed { problem, hint: text }) = reply
    else {
        if let Reply::Refused { problem, hint: None } = reply {
            check_text(problem);
        }
        return;
    };
    check_text(problem);
    check_text(text);
}

fn check_text(text: &str) {
    let is_raw = |c: char| c.is_control() && c != '\n' || ('\u{202a}'..='\u{202e}').contains(&c);
    assert!(!text.contains(is_raw), "{text:?}");
}

/// What may become an order: known without the checks of the coordinator.
fn makes_sense(request: &Request) -> bool {
    let is_place = |[x, y]: [f64; 2]| x.abs() <= 20.0 && y.abs() <= 20.0;
    let is_angle = |yaw: Option<f64>| yaw.is_none_or(|yaw| yaw.abs() <= 1e6);
    let is_key = |key: &String| key.len() <= 64 && key.chars().all(|c| c.is_ascii_alphanumeric() || "-_.:".contains(c));
    match request {
        Request::Status | Request::Events { .. } | Request::Tasks(_) | Request::Stop => false,
        Request::Cancel(name) => is_key(name),
        Request::Remove { robot } | Request::Restart { robot } => robot.is_ascii(),
        Request::Pace(PaceChange::Pause) => true,
        Request::Pace(PaceChange::Step { ticks }) => *ticks > 0,
        Request::Pace(PaceChange::Resume { rate }) => rate.is_none_or(|rate| rate.problem().is_none()),
        Request::Add(NewRobot { id, start_m, start_yaw_rad, goal_m, goal_yaw_rad, .. }) => {
            let is_name = |id: &String| {
                let letters = "abcdefghijklmnopqrstuvwxyz0123456789_-";
                id.starts_with(|c: char| c.is_ascii_lowercase())
                    && id.len() <= 32
                    && id.chars().all(|c| letters.contains(c))
            };
            let fits = is_place(*start_m) && is_place(*goal_m) && is_angle(*start_yaw_rad) && is_angle(*goal_yaw_rad);
            fits && id.as_ref().is_none_or(is_name)
        }
        Request::Task(NewTasks { tasks, key, .. }) => {
            let fits = |task: &Task| {
                let deadline = task.deadline_s.is_none_or(|deadline_s| deadline_s > 0.0 && deadline_s.is_finite());
                is_place(task.goal.into()) && is_angle(task.yaw_rad) && deadline
            };
            (1..=BATCH_MAX).contains(&tasks.len()) && tasks.iter().all(fits) && key.as_ref().is_none_or(is_key)
        }
        Request::Inject { fault, for_s, .. } => {
            fault.problem().is_none() && for_s.is_none_or(|for_s| for_s > 0.0 && for_s <= 1e6)
        }
    }
}

/// Bytes that were harmful once, with what was wrong.
const FOUND: [(&str, &[u8]); 2] = [
    ("a task for a robot whose name has 2^62 bytes", &[0x02, 0, 0xfd, 0, 0, 0, 0, 0, 0, 0, 0x40]),
    ("a name that is not UTF-8", &[0x02, 0, 0x02, 0xc0, 0x80, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]),
];

/// Requests that were granted once and should not have been, or whose refusal was harmful, with words of the refusal.
fn found() -> Vec<(&'static str, Request, &'static str)> {
    let unicycle = NewRobot {
        start_m: [-8.0, 4.0],
        goal_m: [8.0, -4.0],
        kind: Some("unicycle".to_owned()),
        ..NewRobot::default()
    };
    let heading = |yaw| Request::Add(NewRobot { goal_yaw_rad: Some(yaw), ..unicycle.clone() });
    let task = |yaw_rad| {
        let tasks = vec![Task { yaw_rad: Some(yaw_rad), ..Task::to([4.0, 0.0]) }];
        Request::Task(NewTasks { assign: Assign::Robot("b".to_owned()), tasks, key: None })
    };
    let escape = "\x1b[2J".to_owned();
    vec![
        ("a new robot's heading at its goal is not a number", heading(f64::NAN), "the heading there"),
        ("a new robot's heading at its goal is endless", heading(f64::INFINITY), "the heading there"),
        ("a task's heading is endless", task(f64::NEG_INFINITY), "the heading there"),
        ("a task's heading has lost its digits", task(1e300), "the heading there"),
        (
            "a new robot's heading has lost its digits",
            Request::Add(NewRobot { start_yaw_rad: Some(1e300), ..unicycle.clone() }),
            "start_yaw_rad: must be a number of rad",
        ),
        (
            "an unknown kind cleared the terminal",
            Request::Add(NewRobot { kind: Some(escape.clone()), ..unicycle }),
            "unknown kind `\\u{1b}[2J`",
        ),
        (
            "the name of a new robot was repeated as it is, in what was wrong with its goal",
            Request::Add(NewRobot { id: Some("a\0b".to_owned()), goal_m: [1e6, 0.0], ..NewRobot::default() }),
            "is not a valid id",
        ),
        (
            "an unknown robot cleared the terminal",
            Request::Inject { robot: escape, fault: Fault::Mute, for_s: None },
            "unknown robot `\\u{1b}[2J`",
        ),
    ]
}

#[test]
fn what_was_found_once_stays_harmless() {
    let scenario = scenario();
    for (what, bytes) in FOUND {
        assert_eq!(Fleet::new(&scenario).take(bytes), Err(false), "{what}");
    }
    for (what, request, words) in found() {
        match Fleet::new(&scenario).take(&codec::encode(&request).expect("it can be encoded")) {
            Ok(Reply::Refused { problem, .. }) => assert!(problem.contains(words), "{what}: {problem}"),
            other => panic!("{what}: {other:?}"),
        }
    }
}

#[test]
fn sensible_requests_are_handed_on() {
    // The others are answered at once, or are about what is not there yet.
    let is_handed_on = |request: &&Request| {
        matches!(
            request,
            Request::Add(_)
                | Request::Remove { .. }
                | Request::Restart { .. }
                | Request::Task(_)
                | Request::Inject { .. }
                | Request::Pace(_)
        )
    };
    for request in sensible().iter().filter(is_handed_on) {
        let mut fleet = Fleet::new(&scenario());
        fleet.tick();
        assert_eq!(fleet.take(&codec::encode(request).expect("it can be encoded")), Err(true), "{request:?}");
        fleet.tick();
    }
}

#[test]
#[expect(clippy::print_stderr, reason = "how long it took, and what it came to")]
fn mutated_requests_do_no_harm() {
    let wanted = number("SHOAL_FUZZ_MESSAGES");
    let messages = wanted.unwrap_or(200_000);
    let first = number("SHOAL_FUZZ_SEED").unwrap_or(1);
    let (scenario, began) = (scenario(), std::time::Instant::now());
    let corpus: Vec<Vec<u8>> =
        sensible().iter().map(|request| codec::encode(request).expect("it can be encoded")).collect();
    let (mut unreadable, mut refused, mut granted, mut peak_max) = (0_u64, 0_u64, 0_u64, 0);
    for epoch in 0..messages.div_ceil(EPOCH) {
        let seed = first.wrapping_add(epoch);
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        let before = held();
        let mut fleet = Fleet::new(&scenario);
        let mut until_tick = 1;
        for message in 0..EPOCH.min(messages - epoch * EPOCH) {
            let bytes = mutant(&corpus, &mut random);
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| peak_of(|| fleet.take(&bytes))));
            let Ok((taken, peak)) = outcome else {
                panic!(
                    "seed {seed}, message {message}: {bytes:?}, as a request {:?}",
                    codec::decode::<Request>(&bytes)
                );
            };
            let most = RESERVE_MAX + EXPANSION_MAX * bytes.len() + ANSWER_MAX;
            assert!(peak <= most, "seed {seed}, message {message}: {bytes:?} took {peak} bytes of memory");
            peak_max = peak_max.max(peak);
            match taken {
                Err(false) => unreadable += 1,
                Err(true) => granted += 1,
                Ok(_) => refused += 1,
            }
            until_tick -= 1;
            if until_tick == 0 {
                fleet.check_bounds();
                fleet.tick();
                until_tick = 1 + random.below(400);
            }
        }
        fleet.tick();
        fleet.check_bounds();
        let holds = held().saturating_sub(before);
        assert!(holds <= HELD_MAX, "seed {seed}: the fleet holds {holds} bytes");
    }
    if wanted.is_some() {
        let seconds = began.elapsed().as_secs_f64();
        eprintln!(
            "{messages} messages in {seconds:.1} s: {unreadable} unreadable, {refused} refused, {granted} granted"
        );
        eprintln!("at most {peak_max} bytes for one of them");
    }
    // A fuzzer that reaches nothing finds nothing.
    let enough = messages / 100;
    assert!([unreadable, refused, granted].iter().all(|count| *count >= enough), "{unreadable} {refused} {granted}");
}

/// What the daemon, the world and the agents tell one another: damaged, it is refused or read, in bounded memory.
#[test]
fn mutated_messages_between_processes_are_refused_or_read() {
    let scenario = scenario();
    let instance = model::RobotInstance { index: RobotIndex(1), incarnation: 0 };
    let mut corpus = vec![codec::encode(&AgentSpec::new(&scenario, &scenario.robots[1], instance)).expect("a spec")];
    for request in sensible() {
        // The orders and notices that requests lead to.
        let mut coordinator = Coordinator::new(scenario.clone());
        let mut world = World::new(&scenario);
        coordinator.request(&request, &|_, _| None);
        for action in coordinator.take_actions() {
            if let Action::Order(order) = action {
                corpus.push(codec::encode(&order).expect("an order"));
                world.order(order);
            }
        }
        world.open(&mut |_| true);
        corpus.extend(world.take_notices().iter().map(|notice| codec::encode(notice).expect("a notice")));
    }
    let mut random = Random(7);
    for _ in 0..number("SHOAL_FUZZ_MESSAGES").unwrap_or(200_000) / 10 {
        let bytes = mutant(&corpus, &mut random);
        let most = RESERVE_MAX + EXPANSION_MAX * bytes.len();
        for peak in [
            peak_of(|| codec::decode::<Order>(&bytes).is_ok()).1,
            peak_of(|| codec::decode::<Notice>(&bytes).is_ok()).1,
            peak_of(|| codec::decode::<AgentSpec>(&bytes).is_ok()).1,
        ] {
            assert!(peak <= most, "{bytes:?} took {peak} bytes of memory");
        }
    }
}

/// What the environment asks for.
fn number(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name} is to be a number, not `{text}`")))
}
