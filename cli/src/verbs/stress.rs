//! `shoal stress`: a fleet that drives all the time, in real time, and whether this machine kept up.

mod fleet;

use crate::args::{Format, StressArgs};
use crate::exit::{self, Failure};
use crate::{out, run};
use bus::clean;
use daemon::supervisor::{self, Start};
use model::MAX_ROBOTS;
use report::text::{bytes_text, latency_lines, period_lines};
use report::{self, LatencyReport, Page, Report, Verdict};
use serde::Serialize;

/// The name and version of the format.
const SCHEMA: &str = "shoal.stress/1";

/// No scenario lasts longer.
const DURATION_S_MAX: f64 = 1e6;

/// What a fleet that drove all the time came to.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Stress {
    schema: &'static str,
    robots: usize,
    /// Periods per second that were asked for.
    tick_hz: f64,
    duration_s: f64,
    wall_time_s: f64,
    interrupted: bool,
    verdict: Verdict,
    starved_because: Vec<String>,
    impaired_because: Vec<String>,
    rate: Option<Rate>,
    latency: Option<LatencyReport>,
    resources: report::ResourcesReport,
    /// Processors that the fleet kept busy.
    cores_used: Option<f64>,
    /// What the fleet left behind: nothing.
    left_over: Vec<String>,
}

/// Periods per second that were done in time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Rate {
    /// Mean over the robots.
    mean_hz: f64,
    /// Of the robot with the fewest.
    min_hz: f64,
}

/// Runs it, prints how it went, and says how to exit.
///
/// # Errors
/// With exit code 2 when such a fleet cannot be, with 3 when the environment does not allow it.
pub fn run(options: &StressArgs) -> Result<i32, Failure> {
    if !(1..=MAX_ROBOTS).contains(&options.robots) {
        return Err(Failure::usage(format!(
            "`--robots {}`: the number of robots must be 1 to {MAX_ROBOTS}",
            options.robots
        ))
        .hint("`shoal stress --robots 64`"));
    }
    if !(1.0..=10_000.0).contains(&options.hz) {
        return Err(Failure::usage(format!("`--hz {}`: the rate must be 1 to 10000 Hz", options.hz))
            .hint("`shoal stress --hz 200`"));
    }
    if !(1.0 / options.hz..=DURATION_S_MAX).contains(&options.duration) {
        return Err(Failure::usage(format!(
            "`--duration {}s`: it lasts a period at least, and {DURATION_S_MAX} s at most",
            options.duration
        ))
        .hint("`shoal stress --duration 60s`"));
    }
    let scenario = fleet::scenario(options.robots, options.hz, options.duration)?;
    let mut terminal = run::Terminal::new(&scenario);
    let finished = supervisor::run(scenario, Start::default(), &mut terminal);
    terminal.finish();
    let finished = finished?.undisturbed()?;
    let left_over = clean::left_of(&finished.address);
    let report = report::assemble(run::facts_of(finished));
    let stress = Stress::of(&report, options, left_over);
    match options.format {
        Format::Json => out::measured(&stress)?,
        Format::Text => {
            let mut page = Page::new(out::stdout_width());
            stress.text(&mut page);
            out::data(&page.into_text())?;
        }
    }
    Ok(match (stress.interrupted, stress.left_over.is_empty()) {
        (true, _) => exit::INTERRUPTED,
        (false, true) => exit::OK,
        (false, false) => exit::EXPECTATIONS,
    })
}

impl Stress {
    fn of(report: &Report, options: &StressArgs, left_over: Vec<String>) -> Stress {
        let rates: Vec<f64> = (report.latency.iter().flat_map(|latency| &latency.measured.per_robot))
            .filter(|robot| robot.periods > 0)
            .map(|robot| {
                let missed = robot.deadline_misses.unwrap_or(0) as f64;
                report.tick_hz * (1.0 - missed / robot.periods as f64).max(0.0)
            })
            .collect();
        let rate = (rates.iter().copied().reduce(f64::min))
            .map(|min_hz| Rate { mean_hz: rates.iter().sum::<f64>() / rates.len() as f64, min_hz });
        let resources = report.resources.clone();
        Stress {
            schema: SCHEMA,
            robots: report.robots,
            tick_hz: report.tick_hz,
            duration_s: options.duration,
            wall_time_s: report.wall_time_s,
            interrupted: report.interrupted,
            verdict: report.verdict,
            starved_because: report.starved_because.clone(),
            impaired_because: report.impaired_because.clone(),
            rate,
            latency: report.latency.clone(),
            cores_used: resources.cpu_s.map(|cpu_s| cpu_s / report.wall_time_s).filter(|cores| cores.is_finite()),
            resources,
            left_over,
        }
    }

