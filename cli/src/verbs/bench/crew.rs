//! Processes that do nothing but wait for each other, or for time: the floor of what a fleet of as many can reach.

use crate::exit::Failure;
use bus::bare::Barrier;
use bus::{Address, Lease, clean, clock};
use daemon::processes::{DYING, shoal};
use daemon::signals::Interrupted;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::{self, Read};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// How long bare processes may take for anything.
const PATIENCE: Duration = Duration::from_secs(30);

/// Processes that end with this.
struct Processes(Vec<Child>);

impl Processes {
    fn start(count: usize, command: impl Fn(usize) -> Command) -> Result<Processes, Failure> {
        let mut all = Processes(Vec::with_capacity(count));
        for index in 0..count {
            let child = command(index).stdin(Stdio::null()).stderr(Stdio::null()).spawn().map_err(failed)?;
            all.0.push(child);
        }
        Ok(all)
    }

    /// What each of them prints until it closes its output, which it has to do by this time.
    fn output(mut self, until_ns: u64) -> Result<Vec<Vec<u8>>, Failure> {
        self.0.iter_mut().map(|child| output(child, until_ns)).collect()
    }
}

fn output(child: &mut Child, until_ns: u64) -> Result<Vec<u8>, Failure> {
    let (mut words, mut chunk) = (Vec::new(), [0; 4096]);
    let Some(mut stdout) = child.stdout.take() else { return Ok(words) };
    loop {
        let left_ns = until_ns.saturating_sub(clock::now_ns());
        let left = Timespec { tv_sec: (left_ns / 1_000_000_000) as i64, tv_nsec: (left_ns % 1_000_000_000) as i64 };
        if poll(&mut [PollFd::new(&stdout, PollFlags::IN)], Some(&left)) == Ok(0) {
            let message = format!("bare processes: process {} does not end", child.id());
            return Err(
                Failure::environment(message).hint("is it stopped, or the machine overloaded? try fewer robots")
            );
        }
        match stdout.read(&mut chunk) {
            Ok(0) => return Ok(words),
            Ok(more) => words.extend_from_slice(&chunk[..more]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(Failure::environment(format!("bare processes: cannot read: {error}"))),
        }
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill();
        }
        // One that the kernel does not let go is left to it.
        let until_ns = clock::now_ns() + DYING.as_nanos() as u64;
        for child in &mut self.0 {
            while matches!(child.try_wait(), Ok(None)) && clock::now_ns() < until_ns {
                clock::sleep_until_ns(clock::now_ns() + 1_000_000);
            }
        }
    }
}

fn failed(error: io::Error) -> Failure {
    Failure::environment(format!("bare processes: cannot start: {error}"))
        .hint("is the limit on processes reached? see `shoal doctor`")
}

fn bare(arguments: &[&str]) -> Command {
    let mut command = shoal("bare");
    command.arg("--parent").arg(std::process::id().to_string()).args(arguments);
    command
}

/// As many processes as there are robots, at a barrier. This process opens it.
pub(super) struct Crew {
    barrier: Barrier,
    count: u32,
    /// From the first spawn to the end of the first round, ms.
    pub(super) startup_ms: f64,
    processes: Processes,
}

/// Where the barrier is until everybody has found it.
struct Place {
    address: Address,
    _lease: Lease,
}

impl Drop for Place {
    fn drop(&mut self) {
        clean::sweep(&self.address);
    }
}

impl Crew {
    /// Starts them, and lets them through once.
    pub(super) fn start(count: usize) -> Result<Crew, Failure> {
        let address = Address::create()?;
        let place = Place { _lease: Lease::take(&address)?, address };
        let barrier = Barrier::create(&place.address)?;
        let spawned_ns = clock::now_ns();
        let root = place.address.root().to_string_lossy().into_owned();
        let processes = Processes::start(count, |_| {
            let mut command = bare(&["barrier", "--root", &root]);
            command.stdout(Stdio::null());
            command
        })?;
        let count = count as u32;
        while barrier.members() < count {
            if clock::now_ns() > spawned_ns + PATIENCE.as_nanos() as u64 {
                return Err(Failure::environment("bare processes: they do not start")
                    .hint("is the machine out of memory or processes?"));
            }
            clock::sleep_until_ns(clock::now_ns() + 200_000);
        }
        // Everybody has mapped it, and nobody else is to find it: to others it would look like a fleet.
        drop(place);
        barrier.round(count, PATIENCE)?;
        let startup_ms = clock::now_ns().saturating_sub(spawned_ns) as f64 * 1e-6;
        Ok(Crew { barrier, count, startup_ms, processes })
    }

