//! `shoal clean`: removes what fleets left behind whose daemon and guardian were killed.

use super::fleet;
use crate::args::{CleanArgs, Format};
use crate::exit::Failure;
use crate::out;
use bus::clean::clean_abandoned;
use bus::{Address, SweepReport};
use report::text::bytes_text;
use serde_json::{Value, json};

/// Removes it, and says what it was.
///
/// # Errors
/// With exit code 3, when something could not be removed.
pub fn run(options: &CleanArgs) -> Result<(), Failure> {
    let cleaned = clean_abandoned()?;
    let running = fleet::running()?;
    match options.format {
        Format::Json => {
            let fleets: Vec<Value> = cleaned.iter().map(|(address, report)| entry_json(address, report)).collect();
            let running: Vec<&str> = running.iter().map(|fleet| fleet.address.id()).collect();
            out::json(&json!({ "schema": "shoal.clean/1", "cleaned": fleets, "running": running }))?;
        }
        Format::Text => {
            let mut text: String =
                cleaned.iter().map(|(address, report)| format!("{}\n", entry_text(address, report))).collect();
            if cleaned.is_empty() {
                text += "nothing to clean\n";
            }
            for fleet in &running {
                text += &format!("fleet {} is running and was left alone\n", fleet.address.id());
            }
            out::data(&text)?;
        }
    }
    match cleaned.into_iter().flat_map(|(_, report)| report.left).next() {
        Some(error) => Err(error.into()),
        None => Ok(()),
    }
}

/// What every public verb does first. One line if something was removed; failures show up where they matter.
pub fn silently() {
    for (address, report) in clean_abandoned().unwrap_or_default() {
        out::talk(&entry_text(&address, &report));
    }
}

fn entry_text(address: &Address, report: &SweepReport) -> String {
    let plural = |n: u64| if n == 1 { "" } else { "s" };
    let SweepReport { files, bytes, killed, .. } = *report;
    let processes = match killed {
        0 => String::new(),
        n => format!(", ended {n} process{}", if n == 1 { "" } else { "es" }),
    };
    format!(
        "removed what fleet {} left behind: {files} file{} of shared memory, {}{processes}",
        address.id(),
        plural(files),
        bytes_text(bytes)
    )
}

fn entry_json(address: &Address, report: &SweepReport) -> Value {
    let left: Vec<String> = report.left.iter().map(ToString::to_string).collect();
    json!({
        "fleet": address.id(), "objects": report.files, "bytes": report.bytes,
        "killed": report.killed, "root": report.root, "left": left,
    })
}
