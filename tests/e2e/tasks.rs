//! Tasks that robots bid for, and tasks that cannot be kept.

use crate::places::Permit;
use crate::service::Service;
use crate::support::{Ended, PrivateShm, assert_clean, example, lanes, run};
use tempfile::TempDir;

/// The robot next to the goal says that it has a long way to go: it gets the task by the shortest way as the daemon reckons it,
/// and not by an auction.
#[test]
fn robots_bid_with_what_they_say_themselves() {
    let scenario = format!("{}agent = {:?}\n", lanes(3, 1.0), example("lying_agent"));
    let scenario = format!("{scenario}[fleet]\ncommand_timeout_s = 30\n");
    let service = Service::of(scenario, &[("SHOAL_MORE_M", "50")]);
    service.ask(&["task", "send", "c", "1,4", "--id", "there"]).expect(0);
    service.ask(&["task", "wait", "there"]).expect(0);
    let nearest = service.json(&["task", "send", "--assign", "nearest", "1,4"]);
    assert_eq!(nearest["robot"], "c", "{nearest:#}");
    let auctioned = service.json(&["task", "send", "--assign", "auction", "1,3.2"]);
    assert_eq!((&auctioned["robot"], &auctioned["assign"]), (&"b".into(), &"auction".into()), "{auctioned:#}");
    // The lowest bids of two rounds: 0.5 m of the first robot, and then 0.7 m of the second.
    service.ask(&["task", "wait", "--all"]).expect(0);
    let two = service.json(&["task", "send", "--assign", "auction", "1,2.5", "1,0.5"]);
    let robots: Vec<&str> =
        two["tasks"].as_array().unwrap().iter().map(|task| task["robot"].as_str().unwrap()).collect();
    assert_eq!(robots, ["b", "a"], "{two:#}");
    service.ask(&["task", "wait", "--all"]).expect(0);
    service.json(&["down"]);
    assert_clean(&service.root);
}

#[test]
fn a_task_that_cannot_be_kept_is_the_fault_of_the_machine_and_the_fleet_goes_on() {
    let _permit = Permit::take(1);
    let Some(machine) = PrivateShm::new("-t tmpfs -o size=128m tmpfs") else { return };
    let disk = |script: &str| {
        let mut command = machine.command("sh");
        command.args(["-c", script]);
        run(command)
    };
    disk("mkdir /dev/shm/state && mount -t tmpfs -o size=1m,mode=700 tmpfs /dev/shm/state").expect(0);
    let directory = TempDir::with_prefix("shoal-e2e-").unwrap();
    let path = directory.path().join("scenario.toml");
    std::fs::write(&path, format!("{}[fleet]\ncommand_timeout_s = 30\n", lanes(2, 1.0))).unwrap();
    let ask = |args: &[&str]| {
        let mut command = machine.shoal();
        command.args(args);
        run(command)
    };
    let up = ["up", path.to_str().unwrap(), "--name", "full", "--state", "/dev/shm/state", "--detach"];
    ask(&up).expect(0);
    ask(&["task", "send", "a", "1,0", "--fleet", "full"]).expect(0);
    let filled = disk("cat /dev/zero > /dev/shm/state/filler");
    assert!(filled.stderr.contains("No space left"), "{filled}");
    // The database may have some room of its own.
    let failed: Option<Ended> =
        (0..40).map(|_| ask(&["task", "send", "b", "1,2", "--fleet", "full"])).find(|sent| sent.code != Some(0));
    let failed = failed.expect("no disk is endless");
    failed.expect_failure(3, &["fleet.db", "the disk is full", "the fleet goes on"]);
    let ps = ask(&["ps", "--fleet", "full", "--format", "json"]).expect(0);
    assert_eq!(ps.report["fleets"][0]["world_state"], "running", "{ps}");
    disk("rm /dev/shm/state/filler").expect(0);
    ask(&["task", "send", "b", "1,2", "--fleet", "full", "--id", "again"]).expect(0);
    ask(&["task", "wait", "again", "--fleet", "full"]).expect(0);
    ask(&["down", "--fleet", "full"]).expect(0);
}
