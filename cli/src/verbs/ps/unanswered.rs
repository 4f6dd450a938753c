//! A fleet whose daemon does not answer (it is stopped, or hangs): what its files, its boards and the kernel say.

use crate::exit::Failure;
use crate::verbs::fleet;
use bus::{Address, Gate, Helmsman, Node, WorldObserver};
use daemon::processes::state_of;
use daemon::status::{self, RobotProcess};
use model::{ProcessState, RobotIndex, RobotInstance, Scenario};
use protocol::daemon_to_robot::AgentSpec;
use protocol::operator_to_daemon::Status;
use std::collections::BTreeMap;

/// The fleet at `address`, as far as it can be known.
///
/// # Errors
/// When its files cannot be read.
pub(super) fn status(address: &Address) -> Result<Status, Failure> {
    let mut scenario: Scenario = fleet::left(address, world_sim::shell::SCENARIO_FILE)?;
    let instances = instances(address);
    // Robots that were added come after those of the scenario.
    while let Some(instance) = instances.get(&RobotIndex::of(scenario.robots.len())) {
        let spec: AgentSpec = fleet::left(address, &robot_agent::shell::spec_file(*instance))?;
        scenario.robots.push(spec.robot);
    }
    let node = Node::new(address, "operator")?;
    let gate = Gate::open(address)?;
    let observer = WorldObserver::open(&node, gate.world_incarnation())?;
    let processes_of_robots = (0..scenario.robots.len()).map(RobotIndex::of).map(|index| match instances.get(&index) {
        None => RobotProcess {
            instance: RobotInstance { index, incarnation: 0 },
            pid: None,
            state: ProcessState::Awaited,
            restarts: 0,
        },
        Some(instance) => {
            // Whether another robot had the slot before, only the daemon knows.
            let restarts = instance.incarnation;
            let process = gate.process(*instance).map(|pid| (pid, state_of(pid)));
            match process.filter(|(_, state)| *state != ProcessState::Ended) {
                Some((pid, state)) => RobotProcess { instance: *instance, pid: Some(pid), state, restarts },
                None => RobotProcess { instance: *instance, pid: None, state: ProcessState::Dead, restarts },
            }
        }
    });
    let (daemon_pid, world_pid) = processes(address);
    Ok(status::of(&scenario, processes_of_robots, &gate, &observer, daemon_pid, world_pid))
}

/// The newest incarnation of every robot: each has a file that says what it is.
fn instances(address: &Address) -> BTreeMap<RobotIndex, RobotInstance> {
    let files = std::fs::read_dir(address.root()).into_iter().flatten().flatten();
    let mut instances: Vec<RobotInstance> =
        files.filter_map(|file| bus::stats::instance_of(file.file_name().to_str()?)).collect();
    instances.sort_by_key(|instance| (instance.index, instance.incarnation));
    instances.into_iter().map(|instance| (instance.index, instance)).collect()
}

/// The daemon and the world, 0 for what is not found. A fleet that is left running says in a file who its daemon is; of another one
/// the world says on its command line who started it.
pub(crate) fn processes(address: &Address) -> (u32, u32) {
    let fleets = bus::clean::list_fleets().unwrap_or_default();
    let pids =
        fleets.into_iter().find(|fleet| fleet.address == *address).map_or_else(Vec::new, |fleet| fleet.processes);
    let words = |pid: u32| -> Vec<String> {
        #[expect(clippy::disallowed_methods, reason = "the verb reads /proc")]
        let line = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        line.split(|byte| *byte == 0).map(|word| String::from_utf8_lossy(word).into_owned()).collect()
    };
    let world = pids.into_iter().find(|pid| words(*pid).get(1).is_some_and(|verb| verb == "world"));
    if let Some(daemon) = Helmsman::of(address) {
        return (if daemon.lives() { daemon.pid() } else { 0 }, world.unwrap_or(0));
    }
    let Some(world) = world else { return (0, 0) };
    let words = words(world);
    let parent = words.iter().position(|word| word == "--parent").and_then(|at| words.get(at + 1)?.parse().ok());
    (parent.unwrap_or(0), world)
}
