//! Fleets that are left running: `up`, `down`, tasks that outlive their fleet, `logs`.

use crate::places::Permit;
use crate::support::{
    Ended, SHOAL, assert_clean, is_gone, lanes, process_of, processes_of, run, shoal, signal, stop, wait_for,
};
use rustix::process::Signal;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// A fleet in the background, which ends with the test.
pub(crate) struct Service {
    pub(crate) directory: TempDir,
    pub(crate) name: String,
    scenario: String,
    pub(crate) root: PathBuf,
    up: Value,
    mode: &'static str,
    env: Vec<(String, String)>,
    _permit: Permit,
}

impl Service {
    /// A fleet of this number of robots on lanes of 2 m, restarted if they die.
    pub(crate) fn up(robots: usize) -> Service {
        let more = "[fleet]\ncommand_timeout_s = 30\n[defaults]\nrestart = \"on-failure\"\nrestart_delay_s = 0.2\n";
        Service::of(lanes(robots, 2.0).replacen("[defaults]\n", more, 1), &[])
    }

    /// A fleet of this scenario in `realtime`, whose processes have this in their environment.
    pub(crate) fn of(scenario: String, env: &[(&str, &str)]) -> Service {
        Service::in_mode("realtime", scenario, env)
    }

    /// The same in another clock mode.
    pub(crate) fn in_mode(mode: &'static str, scenario: String, env: &[(&str, &str)]) -> Service {
        let env = env.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        let directory = TempDir::with_prefix("shoal-e2e-").unwrap();
        let name = directory.path().file_name().unwrap().to_str().unwrap().to_owned();
        std::fs::write(directory.path().join("scenario.toml"), &scenario).unwrap();
        let mut service = Service {
            directory,
            name,
            scenario,
            root: PathBuf::new(),
            up: Value::Null,
            mode,
            env,
            _permit: Permit::take(1),
        };
        service.start();
        service
    }

    pub(crate) fn command(&self) -> Command {
        self.command_for(&self.name)
    }

    /// The same scenario and state, under this name.
    pub(crate) fn command_for(&self, name: &str) -> Command {
        let mut command = Command::new(SHOAL);
        command.arg("up").arg(self.directory.path().join("scenario.toml")).args(["--name", name, "--state"]);
        command.arg(self.state()).args(["--format", "json", "--mode", self.mode]);
        command.envs(self.env.iter().map(|(key, value)| (key, value)));
        command
    }

    pub(crate) fn start(&mut self) {
        let mut command = self.command();
        command.arg("--detach");
        self.start_by(command);
    }

    /// Another daemon takes the fleet over.
    pub(crate) fn adopt(&mut self) {
        let root = self.root.clone();
        let mut command = Command::new(SHOAL);
        command.args(["up", "--adopt", "--detach", "--format", "json", "--name", &self.name]);
        self.start_by(command);
        assert_eq!(self.root, root, "it is the same fleet");
    }

    pub(crate) fn start_by(&mut self, command: Command) {
        self.up = run(command).expect(0).report;
        self.root =
            format!("/dev/shm/shoal-{}-{}", rustix::process::geteuid().as_raw(), self.up["fleet"].as_str().unwrap())
                .into();
    }

    pub(crate) fn state(&self) -> PathBuf {
        self.directory.path().join("state")
    }

    pub(crate) fn ask(&self, args: &[&str]) -> Ended {
        shoal(&[args, &["--fleet", &self.name]].concat())
    }

    pub(crate) fn json(&self, args: &[&str]) -> Value {
        self.ask(&[args, &["--format", "json"]].concat()).expect(0).report
    }

    pub(crate) fn daemon(&self) -> u32 {
        self.up["daemon_pid"].as_u64().unwrap() as u32
    }

    /// The world's process, as `ps` has it.
    pub(crate) fn world(&self) -> u32 {
        self.json(&["ps"])["fleets"][0]["world_pid"].as_u64().unwrap() as u32
    }

