//! `shoal bench loop`: a tick of `lockstep` beside a round of a bare barrier.
//!
//! Fleet and barrier live at the same time and take turns: the world is stopped while the barrier is measured, and
//! nobody opens the barrier while the fleet runs. So what disturbs one disturbs the other.

use super::crew::{Crew, ran_us};
use super::figures::{Beside, Document, code, median, quantile, short};
use super::scene::Scene;
use crate::args::BenchLoopArgs;
use crate::exit::{self, Failure};
use crate::out;
use crate::progress::Bar;
use bus::{Gate, clock};
use daemon::coordinator::News;
use daemon::signals::Interrupted;
use daemon::supervisor::{self, FleetView, Start, Watch};
use model::Metric;
use report::Column;
use rustix::process::{Pid, Signal, kill_process};
use serde::Serialize;

/// Least number of turns, after one that only warms up.
const TURNS_MIN: u64 = 20;
/// A fleet that makes no tick for this long is not waited for.
const PATIENCE_NS: u64 = 5_000_000_000;

#[derive(Serialize)]
struct Row {
    robots: usize,
    planner: &'static str,
    obstacles: usize,
    /// Ticks that were timed.
    ticks: usize,
    turns: usize,
    /// Neighbours that a robot heard in a tick, on average.
    neighbors_mean: f64,
    /// Median length of a tick, us.
    p50_us: Beside,
    /// 99 of 100 ticks take at most, us. The ratio is of all ticks together.
    p99_us: Beside,
    /// Mean length of a tick, us.
    mean_us: Beside,
    /// Time on a processor, of all processes together and per tick, us.
    cpu_us: Beside,
    /// The ratio of the medians in every tenth of the run.
    ratio_by_tenth: Vec<f64>,
    /// Times that a process gave its processor away or lost it, per robot and tick.
    switches: f64,
    /// Memory of all processes that is resident, KiB, after the first turn and after the last.
    resident_kib: [u64; 2],
    /// The most that one of them grew by, KiB.
    grown_kib_max: i64,
    /// Open files of all processes, after the first turn and after the last.
    files: [u64; 2],
}

pub(super) fn run(options: &BenchLoopArgs) -> Result<i32, Failure> {
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    let mut rows = Vec::new();
    for &robots in &options.robots {
        for (planner, obstacles) in [("straight", false), ("decentralized-apf", true)] {
            if interrupted.yes() || options.planner.as_ref().is_some_and(|only| only != planner) {
                continue;
            }
            out::talk(&format!("{robots} robots, {planner}: {} ticks", options.ticks));
            rows.extend(duel(robots, planner, obstacles, options.ticks, &interrupted)?);
        }
    }
    let document = Document::new("shoal.bench-loop/1", rows, &interrupted);
    let columns = [
        Column::right("robots", 0),
        Column::left("planner", 4, 20),
        Column::right("p50 us", 0),
        Column::right("bare", 0),
        Column::right("ratio", 0),
        Column::right("p99 us", 1),
        Column::right("bare", 1),
        Column::right("ratio", 1),
        Column::right("mean", 2),
        Column::right("cpu", 2),
        Column::right("neighbours", 3),
        Column::right("drift %", 5),
    ];
    let cells = |row: &Row| {
        let figures = [row.p50_us.fleet, row.p50_us.bare, row.p50_us.ratio];
        let late = [
            row.p99_us.fleet,
            row.p99_us.bare,
            row.p99_us.ratio,
            row.mean_us.ratio,
            row.cpu_us.ratio,
            row.neighbors_mean,
        ];
        let drift = match row.ratio_by_tenth.as_slice() {
            [first, .., last] => format!("{:+.1}", 100.0 * (last / first - 1.0)),
            _ => String::new(),
        };
        [row.robots.to_string(), row.planner.to_owned()]
            .into_iter()
            .chain(figures.into_iter().chain(late).map(short))
            .chain([drift])
            .collect()
    };
    document.print(
        options.format,
        &columns,
        cells,
        &[
            "Length of a tick, beside that of a round of as many bare processes at a futex barrier; `mean` is the ratio \
             of the mean lengths, `cpu` that of the processor time of all processes, `drift` the change of the ratio of the medians from the first tenth of the run to \
             the last.",
        ],
    )?;
    Ok(code(&interrupted))
}

