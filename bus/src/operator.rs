//! Requests of operators (a second terminal) and the daemon's replies: a unix socket in the root of the fleet.
//!
//! An operator is a command that lives for a moment, and may be killed in any of them. A socket leaves nothing of it
//! behind: the kernel closes the connection, and the daemon sees that. Operators need no iceoryx2 node, take no place
//! in any service, and as many may ask at once as want to.
//!
//! One connection carries one request and one reply, each with a `HEADER` in front: magic number, protocol version,
//! length. Whatever a client sends costs the daemon bounded memory and no wait: the sockets do not block, a connection
//! has `PATIENCE` to deliver its request and to take its reply, and of at most `CONNECTIONS_MAX` the one that has
//! been silent for the longest time makes room for the next.

use crate::clock::{now_ns, sleep_until_ns};
use crate::control::encoded;
use crate::{Address, BusError, Result};
use protocol::codec;
use protocol::operator_to_daemon::{PROTOCOL_VERSION, Reply, Request};
use rustix::event::epoll::{self, EventData, EventFlags};
use rustix::event::{PollFd, PollFlags, poll};
use std::cell::{Cell, RefCell};
use std::io::{ErrorKind, Read, Write};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::rc::Rc;
use std::time::Duration;

/// The socket's name in the root.
const NAME: &str = "operator";
const MAGIC: [u8; 4] = *b"shOp";
/// Magic number, protocol version and length of what follows, little-endian.
const HEADER: usize = 12;
const REQUEST_BYTES_MAX: usize = 16 * 1024;
/// The status of a thousand robots takes about 300 KiB.
const REPLY_BYTES_MAX: usize = 4 << 20;
/// Connections at the same time; further ones wait in the kernel's queue.
const CONNECTIONS_MAX: usize = 128;
/// How long a connection may take to deliver its request, and to take its reply.
const PATIENCE: Duration = Duration::from_secs(5);
/// A connection that has been silent, or has not read its reply, for this long makes room when all places are taken.
const IDLE: Duration = Duration::from_millis(200);
/// How long an operator sleeps between two attempts to connect.
const RETRY: Duration = Duration::from_millis(10);

/// What both ends of the server side share.
struct Shared {
    epoll: OwnedFd,
    /// Connections that exist: those that have not asked yet, those that wait for an answer, those that take theirs.
    connections: Cell<usize>,
    /// Replies that clients have not taken yet.
    replies: RefCell<Vec<Outgoing>>,
}

/// An open connection; gives its place back when it is dropped, and leaves epoll by being closed.
struct Connection {
    stream: UnixStream,
    shared: Rc<Shared>,
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.shared.connections.set(self.shared.connections.get() - 1);
    }
}

/// A connection that has not delivered its request yet.
struct Incoming {
    connection: Connection,
    bytes: Vec<u8>,
    since_ns: u64,
}

/// A connection that has not taken its reply yet.
struct Outgoing {
    connection: Connection,
    bytes: Vec<u8>,
    sent: usize,
    since_ns: u64,
}

/// The daemon's end, with a descriptor for `poll`: readable when there is something to take or to send.
///
/// Call [`OperatorServer::take`] until it gives nothing, and only then sleep; and now and then, for the time-outs.
pub struct OperatorServer {
    listener: UnixListener,
    incoming: Vec<Incoming>,
    shared: Rc<Shared>,
    noise: Noise,
}

/// What clients sent that is not a request.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Noise {
    /// How often, since the server was opened.
    pub count: u64,
    /// What was wrong with the newest; without control characters.
    pub newest: String,
}

