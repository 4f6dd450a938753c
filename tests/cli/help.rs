//! Every help text, in the width of a common terminal. The 80 columns come from `COLUMNS`, see the harness.

use crate::support::shoal;
use clap::CommandFactory;

fn check(line: &str) -> String {
    let ended = shoal(line);
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{ended}");
    assert!(ended.stdout.lines().all(|line| line.chars().count() <= 80), "{ended}");
    assert!(!ended.stdout.contains('\x1b'), "{ended}");
    // Spaces at the ends of lines are clap's, and nobody sees them.
    ended.stdout.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

macro_rules! texts {
    ($($test:ident: $line:literal),* $(,)?) => {
        $(#[test] fn $test() { insta::assert_snapshot!(check($line)); })*
    };
}

texts! {
    of_shoal: "--help",
    of_run: "run --help",
    of_up: "up --help",
    of_down: "down --help",
    of_plot: "plot --help",
    of_export: "export --help",
    of_reproduce: "reproduce --help",
    of_bench: "bench --help",
    of_bench_planners: "bench planners --help",
    of_bench_loop: "bench loop --help",
    of_bench_realtime: "bench realtime --help",
    of_bench_startup: "bench startup --help",
    of_validate: "validate --help",
    of_schema: "schema --help",
    of_planners: "planners --help",
    of_doctor: "doctor --help",
    of_clean: "clean --help",
    of_ps: "ps --help",
    of_logs: "logs --help",
    of_top: "top --help",
    of_view: "view --help",
    of_replay: "replay --help",
    of_new: "new --help",
    of_completions: "completions --help",
    of_man: "man --help",
    of_latency: "latency --help",
    of_stress: "stress --help",
    of_sweep: "sweep --help",
    of_pause: "pause --help",
    of_resume: "resume --help",
    of_step: "step --help",
    of_add: "add --help",
    of_remove: "remove --help",
    of_restart: "restart --help",
    of_task: "task --help",
    of_task_send: "task send --help",
    of_metrics: "metrics --help",
    of_inject: "inject --help",
    of_inject_pause: "inject pause --help",
    of_inject_slow_cpu: "inject slow-cpu --help",
    of_task_list: "task list --help",
    of_task_show: "task show --help",
    of_task_cancel: "task cancel --help",
    of_task_wait: "task wait --help",
    of_run_in_short: "run -h",
    the_methods: "planners",
    one_method: "planners decentralized-apf",
}

/// A verb that comes gets a row above.
#[test]
fn no_verb_is_forgotten() {
    let command = shoal::args::Cli::command();
    let verbs: Vec<&str> =
        command.get_subcommands().filter(|verb| !verb.is_hide_set()).map(clap::Command::get_name).collect();
    let known = "run up down plot replay export reproduce sweep stress bench validate schema planners new doctor clean ps top logs latency view metrics pause resume step add remove restart task inject completions man";
    assert_eq!(verbs.join(" "), known);
}

/// Examples are laid out by hand: a terminal of 80 columns must not break them.
#[test]
fn examples_fit_their_lines() {
    fn check(command: &clap::Command) {
        let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        for line in text.lines() {
            assert!(line.chars().count() <= 80, "{}: {line}", command.get_name());
        }
        command.get_subcommands().for_each(check);
    }
    check(&shoal::args::Cli::command());
}

#[test]
fn without_a_word_it_explains_itself() {
    let ended = shoal("");
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(2), ""), "{ended}");
    assert!(ended.stderr.contains("Usage: shoal <VERB>"), "{ended}");
    let version = shoal("--version");
    assert_eq!(version.stdout, format!("shoal {}\n", env!("CARGO_PKG_VERSION")));
}
