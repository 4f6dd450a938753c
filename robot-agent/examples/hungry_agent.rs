//! An agent for tests: it steers as its scenario says, and with every plan takes another MiB of memory, or another open file
//! with `SHOAL_EATS=files`, until it gets no more.

use planners::{Plan, PlanInput, Planner};
use robot_agent::planner_of;
use std::fs::File;
use std::process::ExitCode;

struct Hungry {
    inner: Box<dyn Planner>,
    eats_files: bool,
    memory: Vec<Vec<u8>>,
    files: Vec<File>,
}

impl Planner for Hungry {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        if self.eats_files {
            #[expect(clippy::disallowed_methods, reason = "taking files is what it is for")]
            let file = File::open("/dev/null");
            self.files.push(file.unwrap_or_else(|error| panic!("/dev/null: {error}")));
        } else {
            self.memory.push(vec![1; 1 << 20]);
        }
        self.inner.plan(input)
    }
}

fn main() -> ExitCode {
    #[expect(clippy::disallowed_methods, reason = "tests tell it what to take")]
    let eats_files = std::env::var("SHOAL_EATS").is_ok_and(|eats| eats == "files");
    robot_agent::run(|spec| {
        let inner = planner_of(spec)?;
        Ok(Box::new(Hungry { inner, eats_files, memory: Vec::new(), files: Vec::new() }))
    })
}