impl OperatorServer {
    /// Becomes the process that answers for the fleet at `address`. There must be one at a time: the lease sees to that.
    ///
    /// # Errors
    /// When the fleet's directory is gone or open files have run out.
    pub fn open(address: &Address) -> Result<OperatorServer> {
        let path = address.file(NAME);
        let failed = |e: std::io::Error| BusError::io(&path, "make the operators' socket", e);
        // That of a daemon that was killed: nobody listens there.
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != ErrorKind::NotFound => return Err(failed(e)),
            _ => {}
        }
        let listener = UnixListener::bind(&path).map_err(failed)?;
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let epoll = epoll::create(epoll::CreateFlags::CLOEXEC).map_err(|e| failed(e.into()))?;
        epoll::add(&epoll, &listener, EventData::new_u64(0), EventFlags::IN).map_err(|e| failed(e.into()))?;
        let shared = Shared { epoll, connections: Cell::new(0), replies: RefCell::default() };
        Ok(OperatorServer { listener, incoming: Vec::new(), shared: Rc::new(shared), noise: Noise::default() })
    }

    /// What clients have sent that is not a request.
    pub fn noise(&self) -> &Noise {
        &self.noise
    }

    /// The next request, if there is one. What is not a request (a client of another version, noise) is answered in here
    /// or dropped. Replies that clients are slow to take are sent on.
    pub fn take(&mut self) -> Option<(Request, Responder)> {
        let now_ns = now_ns();
        self.shared.send_replies(now_ns);
        self.accept(now_ns);
        let mut index = 0;
        while index < self.incoming.len() {
            let heard = self.incoming[index].read();
            if matches!(heard, Heard::Nothing) && !expired(self.incoming[index].since_ns, now_ns, PATIENCE) {
                index += 1;
                continue;
            }
            let Incoming { connection, bytes, .. } = self.incoming.remove(index);
            match heard {
                Heard::Nothing | Heard::Gone => {}
                Heard::Frame => {
                    // From here on the client has nothing more to say: what epoll would report is that it went.
                    let _ = epoll::delete(&self.shared.epoll, &connection.stream);
                    let responder = Responder { connection };
                    match understood(&bytes) {
                        Ok(request) => return Some((request, responder)),
                        Err(problem) => {
                            self.noise.count += 1;
                            self.noise.newest = problem.escape_debug().to_string();
                            let hint = Some("use the executable that started the fleet".to_owned());
                            responder.reply(&Reply::Refused { problem, hint });
                        }
                    }
                }
            }
        }
        None
    }

    fn accept(&mut self, now_ns: u64) {
        loop {
            if self.shared.connections.get() >= CONNECTIONS_MAX {
                // The one that has been silent, or has not read, for the longest time goes, or the newcomer waits in the
                // kernel's queue.
                match self.incoming.first() {
                    Some(oldest) if expired(oldest.since_ns, now_ns, IDLE) => drop(self.incoming.remove(0)),
                    _ if self.shared.drop_unread(now_ns) => {}
                    _ => return,
                }
            }
            let Ok((stream, _)) = self.listener.accept() else { return };
            if stream.set_nonblocking(true).is_err() {
                continue;
            }
            // The data says nothing: all of them are looked at. Without a place in epoll the heartbeat finds it.
            let _ = epoll::add(&self.shared.epoll, &stream, EventData::new_u64(0), EventFlags::IN);
            self.shared.connections.set(self.shared.connections.get() + 1);
            let connection = Connection { stream, shared: Rc::clone(&self.shared) };
            self.incoming.push(Incoming { connection, bytes: Vec::new(), since_ns: now_ns });
        }
    }
}

impl AsFd for OperatorServer {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.shared.epoll.as_fd()
    }
}

fn expired(since_ns: u64, now_ns: u64, after: Duration) -> bool {
    u128::from(now_ns.saturating_sub(since_ns)) > after.as_nanos()
}

/// What there is of a request.
enum Heard {
    /// Not all of it yet.
    Nothing,
    /// All of it, or as much as tells that it is none.
    Frame,
    /// The client went.
    Gone,
}

impl Incoming {
    /// Reads what there is, no more than the frame.
    fn read(&mut self) -> Heard {
        loop {
            let wanted = match header(&self.bytes) {
                None => HEADER - self.bytes.len(),
                Some(Header { version: PROTOCOL_VERSION, len }) if len <= REQUEST_BYTES_MAX => {
                    HEADER + len - self.bytes.len()
                }
                Some(_) => 0,
            };
            if wanted == 0 {
                return Heard::Frame;
            }
            let mut buffer = [0; 4096];
            match self.connection.stream.read(&mut buffer[..wanted.min(4096)]) {
                Ok(0) => return Heard::Gone,
                Ok(read) => self.bytes.extend_from_slice(&buffer[..read]),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) if e.kind() == ErrorKind::WouldBlock => return Heard::Nothing,
                Err(_) => return Heard::Gone,
            }
        }
    }
}

/// What a header says; a wrong magic number counts as version 0.
struct Header {
    version: u32,
    len: usize,
}

fn header(bytes: &[u8]) -> Option<Header> {
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let (version, len) = (word(4)?, word(8)? as usize);
    Some(Header { version: if bytes[..4] == MAGIC { version } else { 0 }, len })
}

