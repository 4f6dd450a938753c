//! What the machine does not allow is said before anything is started, with the way out; other users are strangers.

use crate::support::{PrivateShm, Run, SHOAL, assert_clean, lanes, run, shoal, signal};
use rustix::process::{Signal, geteuid};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

#[test]
fn agents_that_cannot_be_executed() {
    let dir = TempDir::new().unwrap();
    let plain = dir.path().join("plain");
    std::fs::write(&plain, "not a program").unwrap();
    std::fs::set_permissions(&plain, std::fs::Permissions::from_mode(0o644)).unwrap();
    let check = |agent: &std::path::Path, problem: &str| {
        let scenario = format!("{}agent = {agent:?}\n", lanes(2, 1.0));
        for mode in ["lockstep", "realtime"] {
            let ended = Run::scenario(&scenario).mode(mode).finish();
            let ended = ended.expect_failure(3, &["robot `b`", &agent.display().to_string(), problem]);
            assert!(ended.stdout.is_empty(), "{ended}");
        }
    };
    check(&dir.path().join("missing"), "No such file");
    check(&plain, "not executable");
    check(dir.path(), "it is a directory");
}

/// Runs a scenario where `/dev/shm` is something else.
fn refused(mount: &str, robots: &str, words: &[&str]) {
    let Some(machine) = PrivateShm::new(mount) else { return };
    let before = std::fs::read_dir(machine.path()).unwrap().count();
    for mode in ["lockstep", "realtime"] {
        let run =
            Run::scenario_by(machine.shoal(), &lanes(2, 1.0)).mode(mode).set(&format!("fleet.max_robots={robots}"));
        let ended = run.finish().expect_failure(3, words);
        assert!(ended.stdout.is_empty(), "{ended}");
        assert_eq!(std::fs::read_dir(machine.path()).unwrap().count(), before, "nothing is left\n{ended}");
    }
}

#[test]
fn shared_memory_is_too_small() {
    refused("-t tmpfs -o size=1m tmpfs", "10", &["/dev/shm", "10 robots need", "are free", "enlarge"]);
}

#[test]
fn shared_memory_gives_every_file_a_huge_page() {
    refused("-t tmpfs -o size=256m,huge=always tmpfs", "10", &["10 robots need", "huge=always", "huge=never"]);
    // Where there is room for them, a fleet runs.
    let Some(machine) = PrivateShm::new("-t tmpfs -o size=2g,huge=always tmpfs") else { return };
    let run = Run::scenario_by(machine.shoal(), &lanes(2, 1.0)).mode("lockstep").set("fleet.max_robots=2");
    run.finish().expect(0);
}

#[test]
fn shared_memory_has_too_few_files() {
    refused("-t tmpfs -o nr_inodes=40 tmpfs", "10", &["/dev/shm", "files"]);
}

#[test]
fn shared_memory_is_read_only() {
    refused("-t tmpfs -o ro tmpfs", "10", &["/dev/shm", "Read-only", "writable"]);
}

#[test]
fn shared_memory_is_a_disk() {
    let dir = TempDir::new().unwrap();
    // Only if the temporary directory is no tmpfs itself.
    let kind = run({
        let mut command = Command::new("stat");
        command.args(["-f", "-c", "%T"]).arg(dir.path());
        command
    });
    if kind.stdout.trim() == "tmpfs" {
        return eprintln!("skipped: {} is a tmpfs", dir.path().display());
    }
    refused(&format!("--bind {}", dir.path().display()), "10", &["/dev/shm", "not a tmpfs", "mount"]);
}

#[test]
fn shared_memory_fills_up_while_the_fleet_runs() {
    let Some(machine) = PrivateShm::new("-t tmpfs -o size=64m tmpfs") else { return };
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(2, 1.0));
    let mut fleet = Run::scenario_by(machine.shoal(), &scenario).mode("realtime").set("world.y_m=[-4, 4]").start();
    let id = fleet.id();
    fleet.agent(1);
    crate::support::wait_for("the fleet to run", || {
        let mut ps = machine.shoal();
        ps.args(["ps", "--format", "json"]);
        let tick = run(ps).report["fleets"][0]["tick"].as_u64();
        (tick.is_some_and(|tick| tick > 5)).then_some(())
    });
    let mut fill = Command::new("dd");
    fill.args(["if=/dev/zero", "bs=1M", "count=100"]).arg(format!("of={}", machine.path().join("filler").display()));
    run(fill).expect(1);
    // The robots that are there have all the memory that they need, and an operator needs none. One more robot does: it is
    // not started, which is said, and the fleet goes on.
    let mut add = machine.shoal();
    add.args(["add", "--fleet", &id, "--id", "late", "--start", "0,-2", "--goal", "1,-2"]);
    run(add).expect_failure(3, &["robot `late`: not confirmed", "No space left on device"]);
    fleet.wait_said("No space left on device");
    assert!(!fleet.has_ended());
    signal(fleet.daemon(), Signal::INT);
    let ended = fleet.wait();
    // If what is free is too little for the outcome of the run, that is what is said.
    if ended.code == Some(130) {
        assert_eq!(ended.report["verdict"], "impaired", "{ended}");
        ended.event("not-started", "late");
    } else {
        ended.expect_failure(3, &["world-sim", "No space left"]);
    }
    assert_eq!(std::fs::read_dir(machine.path()).unwrap().count(), 1, "only the filler is left");
}