    /// The agent that is the process of a robot now.
    pub(crate) fn agent(&self, robot: &str) -> Option<u32> {
        let ps = self.json(&["ps"]);
        let robots = ps["fleets"][0]["robots"].as_array().unwrap();
        robots.iter().find(|known| known["id"] == robot)?["pid"].as_u64().map(|pid| pid as u32)
    }

    /// What the database says, asked with the program of SQLite. `None` where that is missing.
    pub(crate) fn sql(&self, query: &str) -> Option<String> {
        let mut command = Command::new("sqlite3");
        command.arg("-readonly").arg(self.state().join("fleet.db")).arg(query);
        match command.stderr(Stdio::piped()).output() {
            Ok(output) => {
                assert!(output.status.success(), "{query}: {}", String::from_utf8_lossy(&output.stderr));
                Some(String::from_utf8(output.stdout).unwrap().trim().to_owned())
            }
            Err(_) => {
                eprintln!("skipped: there is no sqlite3");
                None
            }
        }
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        if self.root.exists() {
            let _ = shoal(&["down", "--force", "--fleet", &self.name]);
        }
        if std::thread::panicking() {
            eprintln!("{}", self.scenario);
            for file in ["log.jsonl", "stderr.log"] {
                eprintln!("---- {file}\n{}", std::fs::read_to_string(self.state().join(file)).unwrap_or_default());
            }
        }
    }
}