fn framed(body: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER + body.len());
    bytes.extend_from_slice(&MAGIC);
    bytes.extend_from_slice(&PROTOCOL_VERSION.to_le_bytes());
    bytes.extend_from_slice(&(body.len() as u32).to_le_bytes());
    bytes.extend_from_slice(body);
    bytes
}

/// The request in a frame, or why there is none.
fn understood(frame: &[u8]) -> Result<Request, String> {
    match header(frame) {
        Some(Header { version: PROTOCOL_VERSION, len }) if len <= REQUEST_BYTES_MAX => {
            codec::decode(&frame[HEADER..]).map_err(|e| format!("the request is not readable: {e}"))
        }
        Some(Header { version: PROTOCOL_VERSION, len }) => {
            Err(format!("the request is too long: {len} bytes, at most {REQUEST_BYTES_MAX}"))
        }
        Some(Header { version: 0, .. }) | None => Err("this is not a request of shoal".to_owned()),
        Some(Header { version, .. }) => {
            Err(format!("the request has protocol version {version}, this fleet speaks {PROTOCOL_VERSION}"))
        }
    }
}

/// The way back to the operator who asked; it may be kept until the answer is known. Dropped without a reply, it closes
/// the connection, which the operator is told.
pub struct Responder {
    connection: Connection,
}

impl Responder {
    /// Whether the operator still waits.
    pub fn is_awaited(&self) -> bool {
        let mut sources = [PollFd::new(&self.connection.stream, PollFlags::RDHUP)];
        let gone = PollFlags::RDHUP | PollFlags::HUP | PollFlags::ERR;
        poll(&mut sources, Some(&rustix::event::Timespec { tv_sec: 0, tv_nsec: 0 })).is_ok()
            && !sources[0].revents().intersects(gone)
    }

    /// Answers. Nothing can go wrong that the daemon could do anything about: a reply to an operator that went is lost,
    /// and one that is too large becomes a refusal that says so.
    pub fn reply(self, reply: &Reply) {
        let too_large = || Reply::Refused { problem: "the reply is too large".to_owned(), hint: None };
        let body = encoded("reply", reply)
            .ok()
            .filter(|body| body.len() <= REPLY_BYTES_MAX)
            .or_else(|| encoded("reply", &too_large()).ok());
        let Some(body) = body else { return };
        let shared = Rc::clone(&self.connection.shared);
        let mut outgoing = Outgoing { connection: self.connection, bytes: framed(&body), sent: 0, since_ns: now_ns() };
        if !outgoing.send() {
            let _ = epoll::add(&shared.epoll, &outgoing.connection.stream, EventData::new_u64(0), EventFlags::OUT);
            shared.replies.borrow_mut().push(outgoing);
        }
    }
}

impl Outgoing {
    /// Sends what the client takes now; whether there is nothing more to do.
    fn send(&mut self) -> bool {
        while self.sent < self.bytes.len() {
            match self.connection.stream.write(&self.bytes[self.sent..]) {
                Ok(0) => return true,
                Ok(sent) => self.sent += sent,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return e.kind() != ErrorKind::WouldBlock,
            }
        }
        true
    }
}

impl Shared {
    /// Drops the reply that its client has not taken for the longest time, if that is long; whether there was one.
    fn drop_unread(&self, now_ns: u64) -> bool {
        let mut replies = self.replies.borrow_mut();
        let is_stale = replies.first().is_some_and(|oldest| expired(oldest.since_ns, now_ns, IDLE));
        if is_stale {
            replies.remove(0);
        }
        is_stale
    }

    fn send_replies(&self, now_ns: u64) {
        // Dropping one touches the count of connections, not the list.
        let mut replies = self.replies.borrow_mut();
        replies.retain_mut(|outgoing| !outgoing.send() && !expired(outgoing.since_ns, now_ns, PATIENCE));
    }
}

/// An operator's end.
pub struct OperatorClient {
    address: Address,
}

impl OperatorClient {
    /// The way to the daemon of the fleet at `address`. Nothing is opened before there is something to ask.
    pub fn new(address: &Address) -> OperatorClient {
        OperatorClient { address: address.clone() }
    }

