//! Damaged and hostile bytes, decoded as every kind of message and file that is bincode: decoding never panics, takes
//! memory in proportion to its input, and what it accepts can be encoded and decoded again.

#[path = "../../tests/counting.rs"]
mod counting;

use counting::peak_of;
use model::{
    Event, EventKind, Fault, Gone, Outcome, PaceChange, PaceState, Partner, Rate, RobotIndex, RobotInstance,
    RobotOutcome, Scenario, Task, TaskEnd, TaskId, TaskState, TaskStep, Touch,
};
use proptest::prelude::*;
use scenarios::Overrides;
use serde::Serialize;
use serde::de::DeserializeOwned;
use shoal_protocol::codec::{EXPANSION_MAX, RESERVE_MAX, decode, encode};
use shoal_protocol::daemon_to_robot::AgentSpec;
use shoal_protocol::daemon_to_world::{Absence, FaultId, Order, PaceId, Ticket};
use shoal_protocol::operator_to_daemon::{
    Assign, NewRobot, NewTasks, Reply, Request, RobotStatus, Status, TaskChange, TaskFilter, TaskRecord,
};
use shoal_protocol::world_to_daemon::Notice;

/// A type that is decoded from bytes of another process or of a file.
struct Kind {
    name: &'static str,
    /// Encoded values, as many as it takes to have every variant and no empty list.
    samples: Vec<Vec<u8>>,
    /// Decodes the bytes as this type and checks what comes of it.
    check: fn(&[u8]) -> Result<(), String>,
}

fn kind<T: Serialize + DeserializeOwned>(samples: &[T]) -> Kind {
    let samples = samples.iter().map(|sample| encode(sample).unwrap()).collect();
    Kind { name: std::any::type_name::<T>(), samples, check: check::<T> }
}

fn check<T: Serialize + DeserializeOwned>(bytes: &[u8]) -> Result<(), String> {
    let (decoded, peak) = peak_of(|| decode::<T>(bytes));
    let most = RESERVE_MAX + EXPANSION_MAX * bytes.len();
    if peak > most {
        return Err(format!("{} bytes took {peak} bytes of memory, more than {most}", bytes.len()));
    }
    let Ok(value) = decoded else { return Ok(()) };
    // Compared as bytes: NaN differs from itself.
    let once = encode(&value).map_err(|error| error.to_string())?;
    let twice = decode::<T>(&once).and_then(|value| encode(&value)).map_err(|error| error.to_string())?;
    if once == twice { Ok(()) } else { Err("it is another value after one more round".to_owned()) }
}

fn scenario(name: &str) -> Scenario {
    let entry = scenarios::find_catalog(name).unwrap();
    scenarios::parse(entry.name, entry.text, &Overrides::default()).unwrap()
}

