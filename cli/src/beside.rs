//! The view of a run (`shoal run --view`): a process of its own beside the fleet, which ends with it.

use crate::exit::Failure;
use bus::clock;
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use std::io::Read;
use std::process::{Child, ChildStdout, Command, Stdio};

/// A view that has not ended this long after its fleet is killed.
const GRACE_NS: u64 = 2_000_000_000;
const LOOK_EVERY_NS: u64 = 10_000_000;

/// The process, and what it has printed so far.
pub(crate) struct View {
    process: Child,
    out: ChildStdout,
    printed: Vec<u8>,
    said: bool,
}

impl View {
    /// Starts the view of this fleet.
    ///
    /// # Errors
    /// When there can be no process.
    #[expect(clippy::disallowed_methods, reason = "the command line starts the process that was asked for")]
    pub(crate) fn start(fleet: &str, port: u16) -> Result<View, Failure> {
        let failed = |error: std::io::Error| Failure::environment(format!("view: cannot start its process: {error}"));
        let mut command = Command::new("/proc/self/exe");
        command.args([
            "view",
            "--fleet",
            fleet,
            "--port",
            &port.to_string(),
            "--parent",
            &std::process::id().to_string(),
        ]);
        let mut process = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().map_err(failed)?;
        let out = process.stdout.take().expect("it is piped");
        let flags = fcntl_getfl(&out).map_err(|error| failed(error.into()))?;
        fcntl_setfl(&out, flags | OFlags::NONBLOCK).map_err(|error| failed(error.into()))?;
        Ok(View { process, out, printed: Vec::new(), said: false })
    }

    /// The address to open, as soon as it is known: once.
    pub(crate) fn address(&mut self) -> Option<String> {
        if self.said {
            return None;
        }
        let mut bytes = [0; 256];
        while let Ok(count) = self.out.read(&mut bytes)
            && count > 0
        {
            self.printed.extend_from_slice(&bytes[..count]);
        }
        let end = self.printed.iter().position(|byte| *byte == b'\n')?;
        self.said = true;
        Some(String::from_utf8_lossy(&self.printed[..end]).into_owned())
    }

    /// Waits for its end, which comes shortly after that of the fleet.
    pub(crate) fn finish(mut self) {
        let deadline_ns = clock::now_ns() + GRACE_NS;
        while clock::now_ns() < deadline_ns {
            if !matches!(self.process.try_wait(), Ok(None)) {
                return;
            }
            clock::sleep_until_ns(clock::now_ns() + LOOK_EVERY_NS);
        }
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
