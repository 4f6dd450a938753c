//! What can be asked without a run: `validate`, `schema`, `planners`, `doctor`, `clean`.

use super::Format;
use clap::Args;
use std::ffi::OsString;

/// `shoal validate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal validate my.toml           all problems, with line numbers
  shoal validate scenarios/*.toml
  shoal validate                   the catalog that ships with shoal")]
pub struct ValidateArgs {
    /// Scenario files or names from the catalog; by default the whole catalog
    #[arg(value_name = "FILE")]
    pub scenarios: Vec<OsString>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal schema`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal schema > shoal.schema.json          and point your editor at it
  shoal schema --format text                every key, to read")]
pub struct SchemaArgs {
    /// JSON Schema, or a reference in Markdown
    #[arg(long, value_enum, default_value_t = Format::Json)]
    pub format: Format,
}

/// `shoal planners`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal planners       one line per planner
  shoal planners apf   its parameters: units, defaults, ranges, meaning")]
pub struct PlannersArgs {
    /// Describe this planner
    #[arg(value_name = "NAME")]
    pub name: Option<String>,
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal doctor`.
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// `shoal clean`.
#[derive(Debug, Args)]
pub struct CleanArgs {
    /// Output format
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}
