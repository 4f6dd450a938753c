//! What the crate promises its callers: a directory that resumes, and a summary that depends on the plan alone.
#![expect(clippy::disallowed_methods, reason = "tests of files")]

mod resume;
mod summary;
mod support;