fn duel(
    robots: usize,
    planner: &'static str,
    obstacles: bool,
    ticks: u64,
    interrupted: &Interrupted,
) -> Result<Option<Row>, Failure> {
    let tick_hz = 1000.0;
    let scene = Scene { robots, mode: "lockstep", planner, obstacles, parked: false, tick_hz, duration_s: 1e6 };
    let scenario = scene.scenario()?;
    let turn = (ticks / TURNS_MIN).clamp(1, Gate::TRACED * 3 / 4);
    let crew = Crew::start(robots)?;
    let turns = ticks.div_ceil(turn) + 1;
    let mut duel = Duel {
        crew,
        bar: Bar::on_terminal(),
        what: format!("{robots} robots, {planner}"),
        turns_all: turns,
        interrupted,
        turn,
        turns,
        fleet: None,
        seen: 0,
        measured: Vec::new(),
        held: Vec::new(),
        failure: None,
    };
    let finished = supervisor::run(scenario, Start::default(), &mut duel);
    duel.bar.finish();
    let finished = finished?.undisturbed()?;
    if let Some(failure) = duel.failure {
        return Err(failure);
    }
    let agents = finished.stats.iter().filter(|(name, _)| name != bus::stats::WORLD);
    let mut stats = bus::StatsSnapshot::default();
    agents.for_each(|(_, snapshot)| stats.merge(snapshot));
    // Both are counted in the same ticks.
    let count = |metric| stats.percentiles(metric).map_or(0, |times| times.n);
    let neighbors_mean = count(Metric::PoseAge) as f64 / count(Metric::Step).max(1) as f64;
    Ok(duel_row(&scene, obstacles, neighbors_mean, &mut duel.measured, &duel.held))
}

/// What the turns come to; nothing, if there was none.
fn duel_row(
    scene: &Scene,
    obstacles: bool,
    neighbors_mean: f64,
    turns: &mut [Turn],
    held: &[Vec<Held>],
) -> Option<Row> {
    let count = turns.len();
    let ticks: usize = turns.iter().map(|turn| turn.lengths[0].len()).sum();
    let mean = |values: &Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let means: Vec<(f64, f64)> =
        turns.iter().map(|Turn { lengths: [fleet, bare], .. }| (mean(fleet), mean(bare))).collect();
    let cpu: Vec<(f64, f64)> = turns.iter().map(|turn| turn.cpu_us).collect();
    let medians: Vec<(f64, f64)> =
        turns.iter_mut().map(|Turn { lengths: [fleet, bare], .. }| (median(fleet), median(bare))).collect();
    let mut all = |side: usize| {
        let mut lengths: Vec<f64> = turns.iter_mut().flat_map(|turn| std::mem::take(&mut turn.lengths[side])).collect();
        quantile(&mut lengths, 0.99)
    };
    let (fleet, bare) = (all(0), all(1));
    let tenths = if count >= 10 { 10 } else { 1 };
    let tenth = |i: usize| Beside::of(&medians[count * i / tenths..count * (i + 1) / tenths]).ratio;
    let (first, last): (&[Held], &[Held]) = (held.first()?, held.last()?);
    let sum = |held: &[Held], pick: fn(&Held) -> u64| held.iter().map(pick).sum::<u64>();
    let switches = sum(last, |held| held.switches).saturating_sub(sum(first, |held| held.switches));
    let grown = first.iter().zip(last.iter()).map(|(first, last)| last.resident_kib as i64 - first.resident_kib as i64);
    // From the first look to the last: its ticks are those of all measured turns, and a few between.
    let robot_ticks = (scene.robots * ticks).max(1);
    Some(Row {
        robots: scene.robots,
        planner: scene.planner,
        obstacles: if obstacles { 10 } else { 0 },
        ticks,
        turns: count,
        neighbors_mean,
        p50_us: Beside::of(&medians),
        p99_us: Beside { fleet, bare, ratio: fleet / bare },
        mean_us: Beside::of(&means),
        cpu_us: Beside::of(&cpu),
        ratio_by_tenth: (0..tenths).map(tenth).collect(),
        switches: switches as f64 / robot_ticks as f64,
        resident_kib: [first, last].map(|held| sum(held, |held| held.resident_kib)),
        grown_kib_max: grown.max().unwrap_or(0),
        files: [first, last].map(|held| sum(held, |held| held.files)),
    })
}

