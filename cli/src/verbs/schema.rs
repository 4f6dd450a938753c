//! `shoal schema`: the JSON Schema of scenario files.

use crate::exit::Failure;
use crate::out;

/// Prints it.
///
/// # Errors
/// When standard output cannot be written.
pub fn run() -> Result<(), Failure> {
    out::json(&scenarios::schema())
}
