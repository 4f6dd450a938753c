//! `shoal bench startup`: how long a fleet takes from the first spawn to the first tick, beside as many bare processes
//! to their first barrier; and one more robot, from the request until it hears all its neighbours.

use super::crew::Crew;
use super::figures::{Beside, Document, code, short};
use super::scene::Scene;
use crate::args::BenchStartupArgs;
use crate::exit::{self, Failure};
use crate::out;
use crate::progress::Bar;
use crate::verbs::fleet;
use bus::{Address, Gate, clock};
use daemon::coordinator::News;
use daemon::signals::Interrupted;
use daemon::supervisor::{self, FleetView, Start, Watch};
use model::RobotInstance;
use protocol::operator_to_daemon::{NewRobot, Reply, Request};
use report::Column;
use serde::Serialize;
use std::thread::JoinHandle;
use std::time::Duration;

/// How long a robot may take to join.
const PATIENCE: Duration = Duration::from_secs(20);

#[derive(Serialize)]
struct Row {
    robots: usize,
    repetitions: usize,
    /// From the first spawn to the first tick, and of the bare processes to their first barrier, ms.
    startup_ms: Beside,
    /// From the request for one more robot until it hears all its neighbours, and one bare process from its spawn until
    /// it has gone through a barrier, ms.
    join_ms: Beside,
    /// How many neighbours that are.
    neighbors: usize,
    /// Rate of the fleet that the robot joined, Hz.
    rate_hz: f64,
    /// Memory of an agent (proportional share), KiB: the mean, and the most.
    pss_kib: Option<[f64; 2]>,
}

pub(super) fn run(options: &BenchStartupArgs) -> Result<i32, Failure> {
    let interrupted = Interrupted::watch(exit::INTERRUPTED)?;
    let mut rows = Vec::new();
    for &robots in &options.robots {
        if !interrupted.yes() {
            out::talk(&format!("{robots} robots: {} starts", options.repetitions));
            rows.extend(measure(robots, options.repetitions, &interrupted)?);
        }
    }
    let document = Document::new("shoal.bench-startup/1", rows, &interrupted);
    let columns = [
        Column::right("robots", 0),
        Column::right("start ms", 0),
        Column::right("bare", 0),
        Column::right("ratio", 0),
        Column::right("join ms", 1),
        Column::right("bare", 1),
        Column::right("ratio", 1),
        Column::right("Hz", 1),
        Column::right("neighbours", 2),
        Column::right("PSS KiB", 3),
    ];
    let cells = |row: &Row| {
        let (start, join) = (row.startup_ms, row.join_ms);
        std::iter::once(row.robots.to_string())
            .chain([start.fleet, start.bare, start.ratio, join.fleet, join.bare, join.ratio, row.rate_hz].map(short))
            .chain([row.neighbors.to_string(), row.pss_kib.map_or(String::new(), |[mean, _]| format!("{mean:.0}"))])
            .collect()
    };
    document.print(
        options.format,
        &columns,
        cells,
        &["From the first spawn to the first tick, beside as many bare processes to their first barrier; and one \
             more robot in a `realtime` fleet at that rate, from the request until it hears all its neighbours, beside \
             one bare process. Medians."],
    )?;
    Ok(code(&interrupted))
}

fn measure(robots: usize, repetitions: u32, interrupted: &Interrupted) -> Result<Option<Row>, Failure> {
    let tick_hz = 50.0;
    let scene = Scene {
        robots,
        mode: "realtime",
        planner: "straight",
        obstacles: false,
        parked: true,
        tick_hz,
        duration_s: 60.0,
    };
    let scenario = scene.scenario()?;
    let neighbors = Scene::in_range(&scenario, scene.place());
    let (mut starts, mut joins, mut pss) = (Vec::new(), Vec::new(), Vec::new());
    let (mut bar, what) = (Bar::on_terminal(), format!("{robots} robots"));
    for done in 0..repetitions {
        bar.at(done.into(), repetitions.into(), &what);
        let mut guest = Guest { scene, neighbors, joining: None, interrupted };
        let finished = supervisor::run(scenario.clone(), Start::default(), &mut guest)?.undisturbed()?;
        let joined = guest.joining.take().and_then(|thread| thread.join().ok());
        if interrupted.yes() {
            break;
        }
        let Some(joined) = joined else { continue };
        pss.extend(finished.processes.iter().filter_map(|(instance, _, used)| instance.and(used.pss_kib)));
        let startup_ms = finished.startup_ms.unwrap_or_default();
        // One at a time: a barrier has two sides at least.
        let (crew, one) = (Crew::start(robots + 1)?, Crew::start(1)?);
        starts.push((startup_ms, crew.startup_ms));
        joins.push((joined?, one.startup_ms));
    }
    let pss_kib = (!pss.is_empty()).then(|| {
        let mean = pss.iter().sum::<u64>() as f64 / pss.len() as f64;
        [mean, pss.iter().copied().max().unwrap_or(0) as f64]
    });
    Ok((!starts.is_empty()).then(|| Row {
        robots,
        repetitions: starts.len(),
        startup_ms: Beside::of(&starts),
        join_ms: Beside::of(&joins),
        neighbors,
        rate_hz: tick_hz,
        pss_kib,
    }))
}

/// Sends one more robot into a fleet that has just begun, and ends the run when it has settled in.
struct Guest<'a> {
    scene: Scene,
    neighbors: usize,
    joining: Option<JoinHandle<Result<f64, Failure>>>,
    interrupted: &'a Interrupted,
}

impl Watch for Guest<'_> {
    fn started(&mut self, view: &FleetView<'_>) {
        let (address, place, neighbors) = (view.address.clone(), self.scene.place(), self.neighbors);
        #[expect(clippy::disallowed_methods, reason = "the daemon, which is this thread, has to answer the request")]
        let joining = std::thread::spawn(move || join(&address, place, neighbors));
        self.joining = Some(joining);
    }

    fn progress(&mut self, _: &bus::Progress, _: f64) {}

    fn say(&mut self, _: &str) {}
    fn news(&mut self, _: News, _: &str) {}

    fn enough(&self) -> bool {
        self.interrupted.yes() || self.joining.as_ref().is_some_and(JoinHandle::is_finished)
    }
}

/// How long it took, ms.
fn join(address: &Address, place: [f64; 2], neighbors: usize) -> Result<f64, Failure> {
    let gate = Gate::open(address)?;
    // The fleet is to have settled in.
    clock::sleep_until_ns(clock::now_ns() + 300_000_000);
    let asked_ns = clock::now_ns();
    let robot = NewRobot { start_m: place, goal_m: place, ..NewRobot::default() };
    let index = match fleet::ask(address, &Request::Add(robot))? {
        Reply::Joined { index, .. } => index,
        reply => return Err(fleet::confused(&reply)),
    };
    let instance = RobotInstance { index, incarnation: 0 };
    loop {
        let now_ns = clock::now_ns();
        if gate.heard(instance) >= neighbors {
            return Ok(now_ns.saturating_sub(asked_ns) as f64 * 1e-6);
        }
        if gate.stopped() || now_ns > asked_ns + PATIENCE.as_nanos() as u64 {
            return Err(Failure::environment(format!(
                "bench: the robot that joined heard {} of {neighbors} neighbours",
                gate.heard(instance)
            ))
            .hint("is the machine busy? try again"));
        }
        clock::sleep_until_ns(now_ns + 200_000);
    }
}
