//! Requests that make sense, requests that do not, and messages that are not requests.

use crate::random::Random;
use model::{Fault, PaceChange, Rate, Task, TaskState};
use protocol::codec;
use protocol::operator_to_daemon::{Assign, NewRobot, NewTasks, Request, TaskFilter};
/// Requests that make sense, every kind of them.
pub(crate) fn sensible() -> Vec<Request> {
    let robot = || "b".to_owned();
    let task = |yaw_rad, now| Task { yaw_rad, now, ..Task::to([4.0, -2.5]) };
    let send = |assign: Assign, tasks: Vec<Task>, key: Option<&str>| {
        Request::Task(NewTasks { assign, tasks, key: key.map(str::to_owned) })
    };
    let new = NewRobot { id: Some("new".to_owned()), start_m: [-8.0, 4.0], goal_m: [8.0, -4.0], ..NewRobot::default() };
    let mut requests = vec![
        Request::Status,
        Request::Events { after: 0 },
        Request::Add(new.clone()),
        Request::Add(NewRobot {
            id: None,
            start_yaw_rad: Some(1.0),
            goal_yaw_rad: Some(-2.0),
            planner: Some("straight".to_owned()),
            kind: Some("unicycle".to_owned()),
            ..new
        }),
        send(Assign::Robot(robot()), vec![task(None, false)], Some("order-17")),
        send(Assign::Robot(robot()), vec![Task { deadline_s: Some(3.0), ..task(Some(1.5), true) }], None),
        send(Assign::Nearest, vec![task(None, false), Task::to([-4.0, 2.5])], None),
        send(Assign::Auction, vec![task(None, false), Task::to([-4.0, 2.5])], None),
        send(Assign::Optimal, vec![task(None, false), Task { priority: -3, ..Task::to([-4.0, 2.5]) }], None),
        Request::Tasks(TaskFilter {
            which: vec!["0".to_owned(), "order-17".to_owned()],
            robot: Some(robot()),
            states: vec![TaskState::Active],
            newest: 10,
        }),
        Request::Cancel("0".to_owned()),
        Request::Cancel("order-17".to_owned()),
        Request::Stop,
        Request::Remove { robot: robot() },
        Request::Restart { robot: robot() },
        Request::Pace(PaceChange::Pause),
        Request::Pace(PaceChange::Resume { rate: Some(Rate::Factor(2.5)) }),
        Request::Pace(PaceChange::Step { ticks: 3 }),
    ];
    let faults = [
        (Fault::Kill, None),
        (Fault::Pause, None),
        (Fault::Resume, None),
        (Fault::Mute, Some(0.5)),
        (Fault::Delay { ticks: 5 }, Some(1.0)),
        (Fault::Drop { share: 0.5 }, None),
        (Fault::Noise { sigma_m: 0.1 }, Some(2.5)),
        (Fault::SlowCpu { ms: 5.0 }, None),
    ];
    requests.extend(faults.map(|(fault, for_s)| Request::Inject { robot: robot(), fault, for_s }));
    for request in &requests {
        // A request that comes gets a row above.
        match request {
            Request::Status | Request::Events { .. } | Request::Add(_) | Request::Task(_) | Request::Inject { .. } => {}
            Request::Tasks(_) | Request::Cancel(_) | Request::Stop => {}
            Request::Remove { .. } | Request::Restart { .. } | Request::Pace(_) => {}
        }
    }
    requests
}

