//! Unix datagram sockets: every robot has one that it receives on and one connected to everybody else's. A thread blocks
//! in `recv` and keeps the newest pose of everybody. A full queue (`net.unix.max_dgram_qlen`, 10 by default) loses the
//! pose: a robot does not wait for another one.

use poses::{Args, Failure, Latest, Pose, Transport};
use rustix::io::Errno;
use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::process::ExitCode;

struct Datagrams {
    latest: Latest,
    /// Sockets towards the others, connected or not yet.
    towards: Vec<(PathBuf, Option<UnixDatagram>)>,
}

fn open(args: &Args) -> Result<Datagrams, Failure> {
    let path = |robot: usize| args.directory.join(format!("pose-{robot}"));
    let mine = UnixDatagram::bind(path(args.robot))?;
    let latest = Latest::new(args.robots);
    let received = latest.clone();
    std::thread::Builder::new().name("receive".into()).spawn(move || {
        // One byte more than a pose: longer ones are not taken for one.
        let mut bytes = [0; Pose::BYTES + 1];
        loop {
            match mine.recv(&mut bytes) {
                Ok(len) => received.receive(&bytes[..len]),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => {
                    eprintln!("error: cannot receive: {e}");
                    std::process::exit(1);
                }
            }
        }
    })?;
    Ok(Datagrams { latest, towards: args.others().map(|robot| (path(robot), None)).collect() })
}

impl Transport for Datagrams {
    fn connect(&mut self) -> Result<(), Failure> {
        for (path, socket) in &mut self.towards {
            if socket.is_some() {
                continue;
            }
            let fresh = UnixDatagram::unbound()?;
            fresh.set_nonblocking(true)?;
            match fresh.connect(&path) {
                Ok(()) => *socket = Some(fresh),
                Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::ConnectionRefused) => {}
                Err(e) => return Err(format!("{}: {e}", path.display()).into()),
            }
        }
        Ok(())
    }

    fn publish(&mut self, pose: &Pose) -> Result<(), Failure> {
        let bytes = pose.to_bytes();
        for (path, socket) in &self.towards {
            let Some(socket) = socket else { continue };
            match socket.send(&bytes) {
                Ok(_) => {}
                Err(e) if e.kind() == ErrorKind::WouldBlock => {}
                // Its robot has gone: at the end they do so one after the other.
                Err(e) if e.raw_os_error() == Some(Errno::CONNREFUSED.raw_os_error()) => {}
                Err(e) => return Err(format!("{}: {e}", path.display()).into()),
            }
        }
        Ok(())
    }

    fn newest(&mut self, robot: usize) -> Option<Pose> {
        self.latest.newest(robot)
    }
}

fn main() -> ExitCode {
    poses::run(open)
}
