//! `shoal plot`: a recorded run as a picture.

use crate::cli::PlotArgs;
use crate::exit::Failure;
use crate::file::OutFile;
use crate::picture::{run, scene::Scene};
use crate::record;
use crate::report::{Report, SCHEMA};
use crate::{out, source};
use protocol::record::Record;
use std::path::{Path, PathBuf};

/// No file that is looked into for a report is larger.
const REPORT_BYTES_MAX: u64 = 64 << 20;

/// Draws a record, or the record of a report.
///
/// # Errors
/// With exit code 2, when there is nothing to draw; with 3, when the picture cannot be written.
pub fn plot(options: &PlotArgs) -> Result<(), Failure> {
    let (path, record) = find(&options.file)?;
    if options.out.as_deref() == Some(Path::new("-")) {
        return out::data(&run::draw(&Scene::of(&record)));
    }
    let target = options.out.clone().unwrap_or_else(|| path.with_extension("svg"));
    let file = OutFile::prepare("picture", "--out", &target)?;
    file.write(run::draw(&Scene::of(&record)).as_bytes())?;
    out::data(&format!("{}\n", target.display()))
}

/// The record that is meant, and where it is.
fn find(named: &Path) -> Result<(PathBuf, Record), Failure> {
    let Some(report) = report_in(named) else {
        return record::read(named).map(|record| (named.to_path_buf(), record)).map_err(|failure| {
            let shown = named.display().to_string();
            let is_scenario = source::load(named.as_os_str(), &scenarios::Overrides::default()).is_ok();
            if shown.ends_with(".toml") && named.exists() || is_scenario {
                return failure.hint(format!("a scenario is run first: `shoal run {shown} --record out.rec`"));
            }
            failure
        });
    };
    let shown = named.display();
    let Some(path) = report.record else {
        return Err(Failure::usage(format!("report `{shown}`: its run was not recorded, and a report has no paths"))
            .hint(format!("record the run: `shoal run {} --record out.rec`", report.scenario)));
    };
    let path = PathBuf::from(path);
    let record = record::read(&path)?;
    let hash = format!("{:016x}", record.ending.outcome.trajectory_hash);
    if hash != report.trajectory_hash {
        return Err(Failure::usage(format!(
            "report `{shown}`: its record `{}` is now that of another run",
            path.display()
        ))
        .hint(format!("to draw that one: `shoal plot {}`", path.display())));
    }
    Ok((path, record))
}

/// The report in a file, if it is one.
fn report_in(path: &Path) -> Option<Report> {
    let meta = std::fs::metadata(path).ok()?;
    if !meta.is_file() || meta.len() > REPORT_BYTES_MAX {
        return None;
    }
    #[expect(clippy::disallowed_methods, reason = "the command line reads what it was given")]
    let bytes = std::fs::read(path).ok()?;
    // Most files are records: not worth a search for JSON.
    if Record::is_begun_by(&bytes) {
        return None;
    }
    serde_json::from_slice::<Report>(&bytes).ok().filter(|report| report.schema == SCHEMA)
}