/// Numbers that break things.
const NUMBERS: [f64; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    2.5,
    -5.0,
    1e6,
    1e9,
    1e300,
    -1e300,
    f64::MAX,
    f64::MIN_POSITIVE,
    f64::EPSILON,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

/// Names that break things.
const NAMES: [&str; 12] = [
    "",
    "a",
    "b",
    "world",
    "../../etc/passwd",
    "/dev/shm/x",
    "\x1b[2J\x07\r\n",
    "a\0b",
    "\u{202e}abc",
    "ä",
    "new robot",
    "zzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzzz",
];

/// A request that is one by its form, with a content that may break things.
fn hostile(random: &mut Random) -> Request {
    fn number(random: &mut Random) -> f64 {
        NUMBERS[random.below(NUMBERS.len())]
    }
    fn name(random: &mut Random) -> String {
        match random.below(14) {
            12 => "x".repeat(random.below(16_000)),
            13 => format!("n{}", random.below(1000)),
            known => NAMES[known].to_owned(),
        }
    }
    let maybe = |random: &mut Random| random.below(2) == 0;
    match random.below(8) {
        0..3 => Request::Add(NewRobot {
            id: maybe(random).then(|| name(random)),
            start_m: [number(random), number(random)],
            start_yaw_rad: maybe(random).then(|| number(random)),
            goal_m: [number(random), number(random)],
            goal_yaw_rad: maybe(random).then(|| number(random)),
            planner: (random.below(6) == 0).then(|| name(random)),
            kind: match random.below(4) {
                0 => None,
                1 => Some("unicycle".to_owned()),
                2 => Some("two-link-arm".to_owned()),
                _ => Some(name(random)),
            },
        }),
        3 if maybe(random) => Request::Cancel(name(random)),
        3 if maybe(random) => Request::Pace(match random.below(3) {
            0 => PaceChange::Pause,
            1 => PaceChange::Step { ticks: [0, 1, u64::MAX][random.below(3)] },
            _ => PaceChange::Resume { rate: maybe(random).then(|| Rate::Factor(number(random))) },
        }),
        3 if maybe(random) => Request::Remove { robot: name(random) },
        3 if maybe(random) => Request::Restart { robot: name(random) },
        3 => Request::Tasks(TaskFilter {
            which: (0..random.below(3)).map(|_| name(random)).collect(),
            robot: maybe(random).then(|| name(random)),
            states: Vec::new(),
            newest: u32::MAX,
        }),
        4 => {
            let task = |random: &mut Random| Task {
                yaw_rad: maybe(random).then(|| number(random)),
                now: maybe(random),
                priority: [0, -1, i32::MIN, i32::MAX][random.below(4)],
                deadline_s: maybe(random).then(|| number(random)),
                ..Task::to([number(random), number(random)])
            };
            let assign = match random.below(4) {
                0 => Assign::Nearest,
                1 => Assign::Optimal,
                2 => Assign::Auction,
                _ => Assign::Robot(name(random)),
            };
            let tasks = (0..[1, 1, 2, 0, 200][random.below(5)]).map(|_| task(random)).collect();
            Request::Task(NewTasks { assign, tasks, key: maybe(random).then(|| name(random)) })
        }
        _ => {
            let fault = match random.below(8) {
                0 => Fault::Kill,
                1 => Fault::Pause,
                2 => Fault::Resume,
                3 => Fault::Mute,
                4 => Fault::Delay { ticks: [0, 5, 255, 256, u32::MAX][random.below(5)] },
                5 => Fault::Drop { share: number(random) },
                6 => Fault::Noise { sigma_m: number(random) },
                _ => Fault::SlowCpu { ms: number(random) },
            };
            Request::Inject { robot: name(random), fault, for_s: maybe(random).then(|| number(random)) }
        }
    }
}

/// A message: one of the corpus with one to four changes, or a hostile one.
pub(crate) fn mutant(corpus: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let chosen = &corpus[random.below(corpus.len())];
    let mut bytes = match random.below(8) {
        0 => return chosen.clone(),
        1 | 2 => return codec::encode(&hostile(random)).expect("it can be encoded"),
        3 => codec::encode(&hostile(random)).expect("it can be encoded"),
        _ => chosen.clone(),
    };
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len() + 1);
        let (before, after) = (bytes[..at].to_vec(), bytes.get(at + 1..).unwrap_or_default().to_vec());
        let put = |middle: &[u8]| [before.as_slice(), middle, after.as_slice()].concat();
        bytes = match random.below(9) {
            0 => put(&[random.below(256) as u8]),
            1 => put(&[bytes.get(at).copied().unwrap_or(0) ^ (1 << random.below(8))]),
            2 => put(&codec::encode(&(1_u64 << random.below(63))).expect("a number")),
            3 => put(&[0xfd, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff]),
            4 => put(&NUMBERS[random.below(NUMBERS.len())].to_le_bytes()),
            5 => before,
            6 => [before.as_slice(), &corpus[random.below(corpus.len())]].concat(),
            7 => put([&[0xff, 0xfe][..], &[0xc0, 0x80], &[0xed, 0xa0, 0x80], &[0x1b, b'['], b"/"][random.below(5)]),
            _ => after,
        };
    }
    bytes.truncate(16 * 1024);
    bytes
}
