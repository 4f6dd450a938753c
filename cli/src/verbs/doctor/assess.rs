//! What the state of a machine means for fleets.

use super::{Check, Machine, State};
use bus::{Sizes, descriptors};
use daemon::limits;
use report::text::bytes_text;

/// Fleets that a machine is measured by: the demo, a large one, a very large one.
const FLEETS: [u32; 3] = [15, 64, 200];
/// Pieces of obstacles that are reckoned with.
const SHAPE_PIECES: u32 = 64;

const PIDFD_HINT: &str = "fleets run; processes of a fleet whose daemon and guardian were killed are ended by number";

/// Judges what was seen.
pub fn assess(machine: &Machine) -> Vec<Check> {
    let mut checks = vec![
        shared_memory(machine),
        open_files_of_a_process(machine),
        fits(
            "open files of the machine",
            "a fleet",
            machine.open_files_left,
            |robots| u64::from(robots + 2) * open_files(robots),
            &plain,
            "raise it: `sysctl fs.file-max=2000000`",
        ),
        fits(
            "memory mappings",
            "a process",
            machine.maps_max,
            |robots| 300 + 8 * u64::from(robots),
            &plain,
            "raise it: `sysctl vm.max_map_count=262144`",
        ),
        fits(
            "processes",
            "a fleet",
            machine.processes_left,
            |robots| u64::from(robots) + 8,
            &plain,
            "raise the limit: `ulimit -u`, `--pids-limit` of a container, `TasksMax=` of a unit",
        ),
        fits(
            "memory",
            "a fleet",
            machine.memory_available,
            // With something to spare: planners may keep more than the boards.
            |robots| limits::memory_needed(robots.into()) * 3 / 2,
            &bytes_text,
            "end what uses it, raise the limit (`--memory` of a container, `MemoryMax=` of a unit), or run fewer robots",
        ),
    ];
    checks.push(cores(machine));
    checks.push(real_time(machine));
    checks.push(works("pidfd", &machine.pidfd, State::Warn, PIDFD_HINT, &machine.kernel));
    checks.push(works("futex", &machine.futex, State::Fail, "is the call filtered (seccomp)?", &machine.kernel));
    let hint = "wake-ups come up to 50 us late; is the call filtered (seccomp)?";
    checks.push(works("timer slack", &machine.timer_slack, State::Warn, hint, "can be set to 1 ns"));
    checks.push(clock_source(machine));
    checks.push(schedstat(machine));
    checks.push(leftovers(machine));
    checks
}

/// Open files of the busiest process of a fleet in which all robots hear each other.
fn open_files(robots: u32) -> u64 {
    descriptors::of_world(robots as usize).max(descriptors::of_daemon())
}

fn open_files_of_a_process(machine: &Machine) -> Check {
    let hint = "raise the hard limit (`ulimit -Hn`), or let robots hear fewer others (radio_range_m)";
    let mut check = fits("open files", "a process", machine.open_files_max, open_files, &plain, hint);
    if let Some(limit) = machine.open_files_max {
        check.detail += &format!("; enough for {} robots", descriptors::robots_max(limit));
    }
    check
}

fn plain(n: u64) -> String {
    n.to_string()
}

fn pass(name: &'static str, detail: impl Into<String>) -> Check {
    Check { name, status: State::Pass, detail: detail.into(), hint: None }
}

fn shared_memory(machine: &Machine) -> Check {
    const NAME: &str = "shared memory";
    let need = |robots| Sizes { max_robots: robots, shape_pieces: SHAPE_PIECES }.bytes_needed_here();
    match &machine.shm_free {
        Err((cause, hint)) => Check { name: NAME, status: State::Fail, detail: cause.clone(), hint: hint.clone() },
        Ok(free) => {
            let hint = "enlarge it: `mount -o remount,size=2G /dev/shm`, or `--shm-size` of a container";
            fits(NAME, "a fleet", Some(*free), need, &bytes_text, hint)
        }
    }
}

