//! What one does once: a scenario to begin with, completions, man pages.

use crate::support::{Here, SHOAL, shoal};
use shoal_tests::process::Run;
use std::collections::BTreeSet;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

#[test]
fn a_new_scenario_is_valid_runs_and_is_not_written_over() {
    let here = Here::new();
    let made = here.shoal("new my/fleet");
    assert_eq!(made.code, Some(0), "{made}");
    assert!(made.stdout.contains("shoal run my/fleet/fleet.toml --view"), "{made}");
    let ran = here.shoal("run my/fleet/fleet.toml --mode single");
    assert_eq!((ran.code, ran.stderr.contains("warning")), (Some(0), false), "{ran}");
    let text = std::fs::read_to_string(here.path().join("my/fleet/fleet.toml")).expect("it is there");
    here.file("my/fleet/fleet.toml", text.replace("pillar", "rock"));
    let again = here.shoal("new my/fleet");
    assert_eq!(again.code, Some(2), "{again}");
    assert!(again.stderr.contains("scenario `my/fleet/fleet.toml`") && again.stderr.contains("\nhint: "), "{again}");
    let kept = std::fs::read_to_string(here.path().join("my/fleet/fleet.toml")).expect("it is there");
    assert!(kept.contains("rock"));
    here.file("taken", "a file");
    let refused = here.shoal("new taken");
    assert_eq!(refused.code, Some(3), "{refused}");
    assert!(refused.stderr.contains("directory `taken`"), "{refused}");
}

#[test]
fn a_planner_in_python_is_added_and_says_what_it_needs() {
    let here = Here::new();
    let made = here.shoal("new --python mine");
    assert_eq!(made.code, Some(0), "{made}");
    assert!(made.stdout.contains("mine/planner.py") && made.stdout.contains("\n  cd mine\n"), "{made}");
    let read = |name: &str| std::fs::read_to_string(here.path().join("mine").join(name)).expect("it is there");
    let (fleet, planner) = (read("fleet.toml"), read("planner.py"));
    assert!(fleet.contains("\nagent = [\"python3\", \"planner.py\"]\n") && !fleet.contains("lanes"), "{fleet}");
    let body = planner.split("def plan(view):").nth(1).expect("a function").split("if __name__").next().expect("text");
    let code = body.lines().filter(|line| !line.trim().is_empty() && !line.trim().starts_with(['#', '"'])).count();
    assert!((10..=20).contains(&code), "{code} lines");
    let valid = here.shoal("validate mine/fleet.toml");
    assert_eq!((valid.code, valid.stderr.contains("warning")), (Some(0), false), "{valid}");
    // Neither file is written over, and none is written if one is there.
    std::fs::remove_file(here.path().join("mine/fleet.toml")).expect("it is there");
    here.file("mine/planner.py", "mine");
    let again = here.shoal("new --python mine");
    assert_eq!(again.code, Some(2), "{again}");
    assert!(again.stderr.contains("planner `mine/planner.py`") && again.stderr.contains("\nhint: "), "{again}");
    assert_eq!(read("planner.py"), "mine");
    assert!(!here.path().join("mine/fleet.toml").exists());
    // Here stands an agent of shoal for Python, which these tests do without; with the wheel, python/tests runs it.
    here.file("mine/planner.py", planner).file("mine/fleet.toml", fleet);
    let bin = here.path().join("bin");
    std::fs::create_dir(&bin).expect("it is new");
    let run = || {
        let run =
            Run::new(SHOAL).words("run fleet.toml --mode lockstep --format json").within(&here.path().join("mine"));
        run.env("PATH", &bin.display().to_string()).end()
    };
    let missing = run();
    assert_eq!(missing.code, Some(3), "{missing}");
    for words in ["robot `west`", "agent `python3 planner.py`", "`python3` is not in PATH", "\nhint: "] {
        assert!(missing.stderr.contains(words), "{words}: {missing}");
    }
    here.file(
        "bin/python3",
        format!("#!/bin/sh\n[ \"$1\" = planner.py ] && [ -f \"$1\" ] || exit 9\nshift\nexec {SHOAL} agent \"$@\"\n"),
    );
    std::fs::set_permissions(bin.join("python3"), PermissionsExt::from_mode(0o755)).expect("it is ours");
    let ran = run();
    assert_eq!(ran.code, Some(0), "{ran}");
    assert!(ran.stdout.contains("\"arrived_all\": true"), "{ran}");
}

