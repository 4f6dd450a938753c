//! `shoal export`: a record as another format.

use crate::args::{ExportArgs, ExportTo};
use crate::exit::Failure;
use crate::file::{Files, STANDARD};
use crate::progress::Bar;
use crate::{out, record};
use ::record::{ExportError, ExportFormat, Record};
use std::io::{self, IsTerminal};
use std::path::Path;

/// Writes a record as another format.
///
/// # Errors
/// With exit code 2, when there is no record; with 3, when the export cannot be written.
pub fn export(options: &ExportArgs) -> Result<(), Failure> {
    let is_shown = options.out.as_deref() == Some(Path::new(STANDARD)) && io::stdout().is_terminal();
    let (mut bar, what) = (Bar::new(), options.file.display().to_string());
    // Not between the lines of what is exported.
    let progress = &mut |done, total| {
        if !is_shown {
            bar.at(done, total, &what);
        }
    };
    let format = match options.to {
        ExportTo::McapRos2 => ExportFormat::McapRos2,
        ExportTo::Csv => ExportFormat::Csv,
        ExportTo::Jsonl => ExportFormat::Jsonl,
    };
    let record = record::open(&options.file)?;
    record::tell_gaps(&options.file, &record);
    if options.out.as_deref() == Some(Path::new(STANDARD)) {
        return to_standard_output(options, &record, format, progress);
    }
    let target = options.out.clone().unwrap_or_else(|| options.file.with_extension(format.extension()));
    let mut files = Files::new();
    files.read("the record", &options.file);
    let file = files.write("export", "--out", &target)?;
    let mut refused = None;
    let written = file.stream(|to| match ::record::export(&record, format, to, progress) {
        Ok(()) => Ok(()),
        Err(ExportError::Write(error)) => Err(error),
        Err(ExportError::Record(error)) => {
            refused = Some(record::refused(&options.file, &error));
            Err(io::ErrorKind::InvalidData.into())
        }
    });
    bar.finish();
    written.map_err(|failure| refused.take().unwrap_or(failure))?;
    out::data(&format!("{}\n", target.display()))
}

fn to_standard_output(
    options: &ExportArgs,
    record: &Record,
    format: ExportFormat,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(), Failure> {
    if format == ExportFormat::McapRos2 && io::stdout().is_terminal() {
        return Err(Failure::usage("standard output is a terminal, and an MCAP file is not text")
            .hint("name a file, as in `--out run.ros2.mcap`, or pipe it on"));
    }
    match ::record::export(record, format, io::stdout().lock(), progress) {
        Ok(()) => Ok(()),
        // A reader that has gone away is not an error.
        Err(ExportError::Write(error)) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(ExportError::Write(error)) => Err(Failure::environment(format!("standard output: cannot write: {error}"))
            .hint("is the disk full? give the output another place")),
        Err(ExportError::Record(error)) => Err(record::refused(&options.file, &error)),
    }
}
