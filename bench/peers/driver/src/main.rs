//! The same loop over several transports, as processes: starts them, measures, prints one table.

mod fleet;
mod peers;
mod prepare;
mod process;
mod table;

use clap::{Parser, ValueEnum};
use fleet::Stop;
use peers::{PEERS, Peer, Tools};
use serde_json::json;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::collections::BTreeMap;
use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use table::{Block, Row};

/// A peer that loses more than this is not tried with more robots, percent.
const LOST_PERCENT_MAX: f64 = 50.0;

/// The same poses loop (N processes at 50 Hz, 64-byte poses, everybody reads everybody) over several transports.
#[derive(Parser, Debug)]
#[command(name = "bench/peers/run")]
struct Options {
    /// Only these, comma-separated: shoal, iceoryx2, datagram, zenoh, zenoh-shm, dora
    #[arg(long, value_name = "PEER,...", value_delimiter = ',', value_parser = peer)]
    only: Vec<&'static Peer>,
    /// Numbers of robots, comma-separated
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "2,15,30,64,128",
          value_parser = clap::value_parser!(u16).range(2..=1024))]
    n: Vec<u16>,
    /// Seconds that are recorded of each run
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=600))]
    seconds: u64,
    /// Repetitions; medians over them are printed
    #[arg(long, value_name = "R", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=99))]
    repetitions: u32,
    /// What is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
}

fn peer(name: &str) -> Result<&'static Peer, String> {
    let known = || PEERS.map(|peer| peer.name).join(", ");
    peers::of(name).ok_or_else(|| format!("known peers: {}", known()))
}

fn main() -> ExitCode {
    let options = Options::parse();
    let interrupted = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        if let Err(e) = signal_hook::flag::register(signal, Arc::clone(&interrupted)) {
            eprintln!("error: signal {signal}: {e}");
            return ExitCode::FAILURE;
        }
    }
    process::remove_abandoned();
    raise_open_files();
    match measure_all(&options, &interrupted) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Stop::Interrupted) => {
            eprintln!("interrupted; nothing is left of it");
            ExitCode::from(130)
        }
        Err(Stop::Failed(cause)) => {
            eprintln!("error: {cause}");
            ExitCode::FAILURE
        }
    }
}

fn measure_all(options: &Options, interrupted: &AtomicBool) -> Result<(), Stop> {
    let executable = std::env::current_exe()?;
    let executables = executable.parent().unwrap_or(&executable).to_path_buf();
    let tools = Tools { executables };
    let chosen: Vec<&Peer> = if options.only.is_empty() { PEERS.iter().collect() } else { options.only.clone() };

    // Why a peer is not run (any more).
    let mut out: BTreeMap<&str, String> = BTreeMap::new();
    for peer in &chosen {
        eprintln!("building {}", peer.name);
        if let Err(cause) = prepare::prepare(peer, &tools) {
            eprintln!("{}: {cause}", peer.name);
            out.insert(peer.name, format!("cannot be built: {cause}"));
        }
        if interrupted.load(Relaxed) {
            return Err(Stop::Interrupted);
        }
    }

    let head = Head::new(options, &chosen, &tools);
    let mut blocks = Vec::new();
    if options.format == Format::Text {
        print(&head.text())?;
    }
    let mut number = 0;
    for &robots in &options.n {
        let robots = usize::from(robots);
        let row = |peer: &&Peer| Row { peer: peer.name, runs: Vec::new(), failure: out.get(peer.name).cloned() };
        let mut rows: Vec<Row> = chosen.iter().map(row).collect();
        for repetition in 0..options.repetitions {
            for place in 0..chosen.len() {
                let which = (place + repetition as usize) % chosen.len();
                let (peer, row) = (chosen[which], &mut rows[which]);
                if row.failure.is_some() {
                    continue;
                }
                eprintln!("N = {robots}, repetition {} of {}: {}", repetition + 1, options.repetitions, peer.name);
                number += 1;
                let ticks = options.seconds * poses::RATE_HZ;
                match fleet::run(peer, &tools, robots, ticks, number, interrupted) {
                    Ok(measured) => row.runs.push(measured),
                    Err(Stop::Failed(cause)) => {
                        eprintln!("{}: {cause}", peer.name);
                        row.failure = Some(cause);
                    }
                    Err(Stop::Interrupted) => return Err(Stop::Interrupted),
                }
            }
        }
        for row in &rows {
            let lost = row.lost_percent();
            if lost > LOST_PERCENT_MAX {
                out.entry(row.peer).or_insert(format!("not tried: it lost {lost:.0} % at N = {robots}"));
            } else if row.failure.is_some() {
                out.entry(row.peer).or_insert(format!("not tried: it did not work with N = {robots}"));
            }
        }
        let block = Block { robots, rows };
        if options.format == Format::Text {
            print(&format!("\n{}", block.text()))?;
        }
        blocks.push(block);
    }
    if options.format == Format::Json {
        let blocks: Vec<_> = blocks.iter().map(Block::json).collect();
        let mut all = head.json();
        all["load_average_after"] = json!(load_average());
        all["results"] = json!(blocks);
        print(&format!("{all:#}\n"))?;
    } else {
        print(&format!("\nload average: {} at the start, {} at the end\n", head.load_average, load_average()))?;
    }
    Ok(())
}