/// What was measured in one turn of the fleet, and in the barrier's that followed.
#[derive(Clone, Debug, Default)]
struct Turn {
    /// Lengths of the ticks and of the rounds, us.
    lengths: [Vec<f64>; 2],
    /// Time on a processor per tick and per round, us.
    cpu_us: (f64, f64),
}

/// Takes turns with a fleet.
struct Duel<'a> {
    crew: Crew,
    interrupted: &'a Interrupted,
    /// Ticks of a turn.
    turn: u64,
    /// Turns to come.
    turns: u64,
    /// All turns.
    turns_all: u64,
    /// How far it is, and with what.
    bar: Bar,
    what: String,
    fleet: Option<Fleet>,
    /// The newest tick when the fleet was last stopped.
    seen: u64,
    measured: Vec<Turn>,
    held: Vec<Vec<Held>>,
    failure: Option<Failure>,
}

struct Fleet {
    gate: Gate,
    world: Pid,
    pids: Vec<u32>,
}

impl Watch for Duel<'_> {
    fn started(&mut self, view: &FleetView<'_>) {
        let (Ok(gate), Some(&pid)) = (Gate::open(view.address), view.pids.first()) else { return };
        let Some(world) = Pid::from_raw(pid as i32) else { return };
        self.fleet = Some(Fleet { gate, world, pids: view.pids.to_vec() });
    }

    fn progress(&mut self, _: &bus::Progress, _: f64) {
        if !self.enough() {
            self.failure = self.take_turns().err();
            self.bar.at(self.turns_all - self.turns, self.turns_all, &self.what);
        }
        // A world that is to end must not be stopped.
        if let Some(fleet) = self.fleet.as_ref().filter(|_| self.enough()) {
            let _ = kill_process(fleet.world, Signal::CONT);
        }
    }

    fn say(&mut self, line: &str) {
        self.bar.finish();
        out::talk(line);
    }

    fn news(&mut self, kind: News, line: &str) {
        // That it stops the world is what this bench does.
        if ![News::WorldStopped, News::WorldGoesOn].contains(&kind) {
            self.bar.finish();
            out::talk(line);
        }
    }

    fn enough(&self) -> bool {
        self.turns == 0 || self.interrupted.yes() || self.failure.is_some()
    }
}

impl Duel<'_> {
    /// One turn of the fleet, one of the barrier.
    fn take_turns(&mut self) -> Result<(), Failure> {
        let Some(fleet) = &self.fleet else { return Ok(()) };
        let until = self.seen + self.turn + 1;
        let ran_before_us = fleet.ran_us();
        let Some(newest) = fleet.run_to(until) else { return Ok(()) };
        let ran_us = fleet.ran_us() - ran_before_us;
        let went = newest.saturating_sub(self.seen).max(1);
        let first = (self.seen + 1).max((newest + 2).saturating_sub(Gate::TRACED));
        let ticks: Vec<f64> = (first..newest)
            .map(|tick| fleet.gate.opened_ns(tick + 1).saturating_sub(fleet.gate.opened_ns(tick)) as f64 * 1e-3)
            .collect();
        self.seen = newest;
        self.turns -= 1;
        let bare_before_us = self.crew.ran_us();
        let rounds = self.crew.rounds(ticks.len())?;
        let bare_us = (self.crew.ran_us() - bare_before_us) / rounds.len().max(1) as f64;
        let turn = Turn { lengths: [ticks, rounds], cpu_us: (ran_us / went as f64, bare_us) };
        // The first turn warms up.
        if self.held.is_empty() {
            self.held.push(fleet.held());
        } else {
            self.measured.push(turn);
            if self.turns == 0 {
                self.held.push(fleet.held());
            }
        }
        Ok(())
    }
}