/// Whether what is available is enough, and for how large a fleet.
fn fits(
    name: &'static str,
    whose: &str,
    available: Option<u64>,
    need: impl Fn(u32) -> u64,
    show: &dyn Fn(u64) -> String,
    hint: &str,
) -> Check {
    let Some(available) = available else { return pass(name, "no limit") };
    let needs: Vec<String> =
        FLEETS.iter().map(|&robots| format!("{} for {robots} robots", show(need(robots)))).collect();
    let detail = format!("{} available, {whose} needs {}", show(available), needs.join(", "));
    let status = match FLEETS.map(|robots| need(robots) <= available) {
        [_, _, true] => State::Pass,
        [true, _, _] => State::Warn,
        [false, _, _] => State::Fail,
    };
    Check { name, status, detail, hint: (status != State::Pass).then(|| hint.to_owned()) }
}

fn works(name: &'static str, tried: &Result<(), String>, otherwise: State, hint: &str, detail: &str) -> Check {
    match tried {
        Ok(()) => pass(name, format!("works ({detail})")),
        Err(cause) => Check { name, status: otherwise, detail: cause.clone(), hint: Some(hint.to_owned()) },
    }
}

fn cores(machine: &Machine) -> Check {
    let mut detail = machine.cores.to_string();
    if !machine.cpus.is_empty() && machine.cores > 1 {
        detail += &format!(" (of the numbers {})", model::cpu_list(&machine.cpus));
    }
    let quota = machine.processors_max.filter(|quota| *quota < machine.cores as f64 + 1.0);
    if let Some(quota) = quota {
        detail += &format!(", and the time of {quota:.2} by the cgroup");
    }
    let few = machine.cores == 1 || quota.is_some_and(|quota| quota < 2.0);
    let hint = "`realtime` may be starved: watch the verdict, or use `--mode lockstep`";
    let status = if few { State::Warn } else { State::Pass };
    Check { name: "processors", status, detail, hint: few.then(|| hint.to_owned()) }
}

/// Nothing needs them unless a scenario asks for them: where they are not permitted, nothing is wrong.
fn real_time(machine: &Machine) -> Check {
    let detail = match &machine.real_time {
        Ok(priority) => format!("fifo and rr are permitted, up to priority {priority}"),
        Err(cause) => {
            format!("fifo and rr are not permitted ({cause}); only `[processes]` of a scenario asks for them")
        }
    };
    pass("real-time classes", detail)
}

fn clock_source(machine: &Machine) -> Check {
    const NAME: &str = "clock source";
    let slow = |detail: String| Check {
        name: NAME,
        status: State::Warn,
        detail,
        hint: Some(
            "every time stamp is a slow system call; is `tsc` available and reliable on this machine?".to_owned(),
        ),
    };
    match machine.clock_source.as_deref() {
        Some(name @ ("hpet" | "acpi_pm" | "jiffies" | "refined-jiffies" | "pit")) => slow(format!("{name} is slow")),
        Some(name) => pass(NAME, name),
        // Containers often hide it; the clock works all the same.
        None => pass(NAME, "not shown by this system"),
    }
}

fn schedstat(machine: &Machine) -> Check {
    const NAME: &str = "scheduler statistics";
    if machine.schedstat {
        return pass(NAME, "/proc/self/schedstat can be read");
    }
    Check {
        name: NAME,
        status: State::Warn,
        detail: "/proc/self/schedstat says nothing".to_owned(),
        hint: Some("the verdict cannot see how long processes waited for a processor".to_owned()),
    }
}

