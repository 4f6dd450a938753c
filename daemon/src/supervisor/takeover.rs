//! A fleet that is left running and whose daemon has ended gets another daemon. Its world and its robots go on meanwhile,
//! and are not touched by this.

use super::{Supervisor, Watch, serve_until_the_end};
use crate::coordinator::{Coordinator, Robots};
use crate::error::{Error, Kind};
use crate::executables::Executables;
use crate::guardian::Guardian;
use crate::janitor::Janitor;
use crate::processes::{Children, Who, now};
use crate::service::{Service, StateDir};
use crate::signals::Signals;
use crate::supervisor::Finished;
use crate::supervisor::worlds::Worlds;
use bus::clean::{NAME_FILE, STATE_FILE};
use bus::{
    Address, Footing, Gate, Helm, Helmsman, Lease, Node, NoticeReceiver, OperatorServer, OrderSender, Services,
    WorldObserver,
};
use model::{RobotInstance, Scenario};
use protocol::{FLEET_VERSION, codec};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;
use std::path::PathBuf;
use std::time::Duration;
use world_sim::outcome_file::OutcomeFile;
use world_sim::shell::SCENARIO_FILE;

/// A fleet without a daemon, which this process is about to become.
pub struct Orphan {
    address: Address,
    helm: Helm,
    name: String,
    state: StateDir,
}

impl Orphan {
    /// Takes the daemon's place at a fleet.
    ///
    /// # Errors
    /// When it is not a fleet that is left running, has a daemon, or is of another version; when its state directory is
    /// another process's.
    pub fn take(address: Address) -> Result<Orphan, Error> {
        let fleet = format!("fleet `{}`", address.id());
        let (Some(name), Some(state)) = (read(&address, NAME_FILE), read(&address, STATE_FILE)) else {
            return Err(Error::new(Kind::Process, format!("{fleet}: it is not one that is left running"))
                .hint("only fleets that `shoal up` has started outlive their daemon"));
        };
        let before = Helmsman::of(&address);
        let Some(helm) = Helm::take(&address)? else {
            let pid = before.map_or_else(String::new, |before| format!(" (process {})", before.pid()));
            return Err(Error::new(Kind::Process, format!("{fleet}: its daemon runs{pid}"))
                .hint("`shoal ps` shows it; `shoal down` ends the fleet"));
        };
        if let Some(before) = before.filter(|before| before.fleet_version != FLEET_VERSION) {
            let problem = format!(
                "{fleet}: it was started by shoal {}, whose processes speak version {} of the fleet's protocol; this \
                 executable speaks version {FLEET_VERSION}",
                before.build, before.fleet_version
            );
            return Err(Error::new(Kind::Process, problem).hint(
                "take it over with the executable that started it, or end it: `shoal down --force`; its tasks are kept",
            ));
        }
        let name = String::from_utf8_lossy(&name).into_owned();
        let state = StateDir::take(&PathBuf::from(OsString::from_vec(state)))?;
        Ok(Orphan { address, helm, name, state })
    }

    /// Becomes its daemon, until the end of the fleet. What keeps it from that leaves the fleet as it is. With an
    /// `orphan_limit` the fleet has another one from here on.
    ///
    /// # Errors
    /// When the state directory, shared memory or a process fails it; later as [`serve`](super::serve).
    pub fn serve(self, orphan_limit: Option<Duration>, watch: &mut dyn Watch) -> Result<Finished, Error> {
        let service = Service { orphan_limit, ..Service::open(&self.name, self.state)? };
        let bytes = read(&self.address, SCENARIO_FILE).ok_or_else(|| {
            Error::new(Kind::Memory, format!("fleet `{}`: its scenario cannot be read", self.address.id()))
        })?;
        let mut scenario: Scenario = codec::decode(&bytes)
            .map_err(|error| Error::new(Kind::Memory, format!("scenario of fleet `{}`: {error}", self.address.id())))?;
        bus::attach_map(&self.address, scenario.map.as_mut())?;
        let executables = Executables::find(&scenario)?;
        let signals = Signals::install()
            .map_err(|error| Error::new(Kind::Process, format!("signals: cannot install handlers: {error}")))?;
        let mut supervisor = Supervisor::over(&self.address, scenario, executables, signals)?;
        if supervisor.children.world_pid().is_none() {
            supervisor.refuse_without_world()?;
        }
        self.helm.sign(&self.address, FLEET_VERSION, env!("CARGO_PKG_VERSION"))?;
        supervisor.helm = Some(self.helm);
        supervisor.begin_service(service, Robots::Running)?;
        serve_until_the_end(supervisor, Supervisor::go_on, watch)
    }
}

