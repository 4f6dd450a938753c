//! `shoal schema`: the format of scenario files, as JSON Schema or as a page.

use crate::args::{Format, SchemaArgs};
use crate::exit::Failure;
use crate::out;

/// Prints it.
///
/// # Errors
/// When standard output cannot be written.
pub fn run(options: &SchemaArgs) -> Result<(), Failure> {
    match options.format {
        Format::Json => out::json(&scenarios::schema()),
        Format::Text => out::data(&scenarios::reference()),
    }
}
