//! `sweep`: many runs, and what they say together.

use super::Format;
use super::run::FilterArg;
use ::sweep::{Assertion, Varied};
use clap::{Args, ValueEnum};
use std::ffi::OsString;
use std::path::PathBuf;

/// A longer list of seeds is refused: with it alone the sweep has too many runs.
const SEEDS_MAX: u64 = ::sweep::plan::RUNS_MAX as u64;

/// `shoal sweep`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal sweep ring-15 corridor-swap --planner apf --planner amr-apf --out rings
  shoal sweep my.toml --seeds 0..20 --vary radio.drop=0,0.1,0.2 --out loss
  shoal sweep ring-15 --planner rpoa --planner apf --baseline apf
  shoal sweep my.toml --planner apf --planner rpoa --assert 'success>=0.95' \\
    --assert 'apf:contacts==0'

Every combination of scenario, planner, varied values and seed is a run. A run
succeeds if all robots arrive and nothing touches. The summary has the share of
successes, the median makespan and, with --baseline, the ratio to it with the
same seeds; then the command that repeats each run that failed.

DIR gets runs.jsonl, summary.json, summary.txt, sweep.db (SQLite) and a box plot
for each scenario. The same command with the same DIR resumes a sweep that was
interrupted or killed: runs that have ended are not repeated.

An assertion is [PLANNER:]METRIC OP NUMBER and is checked for every row of the
summary. Metrics: success, arrival, contacts, robot_contacts, obstacle_contacts,
makespan, makespan_ratio, path_ratio, time_lost, throughput, clearance, ldj,
reversals_per_m, deadlocked, livelocked, oscillating. Exit code 1: an assertion
does not hold. Without assertions, runs that failed do not change the exit code.")]
pub struct SweepArgs {
    /// Scenario files, or names from the catalog
    #[arg(value_name = "SCENARIO", required = true)]
    pub scenarios: Vec<OsString>,
    /// Planners of every robot: lanes,orca; may be repeated. By default the scenario's own
    #[arg(long = "planner", value_name = "NAME,..", value_delimiter = ',')]
    pub planners: Vec<String>,
    /// Random seeds: 0..20 are the 20 seeds from 0 to 19; or a list, 1,2,5
    #[arg(long, value_name = "SEEDS", default_value = "0..5", value_parser = parse_seeds)]
    pub seeds: Seeds,
    /// Set a key of all scenarios, as in clock.tick_hz=100; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Run with each of these values of a key; may be repeated
    #[arg(long = "vary", value_name = "KEY=A,B,..", value_parser = Varied::parse)]
    pub varied: Vec<Varied>,
    /// Run with each of these filters: none, shared-gap; the same as --vary defaults.filter
    #[arg(long = "filter", value_name = "FILTER", value_delimiter = ',')]
    pub filters: Vec<FilterArg>,
    /// Compare the makespans with those of this planner
    #[arg(long, value_name = "PLANNER")]
    pub baseline: Option<String>,
    /// Condition on the summary, as in success>=0.95; may be repeated
    #[arg(long = "assert", value_name = "EXPR", value_parser = Assertion::parse)]
    pub assertions: Vec<Assertion>,
    /// Clock mode
    #[arg(long, value_name = "MODE", default_value = "single")]
    pub mode: SweepMode,
    /// Runs at a time; by default the number of processors
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Directory for the results; without it nothing is kept
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// How the runs of a sweep keep time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SweepMode {
    /// Each fleet in one thread: fast
    Single,
    /// One process per robot, tick by tick: the same results
    Lockstep,
}

impl From<SweepMode> for model::Mode {
    fn from(mode: SweepMode) -> model::Mode {
        match mode {
            SweepMode::Single => model::Mode::Single,
            SweepMode::Lockstep => model::Mode::Lockstep,
        }
    }
}

/// Random seeds, in the order in which they were given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seeds(pub Vec<u64>);

/// Seeds as people write them: `0..20`, without the last one, `0..=19`, with it, and lists of numbers and ranges.
pub fn parse_seeds(text: &str) -> Result<Seeds, String> {
    let wrong = || format!("`{text}` is not a list of seeds; write 0..20 or 1,2,5");
    // SQLite has no larger numbers.
    let number = |text: &str| text.trim().parse().ok().filter(|seed: &u64| *seed <= i64::MAX as u64).ok_or_else(wrong);
    let mut seeds = Vec::new();
    for part in text.split(',') {
        let (first, end) = match part.split_once("..") {
            Some((first, last)) => match last.strip_prefix('=') {
                Some(last) => (number(first)?, number(last)? + 1),
                None => (number(first)?, number(last)?),
            },
            None => (number(part)?, number(part)? + 1),
        };
        if first >= end {
            return Err(format!("`{part}` has no seed: a range ends before its second number, as in 0..20"));
        }
        if end - first > SEEDS_MAX - seeds.len() as u64 {
            return Err(format!("`{text}` has more than {SEEDS_MAX} seeds"));
        }
        seeds.extend(first..end);
    }
    Ok(Seeds(seeds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds() {
        let check =
            |text: &str, expected: &[u64]| assert_eq!(parse_seeds(text), Ok(Seeds(expected.to_vec())), "{text}");
        check("0..3", &[0, 1, 2]);
        check("0..=3", &[0, 1, 2, 3]);
        check("7", &[7]);
        check(" 1, 2 ,5", &[1, 2, 5]);
        check("1,10..12", &[1, 10, 11]);
        assert_eq!(parse_seeds("0..100000").map(|seeds| seeds.0.len()), Ok(100_000));
        for wrong in
            ["", "a", "-1", "1,,2", "3..3", "5..3", "0..", "..5", "0..100001", "0..18446744073709551615", "1..2..3"]
        {
            assert!(parse_seeds(wrong).is_err(), "{wrong}");
        }
    }
}
