//! `shoal doctor`: can this machine run a fleet, and how large a one?
//!
//! [`probe`] looks at the machine, [`assess`] judges what was seen: the second is pure.

mod assess;
mod probe;

pub use assess::assess;
pub use probe::{Machine, probe};

use crate::args::{DoctorArgs, Format};
use crate::exit::{self, Failure};
use crate::out;
use report::Page;
use serde::Serialize;
use serde_json::json;

/// How a check came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// As it should be.
    Pass,
    /// Small fleets run; large ones, or the numbers, may suffer.
    Warn,
    /// No fleet of processes runs.
    Fail,
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Check {
    /// What.
    pub name: &'static str,
    /// How it came out.
    pub status: State,
    /// What was seen.
    pub detail: String,
    /// The way out, unless all is well.
    pub hint: Option<String>,
}

/// Looks at the machine and says what it is fit for. Exit code 3 if no fleet can run.
///
/// # Errors
/// When standard output cannot be written.
pub fn run(options: &DoctorArgs) -> Result<i32, Failure> {
    let checks = assess(&probe());
    let ok = checks.iter().all(|check| check.status != State::Fail);
    match options.format {
        Format::Json => out::json(&json!({ "schema": "shoal.doctor/1", "ok": ok, "checks": checks }))?,
        Format::Text => {
            let mut page = Page::new(out::stdout_width());
            render(&mut page, &checks);
            out::data(&page.into_text())?;
        }
    }
    Ok(if ok { exit::OK } else { exit::ENVIRONMENT })
}

fn render(page: &mut Page, checks: &[Check]) {
    let count = |status| checks.iter().filter(|check| check.status == status).count();
    for check in checks {
        let word = match check.status {
            State::Pass => "PASS",
            State::Warn => "WARN",
            State::Fail => "FAIL",
        };
        page.words_after(&format!("{word}  "), &format!("{}: {}", check.name, check.detail), 6);
        if let Some(hint) = &check.hint {
            page.words_after("      hint: ", hint, 12);
        }
    }
    page.gap();
    let (fails, warns) = (count(State::Fail), count(State::Warn));
    let verdict = match (fails, warns) {
        (0, 0) => "this machine is ready",
        (0, _) => "this machine can run fleets, with the warnings above",
        _ => "this machine cannot run a fleet of processes; `shoal run --mode single` needs none of this",
    };
    page.words(verdict, 0);
}