    /// Time on a processor so far, of all members and of this process, us.
    pub(super) fn ran_us(&self) -> f64 {
        ran_us(self.processes.0.iter().map(Child::id).chain([std::process::id()]))
    }

    /// Opens the barrier so often; the time from opening to opening, us.
    pub(super) fn rounds(&self, count: usize) -> Result<Vec<f64>, Failure> {
        let mut opened_ns = Vec::with_capacity(count + 1);
        for _ in 0..count {
            opened_ns.push(clock::now_ns());
            self.barrier.round(self.count, PATIENCE)?;
        }
        opened_ns.push(clock::now_ns());
        Ok(opened_ns.windows(2).map(|two| (two[1] - two[0]) as f64 * 1e-3).collect())
    }
}

/// How late the wake-ups of so many timers were, us: one timer per process, spread over the period as agents are.
pub(super) fn timers(count: usize, period_ns: u64, seconds: f64) -> Result<Vec<f64>, Failure> {
    let periods = (seconds * 1e9 / period_ns as f64).ceil() as usize;
    // Until then they have all started: spawning is not what is measured.
    let start_ns = clock::now_ns() + 5_000_000 * (count as u64 + 20);
    let processes = Processes::start(count, |index| {
        let first_ns = start_ns + period_ns * (index as u64 + 1) / (count as u64 + 1);
        let [first, period, periods] = [first_ns, period_ns, periods as u64].map(|number| number.to_string());
        let mut command = bare(&["timer", "--first-ns", &first, "--period-ns", &period, "--periods", &periods]);
        command.stdout(Stdio::piped());
        command
    })?;
    let last_ns = start_ns + period_ns * (periods as u64 + 1);
    let mut late_us = Vec::with_capacity(count * periods);
    for words in processes.output(last_ns + PATIENCE.as_nanos() as u64)? {
        let (late_ns, _) = words.as_chunks::<4>();
        late_us.extend(late_ns.iter().map(|ns| f64::from(u32::from_ne_bytes(*ns)) * 1e-3));
    }
    Ok(late_us)
}

/// Time on a processor so far, of all of these together, us.
pub(super) fn ran_us(pids: impl Iterator<Item = u32>) -> f64 {
    pids.filter_map(clock::schedstat_of).map(|stat| stat.ran_ns as f64 * 1e-3).sum()
}

/// Sleeps, but not through an interruption.
pub(super) fn rest(time: Duration, interrupted: &Interrupted) {
    let until_ns = clock::now_ns() + time.as_nanos() as u64;
    while !interrupted.yes() && clock::now_ns() < until_ns {
        clock::sleep_until_ns(until_ns.min(clock::now_ns() + 50_000_000));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[expect(clippy::disallowed_methods, reason = "processes that do not do what bare ones do")]
    fn script(text: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", text]).stdout(Stdio::piped());
        command
    }

    #[test]
    fn bare_processes_that_do_not_end_are_an_error() {
        // More than a pipe holds, from both.
        let long = |_| script("head -c 200000 /dev/zero");
        let words = Processes::start(2, long).unwrap().output(clock::now_ns() + 60_000_000_000).unwrap();
        assert_eq!(words.iter().map(Vec::len).collect::<Vec<_>>(), [200_000; 2]);

        // The second one prints, and then sleeps.
        let processes = Processes::start(2, |index| script(["exit", "echo late; exec sleep 30"][index])).unwrap();
        let late = processes.0[1].id();
        let failure = processes.output(clock::now_ns() + 200_000_000).unwrap_err().to_string();
        assert!(failure.contains(&format!("bare processes: process {late} does not end")), "{failure}");
        assert!(bus::process::state_of(late).is_none(), "it was killed and reaped");
    }
}
