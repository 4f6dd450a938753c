//! Requests of operators (a second terminal) and the daemon's replies: iceoryx2 request-response.
//!
//! It has no wake-up of its own. The daemon is woken by a named pipe, an operator by a futex word in a small file.

use crate::bell::Bell;
use crate::clock::{now_ns, timespec};
use crate::control::encoded;
use crate::map::Mapping;
use crate::node::{Ipc, Node};
use crate::{BusError, Result, Sizes};
use iceoryx2::active_request::ActiveRequest;
use iceoryx2::port::client::Client;
use iceoryx2::port::server::Server;
use iceoryx2::prelude::*;
use iceoryx2::service::builder::request_response::Builder;
use iceoryx2::service::port_factory::client::ClientCreateError;
use iceoryx2::service::port_factory::request_response::PortFactory as Factory;
use protocol::codec;
use protocol::operator_to_daemon::{Reply, Request};
use rustix::thread::futex;
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::atomic::Ordering::{AcqRel, Acquire, Release};
use std::time::Duration;

const NAME: &str = "operator";
const BELL: &str = "operator.bell";
const MAGIC: u64 = u64::from_le_bytes(*b"shoalOp1");
/// Counts the replies; operators sleep on it.
const REPLIES: usize = 64;

/// Operators at the same time; each is a command that lives for a moment.
const CLIENTS_MAX: usize = 16;
const REQUEST_BYTES_MAX: usize = 8 * 1024;
/// Replies under way at the same time.
const REPLIES_MAX: usize = 8;
/// No wait is longer, whatever the word says.
const NAP: Duration = Duration::from_millis(500);

fn reply_bytes_max(sizes: Sizes) -> usize {
    // The status of a robot takes at most about 200 bytes.
    8 * 1024 + 320 * sizes.max_robots as usize
}

pub(crate) fn bytes_needed(sizes: Sizes) -> u64 {
    (CLIENTS_MAX * (REQUEST_BYTES_MAX + 16 * 4096) + REPLIES_MAX * reply_bytes_max(sizes)) as u64
}

/// What keeps the service alive.
pub(crate) type OperatorService = Factory<Ipc, [u8], (), [u8], ()>;

/// Makes the service.
pub(crate) fn create(node: &Node) -> Result<OperatorService> {
    Bell::create(node.address(), BELL)?;
    Mapping::create(node.address(), NAME, 128, |map| map.u64_at(0).store(MAGIC, Release))?;
    builder(node).create().map_err(|e| BusError::port(object(), "create the service", e))
}

fn builder(node: &Node) -> Builder<[u8], (), [u8], (), Ipc> {
    node.service(NAME)
        .request_response::<[u8], [u8]>()
        .max_clients(CLIENTS_MAX)
        // One for the daemon, one for a daemon that was killed and is not cleared away yet.
        .max_servers(2)
        .max_nodes(2 * CLIENTS_MAX + 8)
        .max_active_requests_per_client(1)
        .max_response_buffer_size(1)
        .max_borrowed_responses_per_pending_response(1)
}

fn open(node: &Node) -> Result<OperatorService> {
    builder(node).open().map_err(|e| BusError::port(object(), "open the service", e))
}

fn object() -> String {
    format!("service `{NAME}`")
}

/// The daemon's end, with a descriptor for `poll`: readable when there is something to take.
///
/// Call [`OperatorServer::take`] until it gives nothing, and only then sleep.
pub struct OperatorServer {
    server: Server<Ipc, [u8], (), [u8], ()>,
    service: OperatorService,
    bell: Bell,
    word: Rc<Mapping>,
}

impl OperatorServer {
    /// Becomes the one who answers.
    ///
    /// # Errors
    /// When the fleet's services are not there, or somebody else answers already.
    pub fn open(node: &Node) -> Result<OperatorServer> {
        let sizes = Sizes::of(node.address())?;
        let service = open(node)?;
        let server = service
            .server_builder()
            .initial_max_slice_len(reply_bytes_max(sizes))
            .allocation_strategy(AllocationStrategy::Static)
            .max_loaned_responses_per_request(1)
            .override_response_preallocation(|needed| needed.min(REPLIES_MAX))
            .create()
            .map_err(|e| BusError::port(object(), "become the server", e))?;
        let bell = Bell::open(node.address(), BELL)?;
        let word = Rc::new(Mapping::open(node.address(), NAME, MAGIC)?);
        Ok(OperatorServer { server, service, bell, word })
    }

    /// The next request, if there is one. What is no request (an operator of another build) is answered in here; an
    /// operator that cannot be reached runs into its time-out.
    pub fn take(&mut self) -> Option<(Request, Responder)> {
        if let Some(request) = self.receive() {
            return Some(request);
        }
        self.bell.drain();
        // An operator rings after it has sent, so what was rung for before the drain is there to be received now.
        let request = self.receive();
        if request.is_none() && self.service.dynamic_config().number_of_clients() > CLIENTS_MAX / 2 {
            // Operators that were killed keep their places. Those are few and short-lived: clear them when it matters.
            self.service.try_cleanup_dead_nodes();
        }
        request
    }

