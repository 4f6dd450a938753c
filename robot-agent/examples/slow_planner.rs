//! An agent for tests: it steers as its scenario says, but takes its time: `SHOAL_PLAN_MS` milliseconds a call (default
//! 0), in which it does nothing.

use planners::{Plan, PlanInput, Planner};
use robot_agent::agent::planner_of;
use robot_agent::shell::{self, Args};
use std::io::Write;
use std::process::ExitCode;
use std::time::Duration;

struct Slow {
    inner: Box<dyn Planner>,
    takes: Duration,
}

impl Planner for Slow {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        #[expect(clippy::disallowed_methods, reason = "being slow is what it is for")]
        std::thread::sleep(self.takes);
        self.inner.plan(input)
    }
}

fn main() -> ExitCode {
    #[expect(clippy::disallowed_methods, reason = "tests tell it how slow to be")]
    let plan_ms: u64 = std::env::var("SHOAL_PLAN_MS").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    #[expect(clippy::disallowed_methods, reason = "an agent is told who it is on its command line")]
    let args = Args::parse(std::env::args().skip(1));
    let takes = Duration::from_millis(plan_ms);
    let result = args.and_then(|args| {
        shell::run(&args, &mut |spec| Ok(Box::new(Slow { inner: planner_of(spec)?, takes })), &mut |_| {})
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error}");
            ExitCode::from(3)
        }
    }
}