    fn text(&self, page: &mut Page) {
        let verdict = match self.verdict {
            Verdict::Valid => "valid: this machine kept up",
            Verdict::Starved => "starved: this machine did not keep up",
            Verdict::Impaired => "impaired: not every robot took part",
        };
        page.words(&format!("{verdict} with {} robots at {} Hz", self.robots, self.tick_hz), 2);
        for reason in self.impaired_because.iter().chain(&self.starved_because) {
            page.words(&format!("- {reason}"), 2);
        }
        page.gap();
        let how = if self.interrupted { ", interrupted" } else { "" };
        page.row("duration", &format!("{:.2} s{how}", self.wall_time_s));
        if let Some(Rate { mean_hz, min_hz }) = self.rate {
            page.row("rate held", &format!("{mean_hz:.2} Hz of {} (the worst robot {min_hz:.2})", self.tick_hz));
        }
        if let Some(latency) = &self.latency {
            period_lines(page, &latency.measured);
        }
        self.resources_text(page);
        if let Some(latency) = &self.latency {
            page.gap();
            latency_lines(page, "latency, us", &latency.measured.metrics);
        }
    }

    fn resources_text(&self, page: &mut Page) {
        let resources = &self.resources;
        if let (Some(cpu_s), Some(cores)) = (resources.cpu_s, self.cores_used) {
            page.row("processor", &format!("{cpu_s:.2} s, {:.1} % of one core", 100.0 * cores));
        }
        if let Some(share) = resources.run_queue_wait_max {
            page.row("waited", &format!("{:.2} % of the time for a processor, at most", 100.0 * share));
        }
        if let (Some(mean), Some(max)) = (resources.agent_pss_kib_mean, resources.agent_pss_kib_max) {
            page.row("agent memory", &format!("{mean:.0} KiB, at most {max} KiB (PSS)"));
        }
        if let Some(bytes) = resources.shm_bytes {
            page.row("shared memory", &bytes_text(bytes));
        }
        if let Some(startup_ms) = resources.startup_ms {
            page.row("startup", &format!("{startup_ms:.0} ms"));
        }
        let left_over = if self.left_over.is_empty() { "nothing".to_owned() } else { self.left_over.join(", ") };
        page.row("left over", &left_over);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::{Cause, Metric, Mode, PerCause};
    use report::{Blame, LatencyFacts, LoopLatency, Percentiles};

    fn stress(left_over: &[&str]) -> Stress {
        let scenario = fleet::scenario(2, 50.0, 10.0).unwrap();
        assert_eq!(scenario.clock.mode, Mode::Realtime);
        let mut report = report::assemble(report::RunFacts::new(scenario, Default::default(), 10.0));
        let of_robot = |missed| LoopLatency { periods: 500, deadline_misses: Some(missed), ..LoopLatency::default() };
        let age = Percentiles { p50: 10_000.0, p90: 18_000.0, p99: 19_500.0, p999: 21_000.0, max: 33_000.0, n: 1000 };
        let mut measured = LatencyFacts {
            periods: Some(1500),
            deadline_misses: Some(5),
            per_robot: vec![of_robot(0), of_robot(5)],
            ..LatencyFacts::default()
        };
        measured.metrics[Metric::PoseAge] = Some(age);
        let mut late = PerCause::default();
        (late[Cause::Scheduler], late[Cause::Neither]) = (8, 1);
        measured.blame = Some(Blame::of(late));
        report.latency = Some(LatencyReport { measured, ..LatencyReport::default() });
        report.resources.cpu_s = Some(0.5);
        report.resources.run_queue_wait_max = Some(0.002);
        report.resources.agent_pss_kib_mean = Some(1000.0);
        report.resources.agent_pss_kib_max = Some(1010);
        report.resources.shm_bytes = Some(1 << 20);
        report.starved_because = vec!["5 of 1500 periods were missed (0.333 %, more than 0.1 %)".to_owned()];
        report.verdict = Verdict::Starved;
        let options = StressArgs { robots: 2, duration: 10.0, hz: 50.0, format: Format::Text };
        Stress::of(&report, &options, left_over.iter().map(|&name| name.to_owned()).collect())
    }

    #[test]
    fn as_text() {
        let mut text = String::new();
        for (width, left_over) in [(80, &[][..]), (40, &["/dev/shm/shoal-0-abcd234", "process 4711"])] {
            let mut page = Page::new(width);
            stress(left_over).text(&mut page);
            let part = page.into_text();
            assert!(part.lines().all(|line| line.chars().count() <= width), "{part}");
            text += &part;
            text += "----\n";
        }
        insta::assert_snapshot!(text);
    }

    #[test]
    fn the_rate_held_is_that_of_periods_done_in_time() {
        let stress = stress(&[]);
        assert_eq!(stress.rate, Some(Rate { mean_hz: 49.75, min_hz: 49.5 }));
        assert_eq!((stress.cores_used, stress.verdict), (Some(0.05), Verdict::Starved));
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let check = |robots, hz, duration, words: &str| {
            let failure = run(&StressArgs { robots, duration, hz, format: Format::Text }).unwrap_err();
            assert_eq!(failure.code, exit::USAGE);
            let text = failure.to_string();
            assert!(text.contains(words) && text.contains("hint: "), "{text}");
        };
        check(0, 50.0, 1.0, "`--robots 0`");
        check(MAX_ROBOTS + 1, 50.0, 1.0, "must be 1 to 1024");
        check(3, 0.5, 1.0, "`--hz 0.5`");
        check(3, 20_000.0, 1.0, "`--hz 20000`");
        check(3, 50.0, 0.019, "`--duration 0.019s`");
        check(3, 50.0, 1e7, "`--duration 10000000s`");
    }
}