    fn receive(&self) -> Option<(Request, Responder)> {
        while let Ok(Some(active)) = self.server.receive() {
            let request = codec::decode(active.payload());
            let responder = Responder { active, word: Rc::clone(&self.word) };
            match request {
                Ok(request) => return Some((request, responder)),
                Err(e) => {
                    let hint = Some("all processes of a fleet must come from the same build".to_owned());
                    responder.reply(&Reply::Refused { problem: format!("the request is not readable: {e}"), hint });
                }
            }
        }
        None
    }
}

impl AsFd for OperatorServer {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.bell.as_fd()
    }
}

/// The way back to the operator who asked. Dropped without a reply, it lets the operator wait for its time-out.
pub struct Responder {
    active: ActiveRequest<Ipc, [u8], (), [u8], ()>,
    word: Rc<Mapping>,
}

impl Responder {
    /// Whether the operator still waits.
    pub fn is_awaited(&self) -> bool {
        self.active.is_connected()
    }

    /// Answers. Nothing can go wrong that the daemon could do anything about: an operator that does not wait any more is
    /// served as well, and a reply that is too large becomes a refusal that says so.
    pub fn reply(self, reply: &Reply) {
        if !encoded("reply", reply).is_ok_and(|bytes| self.send(&bytes)) {
            let problem = "the reply could not be delivered".to_owned();
            if let Ok(bytes) = encoded("reply", &Reply::Refused { problem, hint: None }) {
                self.send(&bytes);
            }
        }
        let word = self.word.u32_at(REPLIES);
        word.fetch_add(1, AcqRel);
        let _ = futex::wake(word, futex::Flags::empty(), i32::MAX as u32);
    }

    fn send(&self, bytes: &[u8]) -> bool {
        match self.active.loan_slice_uninit(bytes.len()) {
            Ok(response) => response.write_from_slice(bytes).send().is_ok(),
            Err(_) => !self.active.is_connected(),
        }
    }
}

/// An operator's end.
pub struct OperatorClient {
    client: Client<Ipc, [u8], (), [u8], ()>,
    bell: Bell,
    word: Mapping,
}

impl OperatorClient {
    /// Opens the way to the daemon of the node's fleet.
    ///
    /// # Errors
    /// When the fleet's services are not there, or too many operators are.
    pub fn open(node: &Node) -> Result<OperatorClient> {
        let service = open(node)?;
        let bell = Bell::open(node.address(), BELL)?;
        let word = Mapping::open(node.address(), NAME, MAGIC)?;
        let mut tries = 0;
        let client = loop {
            let made = service.client_builder().initial_max_slice_len(REQUEST_BYTES_MAX).create();
            match made {
                Ok(client) => break client,
                Err(ClientCreateError::ExceedsMaxSupportedClients) if tries < 20 => {
                    // The daemon clears dead operators away when it is rung.
                    tries += 1;
                    bell.ring();
                    crate::clock::sleep_until_ns(now_ns() + 50_000_000);
                }
                Err(e) => return Err(BusError::port(object(), "become a client", e)),
            }
        };
        Ok(OperatorClient { client, bell, word })
    }

    /// Asks, and waits for the answer.
    ///
    /// # Errors
    /// When there is no daemon, or it does not answer in time.
    pub fn ask(&self, request: &Request, timeout: Duration) -> Result<Reply> {
        let deadline_ns = now_ns().saturating_add(timeout.as_nanos() as u64);
        let failed = |e: &dyn std::fmt::Debug| BusError::port(object(), "ask the daemon", e);
        let bytes = encoded("request", request)?;
        let loan = self.client.loan_slice_uninit(bytes.len()).map_err(|e| failed(&e))?;
        let pending = loan.write_from_slice(&bytes).send().map_err(|e| failed(&e))?;
        if pending.number_of_server_connections() == 0 {
            return Err(silent("nobody answers for this fleet"));
        }
        self.bell.ring();
        let word = self.word.u32_at(REPLIES);
        loop {
            let seen = word.load(Acquire);
            if let Some(response) = pending.receive().map_err(|e| failed(&e))? {
                return codec::decode(response.payload()).map_err(|e| failed(&e));
            }
            let left = deadline_ns.saturating_sub(now_ns()).min(NAP.as_nanos() as u64);
            if left == 0 {
                return Err(silent(&format!("no answer within {} s", timeout.as_secs_f64())));
            }
            let _ = futex::wait(word, futex::Flags::empty(), seen, Some(&timespec(left)));
        }
    }
}

fn silent(cause: &str) -> BusError {
    let hint = "its daemon may have been stopped or killed: `shoal ps` lists fleets, `shoal clean` removes dead ones";
    BusError::new("daemon", "ask it", cause, hint)
}