/// The words that a shell gets for the last of these, which has been begun.
fn words(line: &[&str]) -> BTreeSet<String> {
    let output = Command::new(SHOAL)
        .env("SHOAL_COMPLETE", "bash")
        .env("_CLAP_IFS", "\n")
        .env("_CLAP_COMPLETE_INDEX", (line.len() - 1).to_string())
        .arg("--")
        .args(line)
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).lines().map(|word| word.trim().to_owned()).collect()
}

#[test]
fn a_shell_gets_verbs_options_scenarios_and_planners() {
    let has = |line: &[&str], word: &str| words(line).contains(word);
    assert!(has(&["shoal", "re"], "replay") && !has(&["shoal", "re"], "run"));
    assert!(!has(&["shoal", ""], "guardian"), "what is hidden is not offered");
    assert!(has(&["shoal", "run", "--vi"], "--view"));
    assert!(has(&["shoal", "run", "ring"], "ring-15") && !has(&["shoal", "run", "ring"], "demo-15"));
    assert!(has(&["shoal", "run", "--planner", "or"], "orca"));
    assert!(has(&["shoal", "planners", "dec"], "decentralized-apf"));
}

#[test]
fn bash_completes_what_it_is_given() {
    let script = "source <(\"$SHOAL\" completions bash)\n\
                  COMP_WORDS=(shoal run dem) COMP_CWORD=2 COMP_TYPE=9 COMP_LINE='shoal run dem' COMP_POINT=13\n\
                  complete -p shoal >/dev/null || exit 1\n\
                  _clap_complete_shoal \"$SHOAL\" dem run && echo \"${COMPREPLY[@]}\"\n";
    // The script asks for `shoal` by that name.
    let folder = tempfile::tempdir().expect("a temporary directory");
    std::os::unix::fs::symlink(SHOAL, folder.path().join("shoal")).expect("a link");
    let path = format!("{}:{}", folder.path().display(), std::env::var("PATH").unwrap_or_default());
    let output =
        Command::new("bash").args(["-c", script]).env("SHOAL", SHOAL).env("PATH", path).output().expect("it runs");
    let found = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(found.contains("demo-15"), "{found} {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn every_shell_is_told_to_ask_shoal() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let ended = shoal(&format!("completions {shell}"));
        assert_eq!(ended.code, Some(0), "{ended}");
        assert!(ended.stdout.contains("SHOAL_COMPLETE"), "{ended}");
    }
    assert_eq!(shoal("completions csh").code, Some(2));
}

#[test]
fn there_is_a_page_for_every_verb_and_for_nothing_else() {
    let here = Here::new();
    let page = here.shoal("man task send");
    assert!(page.stdout.contains(".TH shoal-task-send 1") && page.stdout.contains("nearest"), "{page}");
    assert!(here.shoal("man").stdout.contains(".TH shoal 1"));
    for line in ["man tusk", "man task sand", "man run fast"] {
        let refused = here.shoal(line);
        assert_eq!(refused.code, Some(2), "{refused}");
        assert!(refused.stderr.contains("unknown verb"), "{refused}");
    }
    let all = here.shoal("man --out pages");
    assert_eq!(all.code, Some(0), "{all}");
    let read = std::fs::read_dir(here.path().join("pages")).expect("it is there");
    let pages: BTreeSet<String> = read.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    for page in ["shoal.1", "shoal-run.1", "shoal-task-send.1", "shoal-inject-kill.1"] {
        assert!(pages.contains(page), "{pages:?}");
    }
    assert!(!pages.iter().any(|page| page.contains("guardian") || page.contains("help")), "{pages:?}");
}
