//! The server: which address answers what.

use crate::act::Act;
use crate::feed::{Feed, Page};
use crate::guard::{Caller, Guard};
use crate::tape::Tape;
use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Path, Query, Request, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HOST, ORIGIN, REFERRER_POLICY};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode};
use axum::middleware::{self, Next};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use bus::{FleetEntry, OperatorClient, clean};
use futures_util::stream;
use model::RobotIndex;
use serde::Deserialize;
use serde_json::json;
use std::collections::HashMap;
use std::convert::Infallible;
use std::fmt::Write;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use watch::Answer;

/// Maximum number of pages at the same time.
const PAGES_MAX: usize = 64;
/// What a page asks for is shorter, bytes.
const REQUEST_MAX: usize = 4096;
/// A page that hears nothing for this long is told that the server is there.
const ALIVE_EVERY: Duration = Duration::from_secs(5);
/// How long an operator waits for the daemon.
const PATIENCE: Duration = Duration::from_secs(5);
/// How often the server looks whether it is to end.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Pages are given this long to hear the last of a fleet with which the server ends.
const FAREWELL: Duration = Duration::from_millis(700);

const HTML: &str = include_str!("../page/page.html");
const STYLE: &str = include_str!("../page/page.css");
const SCRIPT: &str = include_str!("../page/page.js");
/// Nothing from elsewhere, and no page of others may embed this one.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
const TOKEN: HeaderName = HeaderName::from_static("x-shoal-token");

/// What is served.
#[derive(Debug, Default)]
pub struct Options {
    /// The port; 0 is any.
    pub port: u16,
    /// Only this fleet; otherwise all of this user.
    pub fleet: Option<FleetEntry>,
    /// The server ends when that fleet has.
    pub ends_with_fleet: bool,
    /// Records that are played; without running fleets then.
    pub tapes: Vec<Tape>,
}

/// Why there is no server.
#[derive(Debug, thiserror::Error)]
pub enum WebError {
    /// The port is taken, or forbidden.
    #[error("port {0}: {1}")]
    Port(u16, #[source] io::Error),
    /// The kernel refuses something else.
    #[error("{0}")]
    Io(#[from] io::Error),
}

struct Site {
    guard: Guard,
    options: Options,
    feeds: Mutex<HashMap<String, Feed>>,
    pages: Arc<()>,
}

type Here = State<Arc<Site>>;
/// Why something is not answered.
type Refusal = (StatusCode, String);

/// Serves pages until `is_enough` says so, or the fleet ends with which it is to end. `ready` is told the address to open.
///
/// # Errors
/// When the port cannot be had.
pub fn serve(
    options: Options,
    ready: &mut dyn FnMut(&str),
    is_enough: &mut dyn FnMut() -> bool,
) -> Result<(), WebError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().max_blocking_threads(4).build()?;
    let result = runtime.block_on(async {
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, options.port));
        let listener = tokio::net::TcpListener::bind(address).await.map_err(|e| WebError::Port(options.port, e))?;
        let guard = Guard::new(token()?, listener.local_addr()?.port());
        let url = guard.url();
        let site = Arc::new(Site { guard, options, feeds: Mutex::default(), pages: Arc::new(()) });
        let app = routes(site.clone());
        tokio::spawn(async move { axum::serve(listener, app).await });
        ready(&url);
        while !is_enough() {
            if site.options.ends_with_fleet && site.fleets().is_empty() {
                tokio::time::sleep(FAREWELL).await;
                break;
            }
            tokio::time::sleep(LOOK_EVERY).await;
        }
        Ok(())
    });
    // Pages keep their connections open for ever.
    runtime.shutdown_background();
    result
}

/// 128 bits from the kernel.
fn token() -> io::Result<String> {
    let mut bytes = [0_u8; 16];
    let got = rustix::rand::getrandom(&mut bytes, rustix::rand::GetRandomFlags::empty())?;
    if got < bytes.len() {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    }))
}

fn routes(site: Arc<Site>) -> Router {
    Router::new()
        .route("/", get(|| async { text("text/html; charset=utf-8", HTML) }))
        .route("/page.css", get(|| async { text("text/css; charset=utf-8", STYLE) }))
        .route("/page.js", get(|| async { text("text/javascript; charset=utf-8", SCRIPT) }))
        .route("/sources", get(sources))
        .route("/records/{number}", get(record))
        .route("/records/{number}/frames", get(frames))
        .route("/fleets/{id}/stream", get(stream_of))
        .route("/fleets/{id}/choose/{slot}", post(choose))
        .route("/fleets/{id}/act", post(act))
        .layer(DefaultBodyLimit::max(REQUEST_MAX))
        .layer(middleware::from_fn_with_state(site.clone(), guarded))
        .with_state(site)
}

fn text(kind: &'static str, text: &'static str) -> Response {
    ([(CONTENT_TYPE, kind)], text).into_response()
}

