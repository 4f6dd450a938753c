//! The one executable: the command line, and every process of a fleet.

use clap::Parser;
use clap::error::ErrorKind;
use shoal::args::{self, Cli, Verb};
use shoal::exit::{self, Failure};
use shoal::{out, verbs};
use std::process::ExitCode;

fn main() -> ExitCode {
    match shoal::own_limits::prepare() {
        Ok(()) => obey(),
        Err(failure) => {
            out::fail(&failure);
            ended(failure.code)
        }
    }
}

/// Not a part of `main`: its frame needs more stack than there may be.
#[inline(never)]
fn obey() -> ExitCode {
    verbs::completions::answer();
    let cli = match Cli::try_parse_from(std::env::args_os().map(args::not_an_option)) {
        Ok(cli) => cli,
        Err(error) => {
            // A reader that went away is no reason to fail.
            let _ = error.print();
            let asked = matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion);
            return ended(if asked { exit::OK } else { exit::USAGE });
        }
    };
    match dispatch(&cli.verb) {
        Ok(code) => ended(code),
        Err(failure) => {
            out::fail(&failure);
            ended(failure.code)
        }
    }
}

fn dispatch(verb: &Verb) -> Result<i32, Failure> {
    let done = |result: Result<(), Failure>| result.map(|()| exit::OK);
    match verb {
        // What looks for leftovers must find them; a process of a fleet has better things to do.
        Verb::Doctor(_)
        | Verb::Clean(_)
        | Verb::Agent(_)
        | Verb::World(_)
        | Verb::Bare(_)
        | Verb::Guardian(_)
        | Verb::Janitor(_) => {}
        _ => verbs::clean::silently(),
    }
    match verb {
        Verb::Run(options) => shoal::run::run(options),
        Verb::Up(options) => verbs::up::run(options),
        Verb::Remove(options) => done(verbs::remove::run(options)),
        Verb::Restart(options) => done(verbs::restart::run(options)),
        Verb::Down(options) => done(verbs::down::run(options)),
        Verb::Logs(options) => done(verbs::logs::run(options)),
        Verb::Plot(options) => done(verbs::plot::plot(options)),
        Verb::Replay(options) => verbs::replay::run(options),
        Verb::Export(options) => done(verbs::export::export(options)),
        Verb::Reproduce(options) => verbs::reproduce::run(options),
        Verb::Bench(verb) => verbs::bench::run(verb),
        Verb::Validate(options) => verbs::validate::run(options),
        Verb::Schema(options) => done(verbs::schema::run(options)),
        Verb::Planners(options) => done(verbs::planners::run(options)),
        Verb::New(options) => done(verbs::new::run(options)),
        Verb::Completions(options) => done(verbs::completions::run(options)),
        Verb::Man(options) => done(verbs::man::run(options)),
        Verb::Doctor(options) => verbs::doctor::run(options),
        Verb::Clean(options) => done(verbs::clean::run(options)),
        Verb::Ps(options) => verbs::ps::run(options),
        Verb::Top(options) => verbs::top::run(options),
        Verb::Latency(options) => done(verbs::latency::run(options)),
        Verb::Sweep(options) => verbs::sweep::run(options),
        Verb::Stress(options) => verbs::stress::run(options),
        Verb::Pause(options) => done(verbs::pace::pause(options)),
        Verb::Resume(options) => done(verbs::pace::resume(options)),
        Verb::Step(options) => verbs::pace::step(options),
        Verb::Add(options) => done(verbs::add::run(options)),
        Verb::View(options) => done(verbs::view::run(options)),
        Verb::Metrics(options) => done(verbs::metrics::run(options)),
        Verb::Task(verb) => verbs::task::run(verb),
        Verb::Inject(verb) => done(verbs::inject::run(verb)),
        Verb::Agent(options) => done(verbs::internal::agent(options)),
        Verb::World(options) => done(verbs::internal::world(options)),
        Verb::Bare(options) => done(verbs::internal::bare(options)),
        Verb::Janitor(options) => done(daemon::janitor::main(&options.root, options.parent).map_err(Failure::from)),
        Verb::Guardian(options) => done(daemon::guardian::main(&options.root).map_err(Failure::from)),
        Verb::Other(words) => Err(verbs::unknown::refuse(words)),
    }
}

fn ended(code: i32) -> ExitCode {
    ExitCode::from(u8::try_from(code).unwrap_or(u8::MAX))
}