fn leftovers(machine: &Machine) -> Check {
    const NAME: &str = "fleets";
    match (machine.fleets_running.as_slice(), machine.fleets_abandoned.as_slice()) {
        ([], []) => pass(NAME, "none is running, nothing is left of earlier ones"),
        (running, []) => pass(NAME, format!("running: {}", running.join(", "))),
        (_, abandoned) => Check {
            name: NAME,
            status: State::Warn,
            detail: format!("left behind: {}", abandoned.join(", ")),
            hint: Some("`shoal clean` removes them; so does the next run".to_owned()),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::super::render;
    use super::*;
    use report::Page;

    fn healthy() -> Machine {
        Machine {
            shm_free: Ok(8 << 30),
            open_files_max: Some(1_048_576),
            open_files_left: None,
            maps_max: Some(65_530),
            processes_left: Some(30_000),
            memory_available: Some(16 << 30),
            processors_max: None,
            cores: 8,
            cpus: (0..8).collect(),
            real_time: Ok(99),
            schedstat: true,
            kernel: "6.1.0".into(),
            pidfd: Ok(()),
            futex: Ok(()),
            timer_slack: Ok(()),
            clock_source: Some("tsc".into()),
            fleets_running: Vec::new(),
            fleets_abandoned: Vec::new(),
        }
    }

    fn check(change: impl FnOnce(&mut Machine), name: &str, status: State) {
        let mut machine = healthy();
        change(&mut machine);
        for check in assess(&machine) {
            let expected = if check.name == name { status } else { State::Pass };
            assert_eq!(check.status, expected, "{check:?}");
            assert_eq!(check.hint.is_some(), check.status != State::Pass, "{check:?}");
        }
    }

    #[test]
    fn each_trouble_is_one_check() {
        check(|_| {}, "", State::Pass);
        let full = ("`/dev/shm`: it is full".to_owned(), Some("empty it".to_owned()));
        check(|machine| machine.shm_free = Err(full), "shared memory", State::Fail);
        check(|machine| machine.shm_free = Ok(64 << 10), "shared memory", State::Fail);
        check(|machine| machine.open_files_max = Some(1024), "open files", State::Warn);
        check(|machine| machine.open_files_max = Some(100), "open files", State::Fail);
        check(|machine| machine.maps_max = Some(100), "memory mappings", State::Fail);
        check(|machine| machine.processes_left = Some(100), "processes", State::Warn);
        check(|machine| machine.memory_available = Some(1 << 20), "memory", State::Fail);
        check(|machine| machine.cores = 1, "processors", State::Warn);
        check(|machine| machine.processors_max = Some(1.5), "processors", State::Warn);
        check(|machine| machine.processors_max = Some(4.0), "processors", State::Pass);
        check(|machine| machine.cpus.clear(), "processors", State::Pass);
        check(|machine| machine.real_time = Err("no".into()), "real-time classes", State::Pass);
        check(|machine| machine.pidfd = Err("no".into()), "pidfd", State::Warn);
        check(|machine| machine.futex = Err("no".into()), "futex", State::Fail);
        check(|machine| machine.timer_slack = Err("no".into()), "timer slack", State::Warn);
        check(|machine| machine.clock_source = Some("hpet".into()), "clock source", State::Warn);
        check(|machine| machine.clock_source = None, "clock source", State::Pass);
        check(|machine| machine.schedstat = false, "scheduler statistics", State::Warn);
        check(|machine| machine.fleets_running = vec!["abc".into()], "fleets", State::Pass);
        check(|machine| machine.fleets_abandoned = vec!["abc".into()], "fleets", State::Warn);
    }

    #[test]
    fn the_findings_fit_a_narrow_page() {
        let mut machine = healthy();
        machine.futex = Err("Function not implemented (os error 38)".into());
        for width in [40, 80] {
            let mut page = Page::new(width);
            render(&mut page, &assess(&machine));
            let text = page.into_text();
            assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
            assert!(text.contains("FAIL  futex") && text.contains("hint: "), "{text}");
        }
    }

    #[test]
    fn this_machine_can_be_looked_at() {
        assert!(!assess(&super::super::probe()).is_empty());
    }
}