/// What the figures depend on.
struct Head {
    machine: String,
    load_average: String,
    command: String,
    peers: Vec<(&'static str, String, &'static str, Vec<String>)>,
}

impl Head {
    fn new(options: &Options, chosen: &[&Peer], tools: &Tools) -> Head {
        let uname = rustix::system::uname();
        let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = cpuinfo.lines().find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1));
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let n = options.n.iter().map(u16::to_string).collect::<Vec<_>>().join(",");
        let names = chosen.iter().map(|peer| peer.name).collect::<Vec<_>>().join(",");
        Head {
            machine: format!(
                "{cores} cores ({}), Linux {}",
                model.unwrap_or("of an unknown model"),
                uname.release().to_string_lossy()
            ),
            load_average: load_average(),
            command: format!(
                "bench/peers/run --only {names} --n {n} --seconds {} --repetitions {}",
                options.seconds, options.repetitions
            ),
            peers: chosen
                .iter()
                .map(|peer| {
                    let find = PEERS.iter().find(|known| known.name == peer.name).expect("it is one of them");
                    (find.name, find.version(), find.receives, find.command_lines(tools))
                })
                .collect(),
        }
    }

    fn text(&self) -> String {
        let mut text = format!("{}\n{}\n\n", self.command, self.machine);
        for (name, version, receives, commands) in &self.peers {
            text += &format!("{name:<11}{version}; {receives}\n");
            for command in commands {
                text += &format!("{:<11}  {command}\n", "");
            }
        }
        text + "\n(robot I of N, run directory DIR; poses are 64 bytes at 50 Hz, everybody reads everybody's newest)\n"
    }

    fn json(&self) -> serde_json::Value {
        let peers = self.peers.iter().map(|(name, version, receives, commands)| {
            json!({ "peer": name, "version": version, "receives": receives, "command_lines": commands })
        });
        json!({
            "schema": "shoal.peers/1",
            "command": self.command,
            "machine": self.machine,
            "load_average_before": self.load_average,
            "peers": peers.collect::<Vec<_>>(),
        })
    }
}

fn load_average() -> String {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().unwrap_or("unknown").to_owned()
}

/// Everybody reading everybody takes many files: as many as are allowed.
fn raise_open_files() {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = getrlimit(Resource::Nofile);
    let _ = setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, maximum: limit.maximum });
}

fn print(text: &str) -> Result<(), Stop> {
    let mut stdout = std::io::stdout().lock();
    Ok(stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush())?)
}
