//! What one does once: `new`, `completions`, `man`.

use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// `shoal new`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal new my-fleet                        makes my-fleet/fleet.toml
  shoal run my-fleet/fleet.toml --view      and watch it drive
  shoal new --python my-planner             makes fleet.toml and planner.py
  cd my-planner; shoal run fleet.toml       and run the script for each robot

The scenario has a comment on every key that it sets: change it and run again.
A planner in Python needs the wheel `shoal-fleet`.")]
pub struct NewArgs {
    /// Directory to make; one that exists is added to
    #[arg(value_name = "DIRECTORY")]
    pub directory: PathBuf,
    /// Add a planner in Python, as the agent of every robot
    #[arg(long)]
    pub python: bool,
}

/// A shell that can complete what is typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Shell {
    /// GNU Bash
    Bash,
    /// Z shell
    Zsh,
    /// fish
    Fish,
    /// Elvish
    Elvish,
    /// PowerShell
    Powershell,
}

impl Shell {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Shell::Bash => "bash",
            Shell::Zsh => "zsh",
            Shell::Fish => "fish",
            Shell::Elvish => "elvish",
            Shell::Powershell => "powershell",
        }
    }
}

/// `shoal completions`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  source <(shoal completions bash)                              in ~/.bashrc
  shoal completions fish > ~/.config/fish/completions/shoal.fish

What it prints asks shoal for the words, so that robots and fleets that are
running, scenarios and planners are completed as well as verbs and options.")]
pub struct CompletionsArgs {
    /// Which shell
    #[arg(value_enum, value_name = "SHELL")]
    pub shell: Shell,
}

/// `shoal man`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  shoal man | man -l -                      the page of shoal
  shoal man task send | man -l -            that of a verb
  shoal man --out /usr/share/man/man1       all pages, a file for each")]
pub struct ManArgs {
    /// The page of this verb; by default that of shoal
    #[arg(value_name = "VERB", conflicts_with = "out")]
    pub verb: Vec<String>,
    /// Write all pages to this directory
    #[arg(long, value_name = "DIRECTORY")]
    pub out: Option<PathBuf>,
}
