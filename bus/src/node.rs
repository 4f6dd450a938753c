//! One participant of a fleet: the iceoryx2 node of a process.
#![expect(clippy::disallowed_methods, reason = "SHOAL_LOG is read here")]

use crate::{Address, BusError, Result};
use iceoryx2::prelude::*;
use std::os::unix::fs::MetadataExt;
use std::sync::Once;
use std::time::Duration;

pub(crate) use crate::variant::Ipc;

/// What iceoryx2 puts in front of the names of its files. The root tells fleets apart.
const PREFIX: &[u8] = b"iox2.";
/// How long an opener waits for a service that another process is just creating.
const CREATION_TIMEOUT: Duration = Duration::from_secs(2);

/// A process's membership in a fleet. One per process; ports keep it alive.
#[derive(Debug)]
pub struct Node {
    inner: iceoryx2::node::Node<Ipc>,
    address: Address,
}

impl Node {
    /// Joins the fleet at `address`. `name` is for people who look with iceoryx2's tools.
    ///
    /// iceoryx2's own clean-up is off: left on, every node that comes or goes looks at every other one, which makes a
    /// start quadratic. The daemon's [`janitor`](crate::Node::clear_dead) does it instead. Its signal handlers are off
    /// as well, and it logs nothing unless the environment variable `SHOAL_LOG` names a level.
    ///
    /// # Errors
    /// When the fleet's directory is gone, or shared memory or open files have run out.
    pub fn new(address: &Address, name: &str) -> Result<Node> {
        quiet();
        let object = format!("node `{name}` of fleet `{}`", address.id());
        let failed = |cause: &dyn std::fmt::Debug| BusError::port(&object, "join the fleet", cause);
        // iceoryx2 would make a missing root again, for every user to look into.
        Address::at(address.root())?;
        let before = identity(address);
        let mut config = Config::default();
        config.global.prefix = FileName::new(PREFIX).map_err(|e| failed(&e))?;
        let root = address.root().as_os_str().as_encoded_bytes();
        config.global.set_root_path(&Path::new(root).map_err(|e| failed(&e))?);
        config.global.creation_timeout = CREATION_TIMEOUT;
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
        let inner = NodeBuilder::new()
            .name(&NodeName::new(name).map_err(|e| failed(&e))?)
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Ipc>()
            .map_err(|e| failed(&e));
        if identity(address) != before {
            // The fleet ended meanwhile, and this made its root anew: nobody else would remove it.
            drop(inner);
            crate::clean::sweep(address);
            return Err(BusError::gone(address.root()));
        }
        let inner = inner?;
        Ok(Node { inner, address: address.clone() })
    }

    /// The fleet it belongs to.
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// Clears away what dead members of the fleet hold in iceoryx2: their places in services, and their memory. How many
    /// were cleared. For the janitor's process. It looks at every node of the fleet (some 0.1 ms each), and leaves to
    /// another thread of this process what that is just clearing.
    pub fn clear_dead(&self) -> u64 {
        self.inner.try_cleanup_dead_nodes().cleanups
    }

    pub(crate) fn service(&self, name: &str) -> iceoryx2::service::builder::Builder<Ipc> {
        let name = ServiceName::new(name).expect("our service names are short and plain");
        self.inner.service_builder(&name)
    }
}

/// The name of a service that a world offers. What a killed world was writing can never be written again: the next one has
/// a service of its own.
pub(crate) fn of_world(service: &str, incarnation: u32) -> String {
    if incarnation == 0 { service.to_owned() } else { format!("{service}-{incarnation}") }
}

/// Tells a root from one of the same name that was made later; `None` if there is none.
fn identity(address: &Address) -> Option<(u64, u64)> {
    std::fs::symlink_metadata(address.root()).ok().map(|meta| (meta.dev(), meta.ino()))
}

/// Keeps iceoryx2 silent, or as loud as `SHOAL_LOG` says. It writes to stderr only.
fn quiet() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let level = match std::env::var("SHOAL_LOG").unwrap_or_default().to_ascii_lowercase().as_str() {
            "trace" => LogLevel::Trace,
            "debug" => LogLevel::Debug,
            "info" => LogLevel::Info,
            "warn" => LogLevel::Warn,
            "error" => LogLevel::Error,
            _ => LogLevel::Fatal,
        };
        set_log_level(level);
    });
}
