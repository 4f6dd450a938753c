//! `shoal man`: pages for man(1), made from the help.

use crate::args::{Cli, ManArgs};
use crate::exit::Failure;
use crate::file::Files;
use crate::out;
use crate::verbs::unknown;
use clap::{Command, CommandFactory};
use clap_mangen::Man;
use std::path::Path;

/// Prints a page, or writes all of them.
///
/// # Errors
/// With exit code 2 for a verb that there is not, with 3 when pages cannot be written.
pub fn run(options: &ManArgs) -> Result<(), Failure> {
    let pages = pages();
    if let Some(directory) = &options.out {
        return write(&pages, directory);
    }
    let name = [&["shoal".to_owned()], &options.verb[..]].concat().join("-");
    let Some(page) = pages.iter().find(|page| page.get_name() == name) else {
        let words: Vec<_> = options.verb.iter().map(Into::into).collect();
        return Err(unknown::refuse_page(&words));
    };
    out::data(&text(page)?)
}

fn write(pages: &[Command], directory: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(directory).map_err(|error| {
        Failure::environment(format!("pages `{}`: cannot make the directory: {error}", directory.display()))
            .hint("give --out a directory that you may write to")
    })?;
    for page in pages {
        let path = directory.join(format!("{}.1", page.get_name()));
        Files::new().write("page", "--out", &path)?.write(text(page)?.as_bytes())?;
    }
    out::data(&format!("{} pages in {}\n", pages.len(), directory.display()))
}

/// A command for each page, named as its page is: `shoal`, `shoal-task`, `shoal-task-send`.
fn pages() -> Vec<Command> {
    let mut whole = Cli::command().disable_help_subcommand(true);
    whole.build();
    let mut pages = Vec::new();
    collect(&whole, "shoal".to_owned(), &mut pages);
    pages
}

fn collect(command: &Command, name: String, pages: &mut Vec<Command>) {
    let below = command.get_subcommands().filter(|verb| !verb.is_hide_set());
    let shown = name.replace('-', " ");
    pages.push(command.clone().name(name.clone()).display_name(name.clone()).bin_name(shown));
    below.for_each(|verb| collect(verb, format!("{name}-{}", verb.get_name()), pages));
}

fn text(page: &Command) -> Result<String, Failure> {
    let mut text = Vec::new();
    Man::new(page.clone())
        .render(&mut text)
        .map_err(|error| Failure::environment(format!("page of {}: {error}", page.get_name())))?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}
