//! `shoal plot`: a recorded run as a picture.

use crate::args::PlotArgs;
use crate::exit::Failure;
use crate::file::{Files, STANDARD};
use crate::record;
use crate::{out, source};
use ::record::Record;
use report::{Report, SCHEMA};
use std::io::Read;
use std::path::{Path, PathBuf};
use view::{run, scene::Scene};

/// No file that is looked into for a report is larger.
const REPORT_BYTES_MAX: u64 = 64 << 20;

/// Draws a record, or the record of a report.
///
/// # Errors
/// With exit code 2, when there is nothing to draw; with 3, when the picture cannot be written.
pub fn plot(options: &PlotArgs) -> Result<(), Failure> {
    let (path, record) = find(&options.file)?;
    record::tell_gaps(&path, &record);
    let scene = || Scene::of(&record).map_err(|error| record::refused(&path, &error));
    if options.out.as_deref() == Some(Path::new(STANDARD)) {
        return out::data(&run::draw(&scene()?));
    }
    let target = options.out.clone().unwrap_or_else(|| path.with_extension("svg"));
    let mut files = Files::new();
    files.read("what is drawn", &options.file);
    files.read("the record", &path);
    let file = files.write("picture", "--out", &target)?;
    file.write(run::draw(&scene()?).as_bytes())?;
    out::data(&format!("{}\n", target.display()))
}

/// The record that is meant, and where it is.
fn find(named: &Path) -> Result<(PathBuf, Record), Failure> {
    let Some(report) = report_in(named) else {
        return record::open(named).map(|record| (named.to_path_buf(), record)).map_err(|failure| {
            let shown = named.display().to_string();
            if named == Path::new(STANDARD) {
                return failure.hint("records are read from files; one called `-` is `./-`");
            }
            let is_scenario = source::load(named.as_os_str(), &scenarios::Overrides::default()).is_ok();
            if shown.ends_with(".toml") && named.exists() || is_scenario {
                return failure.hint(format!("a scenario is run first: `shoal run {shown} --record out.mcap`"));
            }
            failure
        });
    };
    let shown = named.display();
    let Some(path) = report.record else {
        return Err(Failure::usage(format!("report `{shown}`: its run was not recorded, and a report has no paths"))
            .hint(format!("record the run: `shoal run {} --record out.mcap`", report.scenario)));
    };
    let path = PathBuf::from(path);
    let record = record::open(&path)?;
    let hash = record.ending().map(|ending| format!("{:016x}", ending.outcome.trajectory_hash));
    if hash.as_ref() != Some(&report.trajectory_hash) {
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
    let mut file = std::fs::File::open(path).ok()?;
    // Most files are records: not worth a search for JSON.
    let mut bytes = Vec::new();
    file.by_ref().take(64).read_to_end(&mut bytes).ok()?;
    if bytes.trim_ascii_start().first() != Some(&b'{') {
        return None;
    }
    file.take(REPORT_BYTES_MAX).read_to_end(&mut bytes).ok()?;
    serde_json::from_slice::<Report>(&bytes).ok().filter(|report| report.schema == SCHEMA)
}