fn kinds() -> Vec<Kind> {
    let instance = RobotInstance { index: RobotIndex(3), incarnation: 1 };
    let text = || "r03".to_owned();
    let scenarios = ["mixed", "moving-obstacles", "tasks", "arm-1"].map(scenario);
    let robot = || Box::new(scenarios[0].template.clone());
    let event = || Event {
        tick: 300,
        robot: Some(RobotIndex(3)),
        kind: EventKind::Contact { with: Partner::Robot(RobotIndex(7)), touch: Touch { t_s: 6.0, at_m: [0.5, -2.0] } },
    };
    let died =
        || Event { tick: 301, robot: None, kind: EventKind::Died { signal: Some(11), code: None, words: text() } };
    let robots = vec![RobotOutcome { time_s: Some(1.5), gone: Some(Gone::Dropped), ..RobotOutcome::default() }; 2];
    let outcome = || Outcome { robots: robots.clone(), events: vec![event(), died()], ..Outcome::default() };
    let robot_status =
        RobotStatus { id: text(), pid: Some(70_000), goal_m: Some([0.0, 1e300]), ..RobotStatus::default() };
    let status = Status { scenario: text(), tick: 1 << 40, robots: vec![robot_status; 2], ..Status::default() };
    let new_robot = NewRobot { id: Some(text()), planner: Some(text()), kind: Some(text()), ..NewRobot::default() };
    let absences = [
        Absence::Died { signal: Some(-9), code: None, words: text() },
        Absence::Stopped,
        Absence::Overdue,
        Absence::NotStarted { why: text() },
        Absence::Deaf { why: text() },
    ];
    let mut orders = vec![
        Order::Admit { instance, robot: robot() },
        Order::Remove { index: RobotIndex(3) },
        Order::Restart { index: RobotIndex(3) },
        Order::Task {
            id: TaskId(1),
            index: RobotIndex(3),
            task: Task { now: true, deadline_s: Some(3.0), ..Task::to([1.0, 2.0]) },
        },
        Order::Fault { id: FaultId(1), index: RobotIndex(3), fault: Fault::SlowCpu { ms: 2.5 }, ticks: Some(75) },
        Order::Cancel { id: TaskId(1), index: RobotIndex(3) },
        Order::Stop,
        Order::Pace { id: PaceId(1), change: PaceChange::Resume { rate: Some(Rate::Factor(2.0)) } },
        Order::Pace { id: PaceId(2), change: PaceChange::Step { ticks: 3 } },
    ];
    orders.extend(absences.map(|cause| Order::Absent { instance, cause }));
    let step = TaskChange { at_ms: 1, state: TaskState::Failed, robot: text(), reason: text() };
    let task = Task { deadline_s: Some(1.0), ..Task::to([1.0; 2]) };
    let record = TaskRecord {
        id: TaskId(1),
        key: Some(text()),
        assign: Assign::Robot(text()),
        robot: text(),
        task,
        state: TaskState::Failed,
        steps: vec![step],
    };
    vec![
        kind(&[
            Request::Status,
            Request::Events { after: 7 },
            Request::Add(new_robot),
            Request::Task(NewTasks {
                assign: Assign::Robot(text()),
                tasks: vec![Task { now: true, yaw_rad: Some(1.0), ..Task::to([1.0; 2]) }],
                key: Some(text()),
            }),
            Request::Tasks(TaskFilter {
                which: vec![text()],
                robot: Some(text()),
                states: vec![TaskState::Active],
                newest: 3,
            }),
            Request::Cancel(text()),
            Request::Stop,
            Request::Remove { robot: text() },
            Request::Restart { robot: text() },
            Request::Inject { robot: text(), fault: Fault::Drop { share: 0.5 }, for_s: Some(1.5) },
            Request::Pace(PaceChange::Pause),
        ]),
        kind(&[
            Reply::Status(status),
            Reply::Joined { robot: text(), index: RobotIndex(3), incarnation: 1, joined_ms: 51.5, neighbors: 14 },
            Reply::Tasked(vec![record.clone()]),
            Reply::Tasks(vec![record]),
            Reply::Removed { robot: text() },
            Reply::Stopping,
            Reply::Pace(PaceState { until_tick: Some(7), rate: Rate::Factor(0.5), ..PaceState::default() }),
            Reply::Injected { ticks: Some(75) },
            Reply::Unconfirmed { problem: text(), hint: text() },
            Reply::Failed { problem: text(), hint: text() },
            Reply::Refused { problem: text(), hint: Some(text()) },
        ]),
        kind(&orders),
        kind(&[
            Notice::Expect { instance, tick: 4 },
            Notice::Entered { instance, tick: 4 },
            Notice::Kill { instance },
            Notice::Pause { instance },
            Notice::Resume { instance },
            Notice::Left { instance },
            Notice::RestartLimit { instance },
            Notice::Answer { ticket: Ticket::Task(TaskId(1)), refused: Some(text()) },
            Notice::Task { id: TaskId(1), step: TaskStep::Dropped(TaskEnd::Overdue) },
            Notice::Log(event()),
            Notice::Pace(PaceState { until_tick: Some(7), ..PaceState::default() }),
        ]),
        kind(&[outcome()]),
        kind(&scenarios.each_ref().map(|scenario| AgentSpec::new(scenario, &scenario.robots[0], instance))),
        kind(&scenarios),
        kind(&[*robot()]),
    ]
}

/// A number as bincode writes it: the length of a text or a list.
fn length(value: u64) -> Vec<u8> {
    encode(&value).unwrap()
}

/// More elements than any input holds.
const CLAIM: u64 = 1 << 62;

/// The bytes with a length at that place instead of what was there.
fn claiming(bytes: &[u8], at: usize, claim: u64) -> Vec<u8> {
    [&bytes[..at], &length(claim), &bytes[at + 1..]].concat()
}

/// Every damage of one place: cut off, another byte, a length that cannot be, lists of the smallest elements.
fn damage(bytes: &[u8], at: usize, zeros: &[u8]) -> Vec<Vec<u8>> {
    let (before, byte, after) = (&bytes[..at], bytes[at], &bytes[at + 1..]);
    let mut damaged = vec![before.to_vec()];
    for other in [0, 1, byte.wrapping_add(1), byte ^ 0x80, 0xfb, 0xfc, 0xfd, 0xfe, 0xff] {
        damaged.push([before, &[other], after].concat());
    }
    for claim in [300, 70_000, 1 << 32, 1 << 40, CLAIM, u64::MAX] {
        damaged.push(claiming(bytes, at, claim));
        damaged.push([before, &length(claim), &bytes[at..]].concat());
    }
    // Lists that have just grown beyond what was reserved for them, and long ones.
    for count in [50_000, 70_000, zeros.len()] {
        damaged.push([before, &length(count as u64), &zeros[..count]].concat());
    }
    damaged
}