impl Fleet {
    /// Lets the fleet run until about this tick, and stops it. The newest tick then; `None` if it does not get there.
    fn run_to(&self, tick: u64) -> Option<u64> {
        let (begin_ns, begin) = (clock::now_ns(), self.gate.newest_tick()?);
        kill_process(self.world, Signal::CONT).ok()?;
        let (mut moved_ns, mut before) = (begin_ns, begin);
        loop {
            let (now_ns, newest) = (clock::now_ns(), self.gate.newest_tick()?);
            if newest >= tick {
                break;
            }
            if newest > before {
                (moved_ns, before) = (now_ns, newest);
            } else if now_ns > moved_ns + PATIENCE_NS {
                return None;
            }
            // As long as it seems to take: looking costs the fleet something, too.
            let pace_ns = (now_ns - begin_ns).max(20_000) / (newest - begin).max(1);
            clock::sleep_until_ns(now_ns + (pace_ns * (tick - newest)).clamp(100_000, 50_000_000));
        }
        kill_process(self.world, Signal::STOP).ok()?;
        while state_of(self.world)? != 'T' {
            clock::sleep_until_ns(clock::now_ns() + 100_000);
        }
        self.gate.newest_tick()
    }

    fn ran_us(&self) -> f64 {
        ran_us(self.pids.iter().copied())
    }

    fn held(&self) -> Vec<Held> {
        self.pids.iter().map(|pid| Held::by(*pid)).collect()
    }
}

/// What a process holds and has done.
#[derive(Clone, Copy, Debug, Default)]
struct Held {
    resident_kib: u64,
    files: u64,
    switches: u64,
}

impl Held {
    fn by(pid: u32) -> Held {
        #[expect(clippy::disallowed_methods, reason = "the kernel's own account of a process")]
        let text = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
        let number = |key: &str| -> u64 {
            let line = text.lines().find_map(|line| line.strip_prefix(key));
            line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
        };
        Held {
            resident_kib: number("VmRSS:"),
            files: std::fs::read_dir(format!("/proc/{pid}/fd")).map_or(0, |entries| entries.count() as u64),
            switches: number("voluntary_ctxt_switches:") + number("nonvoluntary_ctxt_switches:"),
        }
    }
}

/// The letter that the kernel gives the state of a process; `None` if it is gone.
fn state_of(pid: Pid) -> Option<char> {
    #[expect(clippy::disallowed_methods, reason = "the kernel's own account of a process")]
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", pid.as_raw_pid())).ok()?;
    stat.rsplit_once(')')?.1.trim_start().chars().next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_become_a_row() {
        let scene = Scene {
            robots: 2,
            mode: "lockstep",
            planner: "straight",
            obstacles: false,
            parked: false,
            tick_hz: 1000.0,
            duration_s: 1.0,
        };
        let turn = |i: u32| Turn {
            lengths: [vec![12.0 + f64::from(i / 18), 12.0, 30.0], vec![10.0, 8.0, 10.0]],
            cpu_us: (6.0, 4.0),
        };
        let mut turns: Vec<Turn> = (0..20).map(turn).collect();
        let held = |kib, switches| vec![Held { resident_kib: kib, files: 5, switches }; 3];
        let row = duel_row(&scene, false, 4.0, &mut turns, &[held(100, 0), held(101, 80)]).unwrap();
        assert_eq!((row.ticks, row.turns), (60, 20));
        assert_eq!(row.p50_us, Beside { fleet: 12.0, bare: 10.0, ratio: 1.2 });
        assert_eq!(row.p99_us, Beside { fleet: 30.0, bare: 10.0, ratio: 3.0 });
        assert_eq!(row.cpu_us, Beside { fleet: 6.0, bare: 4.0, ratio: 1.5 });
        assert_eq!(row.ratio_by_tenth, [[1.2; 9].as_slice(), &[1.3]].concat());
        assert_eq!((row.switches, row.grown_kib_max, row.files), (2.0, 1, [15, 15]));
        assert!(duel_row(&scene, false, 4.0, &mut [], &[]).is_none(), "no turn, no row");
    }

    #[test]
    fn a_process_has_a_state() {
        assert!(state_of(rustix::process::getpid()).is_some_and(|state| "RS".contains(state)));
        assert!(Held::by(std::process::id()).resident_kib > 0);
    }
}