pub(crate) fn states(tasks: &Value) -> Vec<String> {
    let tasks = tasks["tasks"].as_array().unwrap_or_else(|| panic!("no list: {tasks:#}"));
    tasks.iter().map(|task| task["state"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn a_fleet_is_left_running_and_its_tasks_are_done() {
    let service = Service::up(3);
    assert_eq!(
        (&service.up["schema"], &service.up["processes"]),
        (&"shoal.up/1".into(), &4.into()),
        "{:#}",
        service.up
    );
    let ps = service.json(&["ps"]);
    assert_eq!(
        (&ps["fleets"][0]["name"], &ps["fleets"][0]["daemon_pid"]),
        (&service.name.as_str().into(), &service.daemon().into())
    );
    assert_eq!(ps["fleets"][0]["state_directory"], service.state().to_str().unwrap(), "{ps:#}");
    // It has a session of its own, and the terminal nothing of it.
    assert_eq!(process_of(service.daemon()).map(|process| process.parent), Some(1), "its caller has ended");

    // A second one of this name, or with this state.
    run(service.command()).expect_failure(2, &["runs already", &service.name]);
    run(service.command_for("other")).expect_failure(3, &["state directory", "another daemon"]);

    // By name, by the shortest way, and the least sum of ways.
    let sent = service.json(&["task", "send", "a", "1,0", "--id", "first"]);
    assert_eq!(
        (&sent["schema"], &sent["task"], &sent["robot"]),
        (&"shoal.task/1".into(), &0.into(), &"a".into()),
        "{sent:#}"
    );
    assert_eq!(service.json(&["task", "send", "a", "1,0", "--id", "first"])["task"], 0, "sent twice, it is one");
    service.ask(&["task", "send", "a", "1,1", "--id", "first"]).expect_failure(2, &["`first` is taken by task 0"]);
    let nearest = service.json(&["task", "send", "--assign", "nearest", "1,4"]);
    assert_eq!(nearest["robot"], "c", "{nearest:#}");
    let optimal = service.json(&["task", "send", "--assign", "optimal", "0,0", "0,2", "0,4"]);
    let robots: Vec<&Value> = optimal["tasks"].as_array().unwrap().iter().map(|task| &task["robot"]).collect();
    assert_eq!(robots, ["a", "b", "c"], "{optimal:#}");

    // A dead agent costs no task: its robot comes back with a new process.
    let victim = service.agent("b").unwrap();
    signal(victim, Signal::KILL);
    let waited = service.ask(&["task", "wait", "--all", "--timeout", "60s", "--format", "json"]).expect(0).report;
    assert!(states(&waited).iter().all(|state| state == "done"), "{waited:#}");
    let all = service.json(&["task", "list"]);
    assert_eq!(states(&all), ["done"; 5], "{all:#}");
    assert_ne!(service.agent("b"), Some(victim));
    let shown = service.json(&["task", "show", "first"]);
    let steps: Vec<&str> =
        shown["tasks"][0]["steps"].as_array().unwrap().iter().map(|step| step["state"].as_str().unwrap()).collect();
    assert_eq!((steps[0], steps[steps.len() - 1]), ("queued", "done"), "{shown:#}");

    // A task that is far is cancelled; one that has no time fails.
    service.json(&["task", "send", "a", "2,0", "--id", "far"]);
    service.json(&["task", "send", "b", "2.9,2", "--deadline", "40ms", "--id", "late"]);
    let cancelled = service.json(&["task", "cancel", "far"]);
    assert_eq!(cancelled["tasks"][0]["state"], "cancelled", "{cancelled:#}");
    service.ask(&["task", "cancel", "far"]).expect_failure(2, &["is cancelled already"]);
    service.ask(&["task", "wait", "late"]).expect(1);
    service.ask(&["task", "wait", "nothing"]).expect_failure(2, &["unknown task `nothing`"]);

    // What happened is in the log.
    let log = service.ask(&["logs", "b", "--format", "json"]).expect(0).stdout;
    let entries: Vec<Value> = log.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(entries.iter().all(|entry| entry["robot"] == "b"), "{log}");
    let died = entries.iter().find(|entry| entry["event"] == "died").unwrap_or_else(|| panic!("no death: {log}"));
    assert_eq!((&died["level"], &died["source"]), (&"warn".into(), &"world".into()), "{died:#}");
    assert_eq!(service.ask(&["logs", "--since", "1h", "--level", "error"]).expect(0).stdout, "");
    service.ask(&["logs", "--since", "yesterday"]).expect_failure(2, &["`--since yesterday` is not a time"]);

    let down = service.json(&["down"]);
    assert_eq!((&down["schema"], &down["forced"]), (&"shoal.down/1".into(), &false.into()), "{down:#}");
    assert_clean(&service.root);
    assert!(is_gone(service.daemon()));
    let report: Value =
        serde_json::from_str(&std::fs::read_to_string(service.state().join("report.json")).unwrap()).unwrap();
    assert_eq!(report["per_robot"][0]["tasks_done"], 2, "{report:#}");
    for file in std::fs::read_dir(service.state()).unwrap().flatten() {
        let mode = std::os::unix::fs::MetadataExt::mode(&file.metadata().unwrap());
        assert!(mode & 0o077 == 0 || file.file_name() == "report.json", "{:?} is open to others", file.path());
    }
    if let Some(counted) = service.sql("SELECT state, count(*) FROM task GROUP BY state ORDER BY state") {
        assert_eq!(counted, "cancelled|1\ndone|5\nfailed|1");
        assert_eq!(service.sql("SELECT count(*) FROM task_step WHERE state = 'done'").unwrap(), "5", "none twice");
        assert_eq!(service.sql("SELECT ending FROM run").unwrap(), "stopped");
    }
    // The log is there for those who come later.
    let state = service.state();
    let text = shoal(&["logs", "--state", state.to_str().unwrap(), "daemon"]).expect(0).stdout;
    assert!(text.contains("fleet ends: stopped") && text.lines().count() >= 2, "{text}");
}

#[test]
fn tasks_outlive_their_fleet() {
    let mut service = Service::up(2);
    service.json(&["task", "send", "a", "1,0", "--id", "done"]);
    service.ask(&["task", "wait", "done"]).expect(0);
    // The world is stopped below, so that they cannot be done before the daemon is killed.
    let world = service.up["world_pid"].as_u64().unwrap() as u32;
    for (robot, goal, id) in [("a", "0,0", "open-1"), ("b", "0,2", "open-2"), ("b", "1,2", "open-3")] {
        service.json(&["task", "send", robot, goal, "--id", id]);
    }
    stop(world);
    // Killed, all of it: no farewell of the daemon.
    shoal(&["down", "--force", "--fleet", &service.name]).expect(0);
    assert_clean(&service.root);
    let before: Vec<String> = match service.sql("SELECT key FROM task WHERE state NOT IN ('done') ORDER BY id") {
        Some(keys) => keys.lines().map(str::to_owned).collect(),
        None => Vec::new(),
    };
    service.start();
    service.ask(&["task", "wait", "open-1", "open-2", "open-3", "--timeout", "60s"]).expect(0);
    let all = service.json(&["task", "list"]);
    assert_eq!(states(&all), ["done"; 4], "{all:#}");
    for key in before {
        let shown = service.json(&["task", "show", &key]);
        assert!(shown.to_string().contains("the fleet was started again"), "{shown:#}");
    }
    service.json(&["down"]);
    assert_clean(&service.root);
    if let Some(runs) = service.sql("SELECT ending FROM run ORDER BY id") {
        assert_eq!(runs, "killed\nstopped");
    }
}

#[test]
fn down_ends_what_does_not_answer() {
    let service = Service::up(2);
    stop(service.daemon());
    let down = shoal(&["down", "--fleet", &service.name, "--format", "json"]).expect(0);
    assert_eq!(down.report["forced"], true, "{down}");
    assert!(down.stderr.contains("no answer within"), "{down}");
    assert_clean(&service.root);
    assert!(is_gone(service.daemon()));
}

#[test]
fn a_fleet_in_the_foreground_ends_with_a_signal() {
    let mut service = Service::up(2);
    service.json(&["down"]);
    let out = std::fs::File::create(service.directory.path().join("stdout")).unwrap();
    let mut child = service.command().stdin(Stdio::null()).stdout(out).stderr(Stdio::null()).spawn().unwrap();
    let text = || std::fs::read_to_string(service.directory.path().join("stdout")).unwrap();
    let up: Value = wait_for("the fleet to run", || serde_json::from_str(&text()).ok());
    service.root = Path::new("/dev/shm").join(format!(
        "shoal-{}-{}",
        rustix::process::geteuid().as_raw(),
        up["fleet"].as_str().unwrap()
    ));
    assert_eq!(up["daemon_pid"], child.id());
    assert!(!processes_of(&service.root).is_empty());
    signal(child.id(), Signal::TERM);
    let status = wait_for("its end", || child.try_wait().unwrap());
    assert_eq!(status.code(), Some(0), "the end was asked for");
    assert_clean(&service.root);
    // `down` ends a run in the foreground as well.
    let mut fleet = crate::support::Run::scenario(&format!(
        "{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n",
        lanes(2, 1.0)
    ))
    .mode("realtime")
    .start();
    fleet.wait_tick(5);
    let (id, root) = (fleet.id(), fleet.root());
    shoal(&["logs", "--fleet", &id]).expect_failure(2, &["it keeps no log"]);
    shoal(&["down", "--fleet", &id]).expect(0);
    let ended = fleet.wait();
    assert!(ended.report["ticks"].as_u64() > Some(4), "{ended}");
    assert_clean(&root);
}

#[test]
fn what_keeps_a_fleet_from_starting_is_said_to_the_caller() {
    let directory = TempDir::with_prefix("shoal-e2e-").unwrap();
    let state = directory.path().join("state");
    let up =
        |more: &[&str]| shoal(&[&["up", "head-on", "--detach", "--state", state.to_str().unwrap()], more].concat());
    assert_eq!(up(&["--mode", "single"]).code, Some(2));
    up(&["--name", "a/b"]).expect_failure(2, &["name `a/b`", "letters"]);
    up(&["--name", "../x"]).expect_failure(2, &["name `../x`"]);
    up(&["--set", "robot[0].agent=\"no-such-agent\""]).expect_failure(3, &["no-such-agent"]);
    std::fs::write(state.join("fleet.db"), "a text, and not a database at all").unwrap();
    up(&["--name", "f"]).expect_failure(3, &["fleet.db", "it is not a database", "--state"]);
    assert_eq!(std::fs::read_to_string(state.join("fleet.db")).unwrap(), "a text, and not a database at all");
    std::fs::remove_dir_all(&state).unwrap();
    std::fs::write(&state, "").unwrap();
    up(&["--name", "f"]).expect_failure(3, &["state", "--state"]);
    shoal(&["up", "nowhere"]).expect_failure(2, &["nowhere"]);
}

#[test]
fn robots_come_and_go_in_a_fleet_that_is_left_running() {
    let service = Service::up(3);
    let area = ["--set", "x_m=[-0.5, 2.5]", "--set", "y_m=[4.8, 5.6]"];
    let add = |more: &[&str]| service.ask(&[&["add", "--layout", "random"], &area[..], more].concat());
    add(&["--count", "0"]).expect_failure(2, &["--count 0"]);
    add(&["--count", "2", "--id", "x"]).expect(2);
    add(&["--count", "9", "--set", "spread_m=5"]).expect_failure(2, &["no room"]);
    let added = add(&["--count", "3", "--format", "json"]).expect(0).report;
    let robots = added["robots"].as_array().unwrap_or_else(|| panic!("{added:#}"));
    assert_eq!(robots.iter().map(|robot| robot["slot"].clone()).collect::<Vec<_>>(), [3, 4, 5], "{added:#}");
    assert_eq!(added["failures"].as_array().map(Vec::len), Some(0), "{added:#}");
    assert!(robots.iter().all(|robot| robot["joined_ms"].as_f64() > Some(1.0)), "{added:#}");

    // A task that was sent to a robot by name fails with it; one for which it was chosen goes to another one.
    let name = robots[0]["robot"].as_str().unwrap();
    let pid = service.agent(name).unwrap();
    service.json(&["task", "send", name, "0,5.2", "--id", "by-name"]);
    let chosen = service.json(&["task", "send", "--assign", "nearest", "2.5,0", "--id", "chosen"]);
    let chosen = chosen["robot"].as_str().unwrap().to_owned();
    let removed = service.json(&["remove", &chosen]);
    assert_eq!((&removed["schema"], &removed["robot"]), (&"shoal.remove/1".into(), &chosen.as_str().into()));
    let task = service.json(&["task", "show", "chosen"]);
    let holder = task["tasks"][0]["robot"].as_str().unwrap();
    assert!(holder != chosen || task["tasks"][0]["state"] == "done", "{task:#}");
    service.ask(&["task", "wait", "chosen", "--timeout", "60s"]).expect(0);
    service.json(&["remove", name]);
    wait_for("its process to end", || is_gone(pid).then_some(()));
    let task = service.json(&["task", "show", "by-name"]);
    assert!(["done", "failed"].contains(&task["tasks"][0]["state"].as_str().unwrap()), "{task:#}");

    let again = service.json(&["add", "--id", name, "--start", "1.2,1", "--goal", "1.2,1"]);
    assert_eq!((&again["slot"], &again["incarnation"]), (&robots[0]["slot"], &1.into()), "{again:#}");
    service.json(&["down"]);
    assert_clean(&service.root);
    if let Some(events) = service
        .sql(&format!("SELECT name FROM event WHERE robot = '{name}' AND name IN ('joined', 'left') ORDER BY id"))
    {
        assert_eq!(events, "joined\nleft\njoined", "the database has both");
    }
}