#[test]
fn whatever_a_place_is_damaged_to_decoding_takes_memory_in_proportion() {
    let zeros = vec![0; 300_000];
    for Kind { name, samples, check } in kinds() {
        for (number, sample) in samples.iter().enumerate() {
            check(sample).unwrap_or_else(|error| panic!("{name}, sample {number}: {error}"));
            for at in 0..sample.len() {
                for damaged in damage(sample, at, &zeros) {
                    let begin = &damaged[..damaged.len().min(at + 16)];
                    check(&damaged)
                        .unwrap_or_else(|error| panic!("{name}, sample {number}, place {at}: {error}\n{begin:02x?}"));
                }
            }
        }
    }
}

#[test]
fn lists_that_claim_too_much_within_each_other_take_memory_in_proportion() {
    let mut pairs = 0;
    for Kind { name, samples, check } in kinds() {
        for (number, sample) in samples.iter().enumerate() {
            let reserves = |at: &usize| peak_of(|| check(&claiming(sample, *at, CLAIM))).1 > 1 << 19;
            let lists: Vec<usize> = (0..sample.len()).filter(reserves).collect();
            for (i, outer) in lists.iter().enumerate() {
                for inner in &lists[i + 1..] {
                    check(&claiming(&claiming(sample, *inner, CLAIM), *outer, CLAIM))
                        .unwrap_or_else(|error| panic!("{name}, sample {number}, {outer} and {inner}: {error}"));
                    pairs += 1;
                }
            }
        }
    }
    assert!(pairs > 0, "no list was found");
}

/// One change of bytes; places and lengths are taken modulo what there is.
#[derive(Clone, Debug)]
enum Change {
    Put(usize, u8),
    Insert(usize, Vec<u8>),
    Remove(usize, usize),
    Repeat(usize, usize, usize),
    Claim(usize, u64),
    Cut(usize),
}

impl Change {
    fn apply(&self, bytes: &mut Vec<u8>) {
        let place = |at: usize, bytes: &[u8]| at % (bytes.len() + 1);
        match self {
            Change::Put(at, byte) => {
                let at = place(*at, bytes);
                bytes.splice(at..bytes.len().min(at + 1), [*byte]);
            }
            Change::Insert(at, inserted) => {
                let at = place(*at, bytes);
                bytes.splice(at..at, inserted.iter().copied());
            }
            Change::Remove(at, count) => {
                let at = place(*at, bytes);
                bytes.drain(at..bytes.len().min(at + count));
            }
            Change::Repeat(at, count, times) => {
                let at = place(*at, bytes);
                let repeated = bytes[at..bytes.len().min(at + count)].repeat(*times);
                bytes.splice(at..at, repeated);
            }
            Change::Claim(at, claim) => {
                let at = place(*at, bytes);
                bytes.splice(at..bytes.len().min(at + 1), length(*claim));
            }
            Change::Cut(at) => bytes.truncate(place(*at, bytes)),
        }
    }
}

fn change() -> impl Strategy<Value = Change> {
    let at = || any::<usize>();
    prop_oneof![
        (at(), any::<u8>()).prop_map(|(at, byte)| Change::Put(at, byte)),
        (at(), prop::collection::vec(any::<u8>(), 1..20)).prop_map(|(at, bytes)| Change::Insert(at, bytes)),
        (at(), 1..40_usize).prop_map(|(at, count)| Change::Remove(at, count)),
        (at(), 1..60_usize, 1..200_usize).prop_map(|(at, count, times)| Change::Repeat(at, count, times)),
        (at(), (0..64_u32, any::<u64>())).prop_map(|(at, (bits, claim))| Change::Claim(at, claim >> bits)),
        at().prop_map(Change::Cut),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1024, failure_persistence: None, ..ProptestConfig::default() })]

    /// Messages changed in several places, and messages of one kind read as another.
    #[test]
    fn changed_messages_are_refused_or_read_whatever_they_are_read_as(
        from in any::<prop::sample::Index>(),
        sample in any::<prop::sample::Index>(),
        changes in prop::collection::vec(change(), 0..6),
    ) {
        let kinds = kinds();
        let mut bytes = from.get(&kinds).samples[sample.index(from.get(&kinds).samples.len())].clone();
        changes.iter().for_each(|change| change.apply(&mut bytes));
        for Kind { name, check, .. } in kinds {
            check(&bytes).map_err(|error| TestCaseError::fail(format!("{name}: {error}")))?;
        }
    }

    /// Bytes that begin with the number of any variant, also of one that has no sample here.
    #[test]
    fn noise_is_refused_or_read(tag in 0..24_u8, noise in prop::collection::vec(any::<u8>(), 0..400)) {
        let bytes = [&[tag], noise.as_slice()].concat();
        for Kind { name, check, .. } in kinds() {
            check(&bytes).map_err(|error| TestCaseError::fail(format!("{name}: {error}")))?;
        }
    }
}
