//! An agent for tests: it steers as its scenario says, but takes its time: `SHOAL_PLAN_MS` milliseconds a call (default
//! 0), in which it does nothing.

use planners::{Plan, PlanInput, Planner};
use robot_agent::planner_of;
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
    let takes = Duration::from_millis(plan_ms);
    robot_agent::run(|spec| Ok(Box::new(Slow { inner: planner_of(spec)?, takes })))
}