/// Lets in who may come in. The style and the script of the page hold nothing that is secret, and browsers ask for them without
/// the token.
async fn guarded(State(site): Here, request: Request, next: Next) -> Response {
    let headers = request.headers();
    let word = |name: HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
    let query = request.uri().query().unwrap_or_default();
    let in_query = query.split('&').find_map(|part| part.strip_prefix("token="));
    let caller = Caller { host: word(HOST), origin: word(ORIGIN), token: word(TOKEN).or(in_query) };
    let is_open = matches!(request.uri().path(), "/page.css" | "/page.js");
    let mut response = if site.guard.admits(caller) || is_open && site.guard.is_here(caller) {
        next.run(request).await
    } else {
        let words = "this page needs the token of its server: open the whole address that `shoal view` printed\n";
        (StatusCode::FORBIDDEN, words).into_response()
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (CONTENT_SECURITY_POLICY, POLICY),
        (REFERRER_POLICY, "no-referrer"),
        (CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("x-content-type-options"), "nosniff"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

impl Site {
    /// The fleets that are shown.
    fn fleets(&self) -> Vec<FleetEntry> {
        if !self.options.tapes.is_empty() {
            return Vec::new();
        }
        match &self.options.fleet {
            Some(fleet) => Some(fleet.clone()).filter(|fleet| fleet.address.root().exists()).into_iter().collect(),
            None => {
                let fleets = clean::list_fleets().unwrap_or_default();
                fleets.into_iter().filter(|fleet| !fleet.abandoned).collect()
            }
        }
    }

    fn fleet(&self, id: &str) -> Result<FleetEntry, Refusal> {
        let found = self.fleets().into_iter().find(|fleet| fleet.address.id() == id);
        found.ok_or_else(|| (StatusCode::NOT_FOUND, "this fleet is not running\n".to_owned()))
    }

    /// Who looks at a fleet, if anybody may.
    fn feed(&self, id: &str) -> Result<Feed, Refusal> {
        let fleet = self.fleet(id)?;
        let mut feeds = self.feeds.lock().unwrap_or_else(PoisonError::into_inner);
        feeds.retain(|_, feed| !feed.is_over());
        if let Some(feed) = feeds.get(id) {
            return Ok(feed.clone());
        }
        let failed = |error: io::Error| (StatusCode::SERVICE_UNAVAILABLE, format!("{error}\n"));
        let feed = Feed::begin(fleet.address, fleet.name).map_err(failed)?;
        feeds.insert(id.to_owned(), feed.clone());
        Ok(feed)
    }
}

/// What there is to see.
async fn sources(State(site): Here) -> Response {
    let fleets: Vec<_> =
        site.fleets().iter().map(|fleet| json!({ "id": fleet.address.id(), "name": fleet.name })).collect();
    let records: Vec<_> = site.options.tapes.iter().map(|tape| json!({ "path": tape.name() })).collect();
    as_json(&json!({ "version": env!("CARGO_PKG_VERSION"), "fleets": fleets, "records": records }))
}

fn as_json(value: &impl serde::Serialize) -> Response {
    let text = serde_json::to_string(value).unwrap_or_default();
    ([(CONTENT_TYPE, "application/json")], text).into_response()
}

/// A fleet, as it goes on.
async fn stream_of(State(site): Here, Path(id): Path<String>) -> Response {
    // One is the site's own.
    if Arc::strong_count(&site.pages) > PAGES_MAX {
        return (StatusCode::SERVICE_UNAVAILABLE, format!("{PAGES_MAX} pages look already\n")).into_response();
    }
    let page = match site.feed(&id) {
        Ok(feed) => (feed.page(), site.pages.clone()),
        Err(refusal) => return refusal.into_response(),
    };
    let events = stream::unfold(page, |(mut page, counted): (Page, Arc<()>)| async move {
        let (name, data) = page.next().await?;
        let event = Event::default().event(name).data(&*data);
        Some((Ok::<_, Infallible>(event), (page, counted)))
    });
    Sse::new(events).keep_alive(KeepAlive::new().interval(ALIVE_EVERY)).into_response()
}

/// What is known of a record.
async fn record(State(site): Here, Path(number): Path<usize>) -> Response {
    site.options.tapes.get(number).map_or_else(no_record, |tape| as_json(&tape.about()))
}

#[derive(Deserialize)]
struct Window {
    from: u64,
    to: u64,
    step: u64,
}

/// Some frames of a record.
async fn frames(State(site): Here, Path(number): Path<usize>, Query(window): Query<Window>) -> Response {
    let Some(tape) = site.options.tapes.get(number) else { return no_record() };
    match tape.frames(window.from, window.to, window.step) {
        Ok(text) => ([(CONTENT_TYPE, "application/json")], text).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, format!("{}: {error}\n", tape.name())).into_response(),
    }
}

fn no_record() -> Response {
    (StatusCode::NOT_FOUND, "there are fewer records\n").into_response()
}

/// Intentions of this robot are told from now on.
async fn choose(State(site): Here, Path((id, slot)): Path<(String, u32)>) -> Response {
    match site.feed(&id) {
        Ok(feed) => {
            feed.choose(RobotIndex(slot));
            as_json(&json!({}))
        }
        Err(refusal) => refusal.into_response(),
    }
}

/// Something to do, which the fleet's daemon is asked for.
async fn act(State(site): Here, Path(id): Path<String>, headers: HeaderMap, body: Bytes) -> Response {
    // Pages of other sites can send forms and text, but not this, without asking first.
    if headers.get(CONTENT_TYPE).is_none_or(|kind| kind != "application/json") {
        return (StatusCode::UNSUPPORTED_MEDIA_TYPE, "application/json is asked for\n").into_response();
    }
    let act: Act = match serde_json::from_slice(&body) {
        Ok(act) => act,
        Err(error) => return (StatusCode::BAD_REQUEST, format!("this is nothing to do: {error}\n")).into_response(),
    };
    let address = match site.fleet(&id) {
        Ok(fleet) => fleet.address,
        Err(refusal) => return refusal.into_response(),
    };
    let asked = move || OperatorClient::new(&address).ask(&act.request(), PATIENCE);
    let answer = match tokio::task::spawn_blocking(asked).await {
        Ok(Ok(reply)) => Answer::of(&reply),
        Ok(Err(error)) => Answer::failed(error.to_string()),
        Err(error) => Answer::failed(error.to_string()),
    };
    as_json(&answer)
}
