//! `shoal top` in a real terminal: tmux draws it, and presses its keys.

use crate::support::{Fleet, Run, SHOAL, assert_clean, lanes, run, shoal, signal, wait_for};
use rustix::process::Signal;
use serde_json::{Value, json};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// With this in the environment a missing tmux is a failure: `.ci/run` installs one.
const REQUIRED: &str = "SHOAL_NEEDS_TMUX";

/// A terminal of its own, with a shell in it: what a verb leaves behind is seen.
struct Tmux(String);

impl Tmux {
    /// `None` where there is no tmux.
    fn start(width: u16, height: u16) -> Option<Tmux> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        if Command::new("tmux").arg("-V").output().is_err() {
            assert!(std::env::var_os(REQUIRED).is_none(), "tmux is needed here");
            eprintln!("skipped: there is no tmux (Debian: tmux)");
            return None;
        }
        let tmux = Tmux(format!("shoal-{}-{}", std::process::id(), NUMBER.fetch_add(1, Relaxed)));
        let (width, height) = (width.to_string(), height.to_string());
        let shell = "exec env PS1='$ ' ENV= sh -i";
        tmux.tell(&["-f", "/dev/null", "new-session", "-d", "-x", &width, "-y", &height, shell]);
        Some(tmux)
    }

    fn tell(&self, args: &[&str]) -> String {
        let mut command = Command::new("tmux");
        command.args(["-L", &self.0]).args(args);
        let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
        assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn screen(&self) -> String {
        self.tell(&["capture-pane", "-p"])
    }

    /// Types characters as they are.
    fn types(&self, text: &str) {
        self.tell(&["send-keys", "-l", text]);
    }

    /// Presses a key that has a name.
    fn press(&self, key: &str) {
        self.tell(&["send-keys", key]);
    }

    /// Starts `shoal top`, and waits until it shows robots.
    fn top(&self, fleet: &str) {
        self.types(&format!("{SHOAL} top --fleet {fleet}; echo code $?"));
        self.press("Enter");
        self.wait_for("running");
    }

    fn wait_for(&self, words: &str) -> String {
        wait_for(&format!("`{words}` on the screen:\n{}", self.screen()), || {
            Some(self.screen()).filter(|screen| screen.contains(words))
        })
    }

    /// The process of `shoal top` in it.
    fn process(&self) -> u32 {
        let shell = self.tell(&["display-message", "-p", "#{pane_pid}"]);
        let children = || {
            let path = format!("/proc/{0}/task/{0}/children", shell.trim());
            std::fs::read_to_string(path).ok()?.split_whitespace().next()?.parse().ok()
        };
        wait_for("the process of top", children)
    }

    /// The terminal is what it was before, and this was its exit code.
    fn expect_left(&self, code: i32) {
        let screen = self.wait_for(&format!("code {code}"));
        assert!(!screen.contains("age p99"), "{screen}");
        // It is not raw, and the cursor is there.
        self.types("echo 'so' 'it' 'echoes'");
        self.press("Enter");
        self.wait_for("so it echoes");
        assert_eq!(self.tell(&["display-message", "-p", "#{cursor_flag}"]).trim(), "1");
    }
}

impl Drop for Tmux {
    fn drop(&mut self) {
        let _ = Command::new("tmux").args(["-L", &self.0, "kill-server"]).output();
    }
}

/// Robots that drive for a long time.
fn start(mode: &str) -> Fleet {
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(3, 100.0));
    let run = Run::scenario(&scenario).mode(mode).set("defaults.restart=\"on-failure\"");
    let run = run.set("defaults.restart_delay_s=0.1").set("fleet.command_timeout_s=30");
    let run = if mode == "lockstep" { run.arg("--rate").arg("1") } else { run };
    let mut fleet = run.start();
    fleet.wait_tick(1);
    fleet
}

fn end(fleet: Fleet) {
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
}

#[test]
fn keys_kill_a_robot_send_it_to_a_goal_and_sort() {
    let Some(tmux) = Tmux::start(80, 24) else { return };
    let mut fleet = start("realtime");
    let (root, id) = (fleet.root(), fleet.id());
    tmux.top(&id);
    let screen = tmux.wait_for("valid");
    for words in ["robot", "state", "age p99", "realtime", "arrived 0/3", "event", "? help"] {
        assert!(screen.contains(words), "`{words}`\n{screen}");
    }
    assert!(screen.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)), "a map\n{screen}");

    // It is killed, and comes back.
    let before = fleet.agent(1);
    tmux.types("jx");
    tmux.wait_for("kill the process of b?");
    tmux.types("y");
    tmux.wait_for("b restarted");
    wait_for("the new process of b", || Some(fleet.agent(1)).filter(|pid| *pid != before));

    // A goal that is next to it is done.
    tmux.types("g0.5,2");
    tmux.wait_for("goal of b, X,Y or X,Y,YAW: 0.5,2_");
    tmux.press("Enter");
    tmux.wait_for("task 0 of b is");
    shoal(&["task", "wait", "0", "--fleet", &id, "--timeout", "50s"]).expect(0);
    tmux.wait_for("0.5,2.0");

    // The order is another one, and so is the choice.
    tmux.types("S");
    wait_for("the reverse order", || {
        let screen = tmux.screen();
        let place = |name: &str| screen.lines().position(|line| line.starts_with(name));
        place("c ").zip(place("a ")).filter(|(c, a)| c < a)
    });
    tmux.types("/c");
    tmux.press("Enter");
    wait_for("only c", || {
        let screen = tmux.screen();
        let shows = |name: &str| screen.lines().any(|line| line.starts_with(name));
        (shows("c ") && !shows("a ")).then_some(())
    });
    tmux.types("?");
    tmux.wait_for("any key closes this");
    tmux.types("qq");
    tmux.expect_left(0);
    end(fleet);
    assert_clean(&root);
}