    /// Asks, and waits for the answer.
    ///
    /// # Errors
    /// When there is no daemon, it does not answer in time, or it is of another version.
    pub fn ask(&self, request: &Request, timeout: Duration) -> Result<Reply> {
        let deadline = Deadline { at_ns: now_ns().saturating_add(timeout.as_nanos() as u64), timeout };
        let bytes = framed(&encoded("request", request)?);
        let mut stream = self.connect(&deadline)?;
        deadline.send(&mut stream, &bytes)?;
        let header_bytes = deadline.read(&mut stream, HEADER)?;
        match header(&header_bytes) {
            Some(Header { version: PROTOCOL_VERSION, len }) if len <= REPLY_BYTES_MAX => {
                let body = deadline.read(&mut stream, len)?;
                codec::decode(&body).map_err(|e| other_build(&format!("its answer is not readable: {e}")))
            }
            Some(Header { version, .. }) if version != PROTOCOL_VERSION => {
                Err(other_build(&format!("it speaks protocol version {version}, this executable {PROTOCOL_VERSION}")))
            }
            _ => Err(other_build("its answer is too long")),
        }
    }

    fn connect(&self, deadline: &Deadline) -> Result<UnixStream> {
        use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
        let path = self.address.file(NAME);
        let failed = |e: rustix::io::Errno| BusError::io(&path, "connect to the daemon", e);
        let place = SocketAddrUnix::new(&path).map_err(failed)?;
        loop {
            let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
            let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None).map_err(failed)?;
            match connect(&socket, &place) {
                Ok(()) => return Ok(UnixStream::from(socket)),
                // The kernel's queue is full: many ask at once, or the daemon is stopped.
                Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) if deadline.left().is_some() => {
                    sleep_until_ns(now_ns() + RETRY.as_nanos() as u64);
                }
                Err(rustix::io::Errno::AGAIN) => return Err(deadline.over()),
                Err(rustix::io::Errno::NOENT | rustix::io::Errno::CONNREFUSED) => {
                    return Err(silent("nothing answers for this fleet"));
                }
                Err(e) => return Err(failed(e)),
            }
        }
    }
}

/// Until when an operator waits.
struct Deadline {
    at_ns: u64,
    timeout: Duration,
}

impl Deadline {
    fn left(&self) -> Option<Duration> {
        self.at_ns.checked_sub(now_ns()).filter(|left| *left > 0).map(Duration::from_nanos)
    }

    fn over(&self) -> BusError {
        silent(&format!("no answer within {} s", self.timeout.as_secs_f64()))
    }

    /// Waits until the socket can be read or written.
    fn wait(&self, stream: &UnixStream, flags: PollFlags) -> Result<()> {
        let left = self.left().ok_or_else(|| self.over())?;
        let limit = rustix::event::Timespec { tv_sec: left.as_secs() as i64, tv_nsec: left.subsec_nanos().into() };
        // An interrupted wait is followed by another look at the clock.
        let _ = poll(&mut [PollFd::new(stream, flags)], Some(&limit));
        Ok(())
    }

    fn send(&self, stream: &mut UnixStream, bytes: &[u8]) -> Result<()> {
        let mut sent = 0;
        while sent < bytes.len() {
            match stream.write(&bytes[sent..]) {
                Ok(written) => sent += written,
                Err(e) if e.kind() == ErrorKind::WouldBlock => self.wait(stream, PollFlags::OUT)?,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(_) => return Err(hung_up()),
            }
        }
        Ok(())
    }

    fn read(&self, stream: &mut UnixStream, len: usize) -> Result<Vec<u8>> {
        let mut bytes = vec![0; len];
        let mut got = 0;
        while got < len {
            match stream.read(&mut bytes[got..]) {
                Ok(0) => return Err(hung_up()),
                Ok(read) => got += read,
                Err(e) if e.kind() == ErrorKind::WouldBlock => self.wait(stream, PollFlags::IN)?,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(_) => return Err(hung_up()),
            }
        }
        Ok(bytes)
    }
}

fn silent(cause: &str) -> BusError {
    let hint = "its daemon may have been stopped or killed: `shoal ps` lists fleets, `shoal clean` removes dead ones";
    BusError::new("daemon", "ask it", cause, hint)
}

fn hung_up() -> BusError {
    BusError::new(
        "daemon",
        "ask it",
        "it closed the connection without an answer",
        "the fleet may be ending: see `shoal ps`",
    )
}

fn other_build(cause: &str) -> BusError {
    BusError::new("daemon", "ask it", cause, "use the executable that started the fleet")
}