/// Anyone may make names in /dev/shm. Those that look like this user's fleets and are not are left alone, and take no part.
#[test]
fn names_that_others_made_beforehand_have_no_effect() {
    let Some(machine) = PrivateShm::new("-t tmpfs -o size=256m tmpfs") else { return };
    let (shm, outside) = (machine.path(), TempDir::new().unwrap());
    let victim = outside.path().join("precious");
    std::fs::write(&victim, "kept").unwrap();
    let name = |id: &str| shm.join(format!("shoal-0-{id}"));
    let foreign = |path: &Path| std::os::unix::fs::lchown(path, Some(65534), Some(65534)).unwrap();
    // A directory, a file and a link to a directory of someone else, and a link of this user.
    std::fs::create_dir(name("aaaaaa2")).unwrap();
    std::fs::write(name("aaaaaa2").join("operator"), "not a socket").unwrap();
    foreign(&name("aaaaaa2"));
    std::fs::write(name("aaaaaa3"), "not a directory").unwrap();
    foreign(&name("aaaaaa3"));
    std::os::unix::fs::symlink(outside.path(), name("aaaaaa4")).unwrap();
    foreign(&name("aaaaaa4"));
    std::os::unix::fs::symlink(outside.path(), name("aaaaaa5")).unwrap();

    let shoal = |args: &[&str]| {
        let mut command = machine.shoal();
        command.args(args);
        run(command)
    };
    assert_eq!(shoal(&["ps", "--format", "json"]).expect(0).report["fleets"], serde_json::json!([]));
    for id in ["aaaaaa2", "aaaaaa3", "aaaaaa4", "aaaaaa5"] {
        for verb in [&["ps"][..], &["metrics"], &["task", "send", "a", "0,0"], &["inject", "kill", "a"]] {
            let ended = shoal(&[verb, &["--fleet", id]].concat());
            assert!(matches!(ended.code, Some(2 | 3)) && ended.stderr.starts_with("error: "), "{id} {verb:?}\n{ended}");
        }
    }
    shoal(&["run", "head-on", "--mode", "lockstep"]).expect(0);
    shoal(&["clean"]).expect(0);
    assert_eq!(std::fs::read_to_string(&victim).unwrap(), "kept");
    assert!(name("aaaaaa2").join("operator").exists() && name("aaaaaa3").exists(), "they are someone else's");
}

#[test]
fn another_user_is_a_stranger() {
    if !geteuid().is_root() {
        return eprintln!("skipped: another user needs root");
    }
    // Somewhere the other user can execute it.
    let dir = TempDir::new().unwrap();
    std::fs::set_permissions(dir.path(), std::fs::Permissions::from_mode(0o755)).unwrap();
    let copy = dir.path().join("shoal");
    std::fs::copy(SHOAL, &copy).unwrap();
    let stranger = |args: &[&str]| {
        let mut command = Command::new("setpriv");
        command.args(["--reuid=65534", "--regid=65534", "--clear-groups"]).arg(&copy).args(args).current_dir("/");
        command
    };
    let scenario = format!("{}\n[clock]\nstop = \"duration\"\nduration_s = 36000\n", lanes(2, 1.0));
    let mut fleet = Run::scenario(&scenario).mode("realtime").start();
    let (root, id) = (fleet.root(), fleet.id());
    fleet.wait_tick(1);
    for entry in std::fs::read_dir("/dev/shm").unwrap().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        // iceoryx2 makes its counter of nodes for everybody; it holds nothing else.
        if name.contains(&id) && !name.ends_with(".global_mgmt") {
            let mode = entry.metadata().unwrap().mode();
            assert_eq!(mode & 0o077, 0, "{:?} is open to others: {mode:o}", entry.path());
        }
    }
    let path = root.to_str().unwrap();
    for args in [
        vec!["world", "--root", path, "--parent", "1"],
        vec!["agent", "--root", path, "--slot", "0", "--incarnation", "0", "--parent", "1"],
        vec!["add", "--fleet", &id, "--start", "0,0.9", "--goal", "1,0.9"],
        vec!["task", "send", "a", "0,0", "--fleet", &id],
        vec!["clean"],
        vec!["guardian", "--root", path],
    ] {
        let ended = run(stranger(&args));
        assert!(!ended.stdout.contains(&id), "{args:?}\n{ended}");
    }
    // Every verb that names the fleet is refused, with the reason.
    for words in ["ps", "latency", "metrics", "add --start 0,0.9 --goal 1,0.9", "task send a 0,0", "inject kill a"] {
        let args: Vec<&str> = words.split(' ').chain(["--fleet", &id]).collect();
        run(stranger(&args)).expect_failure(2, &["belongs to another user (uid 0)", "sudo -u"]);
    }
    let mut list = Command::new("setpriv");
    list.args(["--reuid=65534", "--regid=65534", "--clear-groups", "ls", path]);
    assert_eq!(run(list).stdout, "", "its files are not even listed");
    let cleaned = run(stranger(&["ps", "--format", "json"])).expect(0);
    assert!(!cleaned.stdout.contains(&id), "{cleaned}");
    // A fleet of its own is no different from anybody's.
    run(stranger(&["run", "head-on", "--mode", "lockstep"])).expect(0);

    assert_eq!(fleet.processes().len(), 4);
    let tick = fleet.tick();
    fleet.wait_tick(tick + 10);
    shoal(&["task", "send", "a", "0,0", "--fleet", &id]).expect(0);
    signal(fleet.daemon(), Signal::INT);
    fleet.wait().expect(130);
    assert_clean(&root);
}