#[test]
fn a_large_screen_pauses_and_steps_a_fleet_and_follows_its_size() {
    let Some(tmux) = Tmux::start(200, 60) else { return };
    let mut fleet = start("lockstep");
    let (root, id) = (fleet.root(), fleet.id());
    tmux.top(&id);
    // The map stands beside the table.
    let screen = tmux.screen();
    let is_map = |cell: char| ('\u{2800}'..='\u{28ff}').contains(&cell);
    let from = screen.lines().filter_map(|line| line.chars().position(is_map)).min();
    assert!(screen.contains("robot") && from > Some(60), "{screen}");
    tmux.types(" ");
    tmux.wait_for("PAUSED");
    let tick = fleet.tick();
    tmux.types("n");
    tmux.wait_for(&format!("paused at tick {}", tick + 1));
    tmux.types("N");
    tmux.wait_for(&format!("tick {}", tick + 11));
    assert_eq!(fleet.tick(), tick + 11);
    tmux.types(" ");
    wait_for("it to go on", || (fleet.tick() > tick + 20).then_some(()));

    // Forty columns have room for one thing at a time.
    tmux.tell(&["resize-window", "-x", "40", "-y", "12"]);
    wait_for("the narrow screen", || {
        let screen = tmux.screen();
        (screen.contains("robot") && !screen.contains("goal m")).then_some(())
    });
    tmux.press("Tab");
    wait_for("the map", || (!tmux.screen().contains("robot")).then_some(()));
    tmux.press("C-c");
    tmux.expect_left(0);
    end(fleet);
    assert_clean(&root);
}

/// Whatever becomes of it, the fleet goes on, and the terminal is what it was if that could be done.
#[test]
fn the_fleet_does_not_notice_the_end_of_top() {
    let Some(tmux) = Tmux::start(80, 24) else { return };
    let mut fleet = start("realtime");
    let (root, id) = (fleet.root(), fleet.id());
    for (ending, code) in [(Signal::TERM, 130), (Signal::HUP, 130), (Signal::INT, 130)] {
        tmux.top(&id);
        signal(tmux.process(), ending);
        tmux.expect_left(code);
        tmux.types("clear");
        tmux.press("Enter");
    }
    tmux.top(&id);
    signal(tmux.process(), Signal::KILL);
    tmux.wait_for("code 137");
    drop(tmux);
    // The terminal goes under it.
    let Some(tmux) = Tmux::start(80, 24) else { return };
    tmux.top(&id);
    let top = tmux.process();
    drop(tmux);
    wait_for("top to end", || (!std::path::Path::new(&format!("/proc/{top}")).exists()).then_some(()));

    // The fleet ends under it, and its daemon before.
    let Some(tmux) = Tmux::start(80, 24) else { return };
    tmux.top(&id);
    let tick = fleet.tick();
    fleet.wait_tick(tick + 20);
    let agents: Vec<u32> = (0..3).map(|slot| fleet.agent(slot)).collect();
    signal(fleet.daemon(), Signal::INT);
    tmux.wait_for("has ended");
    tmux.expect_left(0);
    let ended = fleet.wait().expect(130);
    let pids: Vec<Value> = ["a", "b", "c"].iter().map(|id| ended.robot(id)["pid"].clone()).collect();
    assert_eq!(json!(agents), Value::from(pids), "no process was replaced\n{ended}");
    assert_clean(&root);
}

#[test]
fn without_a_terminal_there_is_one_screen_or_a_way_out() {
    let mut fleet = start("realtime");
    let (root, id) = (fleet.root(), fleet.id());
    let once = shoal(&["top", "--once", "--fleet", &id]).expect(0);
    assert!(
        once.stdout.contains("arrived 0/3") && once.stdout.lines().all(|line| line.chars().count() <= 80),
        "{once}"
    );
    assert!(!once.stdout.contains('\x1b'), "{once}");
    let json = shoal(&["top", "--format", "json", "--fleet", &id]).expect(0).report;
    assert_eq!(
        (&json["schema"], &json["fleet"], &json["mode"]),
        (&json!("shoal.top/1"), &json!(id), &json!("realtime"))
    );
    assert!(json["robots"][2]["cpu"].as_f64().is_some_and(|cpu| cpu < 1.0), "{json:#}");
    assert!(json["robots"][0]["position_m"][0].as_f64() > Some(0.0), "{json:#}");
    shoal(&["top", "--fleet", &id]).expect_failure(2, &["is not a terminal", "--once", "shoal ps"]);
    shoal(&["top", "--fleet", "nowhere"]).expect_failure(2, &["`nowhere`", &id]);
    if let Some(tmux) = Tmux::start(80, 24) {
        tmux.types(&format!("TERM=dumb {SHOAL} top --fleet {id}; echo code $?"));
        tmux.press("Enter");
        tmux.wait_for("TERM is `dumb`");
    }
    // A reader that goes away is no error.
    let mut command = Command::new("sh");
    command.args(["-c", &format!("{SHOAL} top --once --fleet {id} | head -1")]);
    assert!(run(command).expect(0).stderr.is_empty());
    end(fleet);
    assert_clean(&root);
}
