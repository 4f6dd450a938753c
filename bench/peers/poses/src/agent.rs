//! The process of one robot.

use crate::clock::{now_ns, set_timer_slack_1ns, sleep_until_ns};
use crate::link::{Heard, Link};
use crate::samples::Samples;
use crate::{Failure, PERIOD_NS, Pose, RATE_HZ, Transport, WARM_UP_TICKS};
use std::path::PathBuf;
use std::process::ExitCode;

/// How often a robot looks whether it has heard everybody, ns.
const LOOK_NS: u64 = 5_000_000;

/// Who this process is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Args {
    /// Which robot, from 0.
    pub robot: usize,
    /// How many there are.
    pub robots: usize,
    /// The directory of the run: everything that it makes is in there, or begins with its name.
    pub directory: PathBuf,
    /// Words that only some peers know.
    pub options: Vec<String>,
}

impl Args {
    fn parse(mut words: impl Iterator<Item = String>) -> Option<Args> {
        let (robot, robots) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
        let directory = PathBuf::from(words.next()?);
        (robot < robots).then(|| Args { robot, robots, directory, options: words.collect() })
    }

    /// The last part of the directory's name: what shared-memory objects of the run begin with.
    pub fn prefix(&self) -> String {
        self.directory.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Everybody else.
    pub fn others(&self) -> impl Iterator<Item = usize> + use<> {
        let me = self.robot;
        (0..self.robots).filter(move |robot| *robot != me)
    }
}

/// The `main` of a peer: `ROBOT ROBOTS DIRECTORY [OPTION...]`, as the driver starts it.
pub fn run<T: Transport>(open: impl FnOnce(&Args) -> Result<T, Failure>) -> ExitCode {
    let Some(args) = Args::parse(std::env::args().skip(1)) else {
        eprintln!(
            "error: usage: ROBOT ROBOTS DIRECTORY [OPTION...]\nhint: this program is started by `bench/peers/run`"
        );
        return ExitCode::from(2);
    };
    match agent(&args, open) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: robot {}: {failure}", args.robot);
            ExitCode::FAILURE
        }
    }
}

fn agent<T: Transport>(args: &Args, open: impl FnOnce(&Args) -> Result<T, Failure>) -> Result<(), Failure> {
    let mut link = Link::open(&args.directory)?;
    link.say(&format!("hello {} {}", args.robot, std::process::id()))?;
    // Before the transport starts its threads: they inherit it.
    set_timer_slack_1ns();
    let mut transport = open(args)?;
    let mut own = Pose { robot: args.robot as u32, x_m: args.robot as f64, ..Pose::default() };
    let Some((start_ns, ticks)) = meet(args, &mut link, &mut transport, &mut own)? else { return Ok(()) };
    let Some(samples) = steps(args, &mut link, &mut transport, &mut own, start_ns, ticks)? else { return Ok(()) };
    link.say("done")?;
    if link.hear(true)? == Heard::Gone {
        return Ok(());
    }
    link.say(&format!("{}end", samples.to_lines()))
}

/// Publishes at the rate of the loop until the driver has heard that everybody has heard everybody: when the loop
/// starts, and for how many ticks; `None` if the driver has gone.
fn meet<T: Transport>(
    args: &Args,
    link: &mut Link,
    transport: &mut T,
    own: &mut Pose,
) -> Result<Option<(u64, u64)>, Failure> {
    let mut silent: Vec<usize> = args.others().collect();
    let mut connected = false;
    for look in 0.. {
        let due_ns = now_ns() + LOOK_NS;
        match link.hear(false)? {
            Heard::Gone => return Ok(None),
            Heard::Line(line) => return start_of(&line).map(Some).ok_or_else(|| format!("told `{line}`").into()),
            Heard::Nothing => {}
        }
        if look % (PERIOD_NS / LOOK_NS) == 0 {
            own.stamp_ns = now_ns();
            transport.publish(own)?;
        }
        if !connected {
            transport.connect()?;
            silent.retain(|robot| transport.newest(*robot).is_none());
            if silent.is_empty() {
                link.say(&format!("connected {}", now_ns()))?;
                connected = true;
            }
        }
        sleep_until_ns(due_ns);
    }
    unreachable!("a u64 of looks takes longer than the machine lasts")
}

fn start_of(line: &str) -> Option<(u64, u64)> {
    let mut words = line.strip_prefix("start ")?.split(' ').map(str::parse);
    Some((words.next()?.ok()?, words.next()?.ok()?))
}

/// The loop. `None` if the driver has gone.
fn steps<T: Transport>(
    args: &Args,
    link: &mut Link,
    transport: &mut T,
    own: &mut Pose,
    start_ns: u64,
    ticks: u64,
) -> Result<Option<Samples>, Failure> {
    let first_ns = start_ns + PERIOD_NS * args.robot as u64 / args.robots as u64;
    let last = WARM_UP_TICKS + ticks;
    let mut samples = Samples::default();
    let mut poses = vec![None; args.robots];
    // The newest tick of everybody that this robot has had in hand.
    let mut had = vec![0; args.robots];
    let mut tick = 1;
    while tick <= last {
        let due_ns = first_ns + tick * PERIOD_NS;
        sleep_until_ns(due_ns);
        let woken_ns = now_ns();
        for robot in args.others() {
            poses[robot] = transport.newest(robot);
        }
        let used_ns = now_ns();
        own.step(&poses, 1.0 / RATE_HZ as f64);
        own.tick = tick;
        own.stamp_ns = now_ns();
        transport.publish(own)?;

        for robot in args.others() {
            // Whose phase comes later in the period is one tick behind.
            let expected = if robot < args.robot { tick } else { tick - 1 };
            let (seen, stamp_ns) = poses[robot].map_or((0, start_ns), |pose: Pose| (pose.tick, pose.stamp_ns));
            if tick > WARM_UP_TICKS {
                let behind = expected.saturating_sub(seen);
                samples.added.saturating_record(used_ns.saturating_sub(woken_ns) + behind * PERIOD_NS);
                samples.age.saturating_record(used_ns.saturating_sub(stamp_ns));
                samples.lost += seen.saturating_sub(had[robot] + 1);
            }
            had[robot] = seen.max(had[robot]);
        }
        if tick > WARM_UP_TICKS {
            samples.late.saturating_record(woken_ns.saturating_sub(due_ns));
        }
        if tick % RATE_HZ == 0 && link.hear(false)? == Heard::Gone {
            return Ok(None);
        }
        // The next tick, or the one that is due now if this took too long.
        let due = (now_ns() - first_ns) / PERIOD_NS;
        samples.missed += due.saturating_sub(tick + 1);
        tick = due.max(tick + 1);
    }
    for robot in args.others() {
        let expected = if robot < args.robot { last } else { last - 1 };
        samples.expected += ticks;
        samples.lost += expected.saturating_sub(had[robot]);
    }
    Ok(Some(samples))
}
