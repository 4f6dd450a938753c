//! What one does once: a scenario to begin with, completions, man pages.

use crate::support::{Here, SHOAL, shoal};
use std::collections::BTreeSet;
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