impl Supervisor {
    /// The supervisor of a fleet that runs.
    fn over(
        address: &Address,
        scenario: Scenario,
        executables: Executables,
        signals: Signals,
    ) -> Result<Supervisor, Error> {
        let lease = Lease::take(address)?;
        let gate = Gate::open(address)?;
        let incarnation = gate.world_incarnation();
        let left = OutcomeFile::open(address).map_err(|error| super::no_room(address, &error))?;
        let node = Node::new(address, "daemon")?;
        let services = Services::open(&node, incarnation)?;
        let mut children = Children::new(address, scenario.processes.clone(), executables);
        let (orders, notices) = (OrderSender::open(&node)?, NoticeReceiver::open(&node)?);
        let observer = WorldObserver::open(&node, incarnation)?;
        let operators = OperatorServer::open(address)?;
        let guardian = Guardian::start(address)?;
        let speaker = |who: Who| match who {
            Who::World => report::ProcessFacts::WORLD.to_owned(),
            Who::Agent(instance) => {
                scenario.robots.get(instance.index.at()).map_or_else(String::new, |robot| robot.id.clone())
            }
        };
        let mut begun: BTreeMap<RobotInstance, Option<u32>> =
            spec_files(address).into_iter().map(|instance| (instance, None)).collect();
        for (who, pid) in children.take_over(address, &gate, &speaker) {
            if let Who::Agent(instance) = who {
                begun.insert(instance, Some(pid));
            }
        }
        let begun: Vec<(RobotInstance, Option<u32>)> = begun.into_iter().collect();
        Ok(Supervisor {
            coordinator: Coordinator::adopted(scenario, &begun, std::process::id()),
            children,
            gate,
            footing: Footing::survey_running(address)?,
            footing_seen: now(),
            left,
            failures: Vec::new(),
            asked_at: None,
            orders,
            notices,
            operators,
            awaiting: Vec::new(),
            observer,
            worlds: Worlds::of(incarnation),
            signals,
            world_ending: None,
            killed: false,
            enough: false,
            spawned_ns: None,
            departed: BTreeMap::new(),
            specs: begun.iter().map(|(instance, _)| (instance.index, *instance)).collect(),
            keeper: None,
            helm: None,
            janitor: Janitor::new(address),
            address: address.clone(),
            node,
            services,
            guardian,
            _lease: lease,
        })
    }

    /// Asks the world how everything stands; one that has ended is replaced.
    fn go_on(&mut self) -> Result<(), Error> {
        let running = self.children.instances();
        for instance in spec_files(&self.address).into_iter().filter(|instance| !running.contains(instance)) {
            self.bury(instance);
        }
        self.janitor.want();
        if self.children.world_pid().is_some() {
            self.coordinator.resync();
            self.act(None);
            return Ok(());
        }
        self.replace_world()
    }
}

/// The instances that were started and have not been cleared away: each has a file that says what it is.
fn spec_files(address: &Address) -> Vec<RobotInstance> {
    let files = std::fs::read_dir(address.root()).into_iter().flatten().flatten();
    files.filter_map(|file| bus::stats::instance_of(file.file_name().to_str()?)).collect()
}

fn read(address: &Address, name: &str) -> Option<Vec<u8>> {
    #[expect(clippy::disallowed_methods, reason = "what a daemon of before has left in the root of the fleet")]
    std::fs::read(address.file(name)).ok()
}
