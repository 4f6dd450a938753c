//! A fleet's address that removes everything when the test ends, and processes that join it.
#![expect(clippy::disallowed_methods, reason = "tests start processes")]

use shoal_bus::{Address, Lease, clean};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// The root of the fleet that a child process of a test is to join.
const ROOT: &str = "SHOAL_BUS_TEST_ROOT";

/// An address of one's own, swept at the end. The lease keeps others' clean-up away from it.
pub(crate) struct Home(pub(crate) Address, pub(crate) Option<Lease>);

impl Home {
    pub(crate) fn new() -> Home {
        let address = Address::create().expect("tests need a tmpfs in /dev/shm");
        let lease = Lease::take(&address).unwrap();
        Home(address, Some(lease))
    }

    /// Runs the test `processes::role` of this test binary in a process of its own. In there, [`home_of_child`] is this address.
    pub(crate) fn spawn(&self, role: &str) -> Process {
        let child = Command::new(std::env::current_exe().unwrap())
            .args([&format!("processes::{role}"), "--exact", "--nocapture", "--test-threads=1"])
            .env(ROOT, self.0.root())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        Process(child)
    }
}

impl Drop for Home {
    fn drop(&mut self) {
        let report = clean::sweep(&self.0);
        assert!(report.left.is_empty(), "{:?}", report.left);
    }
}

/// In a child: the fleet to join. `None` in an ordinary test run, where roles have nothing to do.
pub(crate) fn home_of_child() -> Option<Address> {
    std::env::var(ROOT).ok().map(|root| Address::at(Path::new(&root)).unwrap())
}

/// A process that is killed at the end, if it lives.
pub(crate) struct Process(pub(crate) Child);

impl Process {
    /// SIGKILL, and gone.
    pub(crate) fn kill(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}
