//! A running fleet for any number of pages: one thread looks at it, and keeps the newest of everything as text. A page that is
//! slow finds what is newest when it comes round, and never holds up anybody; what a page costs in memory has a bound.
//!
//! With no page open, nothing is looked at, and the world writes no frames.

use crate::json;
use ::watch::{Fleet, Live, Vitals, WatchError};
use bus::{Address, clock};
use model::RobotIndex;
use serde_json::json;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::watch::{self, Receiver, Sender};

/// Frames are looked for this often.
const FRAME_EVERY_NS: u64 = 40_000_000;
/// So often it is asked how everybody does.
const VITALS_EVERY_NS: u64 = 1_000_000_000;
/// Without any page, the thread ends after this long.
const IDLE_NS: u64 = 5_000_000_000;
/// Number of events that are kept for pages that open later.
const EVENTS_MAX: usize = 512;
/// Intentions are told of the robots that pages chose last.
const CHOSEN_MAX: usize = 4;

/// A text that many pages are sent.
pub(crate) type Text = Arc<str>;

/// The newest of everything. Numbers go up with every change.
#[derive(Default)]
struct Board {
    fleet: (u64, Text),
    frame: (u64, Text),
    vitals: (u64, Text),
    events: VecDeque<(u64, Text)>,
    events_seen: u64,
    end: Option<Text>,
}

struct Shared {
    board: Mutex<Board>,
    changed: Sender<()>,
    pages: AtomicUsize,
    chosen: Mutex<VecDeque<RobotIndex>>,
    over: AtomicBool,
}

/// What pages of one fleet share.
#[derive(Clone)]
pub(crate) struct Feed(Arc<Shared>);

/// What a page is sent: the name of an event, and its data as JSON.
pub(crate) type Message = (&'static str, Text);

/// One page, and what it has been sent.
pub(crate) struct Page {
    shared: Arc<Shared>,
    changed: Receiver<()>,
    fleet: u64,
    frame: u64,
    vitals: u64,
    events: u64,
    ended: bool,
    waiting: VecDeque<Message>,
}

impl Feed {
    /// Begins to look at a fleet.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(crate) fn begin(address: Address, name: Option<String>) -> std::io::Result<Feed> {
        let feed = Feed(Arc::new(Shared {
            board: Mutex::default(),
            changed: watch::channel(()).0,
            pages: AtomicUsize::new(0),
            chosen: Mutex::default(),
            over: AtomicBool::new(false),
        }));
        let shared = feed.0.clone();
        // A look at a fleet takes time, which the server must not wait for.
        std::thread::Builder::new().name("feed".to_owned()).spawn(move || {
            let ending = look(&address, name.as_deref(), &shared);
            let words = match ending {
                Ok(words) => words.to_owned(),
                Err(error) => error.to_string(),
            };
            shared.over.store(true, SeqCst);
            shared.board().end = Some(json!({ "words": words }).to_string().into());
            shared.changed.send_replace(());
        })?;
        Ok(feed)
    }

    /// The thread has ended: the fleet has, or no page was open.
    pub(crate) fn is_over(&self) -> bool {
        self.0.over.load(SeqCst)
    }

    /// A page opens.
    pub(crate) fn page(&self) -> Page {
        self.0.pages.fetch_add(1, SeqCst);
        Page {
            shared: self.0.clone(),
            changed: self.0.changed.subscribe(),
            fleet: 0,
            frame: 0,
            vitals: 0,
            events: 0,
            ended: false,
            waiting: VecDeque::new(),
        }
    }

    /// A page has chosen this robot.
    pub(crate) fn choose(&self, robot: RobotIndex) {
        let mut chosen = self.0.chosen.lock().unwrap_or_else(PoisonError::into_inner);
        chosen.retain(|known| *known != robot);
        chosen.push_front(robot);
        chosen.truncate(CHOSEN_MAX);
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        self.shared.pages.fetch_sub(1, SeqCst);
    }
}

impl Page {
    /// What it is to be sent next; `None` at the end.
    pub(crate) async fn next(&mut self) -> Option<Message> {
        loop {
            if let Some(message) = self.waiting.pop_front() {
                return Some(message);
            }
            if self.ended {
                return None;
            }
            self.changed.borrow_and_update();
            self.collect();
            if self.waiting.is_empty() && self.changed.changed().await.is_err() {
                return None;
            }
        }
    }

    /// Takes what is newer than what it has been sent.
    fn collect(&mut self) {
        let board = self.shared.board();
        let texts = [
            ("fleet", &board.fleet, &mut self.fleet),
            ("frame", &board.frame, &mut self.frame),
            ("vitals", &board.vitals, &mut self.vitals),
        ];
        for (name, (number, text), seen) in texts {
            if *number > *seen {
                *seen = *number;
                self.waiting.push_back((name, text.clone()));
            }
        }
        let newer = board.events.iter().filter(|(number, _)| *number > self.events);
        self.waiting.extend(newer.map(|(_, text)| ("event", text.clone())));
        self.events = board.events_seen;
        if let Some(end) = &board.end {
            self.ended = true;
            self.waiting.push_back(("end", end.clone()));
        }
    }
}

impl Shared {
    fn board(&self) -> MutexGuard<'_, Board> {
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn fleet(&self, fleet: &Fleet) {
        let text: Text = serde_json::to_string(fleet).unwrap_or_default().into();
        let place = &mut self.board().fleet;
        *place = (place.0 + 1, text);
    }

    fn vitals(&self, vitals: &Vitals, tick_hz: f64) {
        let Vitals { status, unanswered, pulse, .. } = vitals;
        let text = json!({ "status": status, "unanswered": unanswered, "pulse": pulse }).to_string();
        let mut board = self.board();
        board.vitals = (board.vitals.0 + 1, text.into());
        for record in &vitals.events {
            board.events_seen += 1;
            let entry = (
                board.events_seen,
                json::event(&record.event, record.robot.as_deref(), &record.detail, tick_hz).to_string().into(),
            );
            board.events.push_back(entry);
        }
        let excess = board.events.len().saturating_sub(EVENTS_MAX);
        board.events.drain(..excess);
    }
}

/// Looks at a fleet until it ends, or has no page for long; with which words the pages end.
fn look(address: &Address, name: Option<&str>, shared: &Shared) -> Result<&'static str, WatchError> {
    let mut live = Live::open(address, name)?;
    let (mut revision, mut vitals_due_ns, mut idle_since_ns) = (None, 0, clock::now_ns());
    loop {
        let now_ns = clock::now_ns();
        if shared.pages.load(SeqCst) == 0 {
            live.rest();
            if now_ns.saturating_sub(idle_since_ns) > IDLE_NS {
                return Ok("no page was open");
            }
        } else {
            idle_since_ns = now_ns;
            let over = live.is_over();
            if now_ns >= vitals_due_ns && !over {
                vitals_due_ns = now_ns + VITALS_EVERY_NS;
                shared.vitals(&live.vitals()?, live.fleet().tick_hz);
            }
            if revision != Some(live.revision()) {
                revision = Some(live.revision());
                shared.fleet(live.fleet());
            }
            let chosen: Vec<RobotIndex> =
                shared.chosen.lock().unwrap_or_else(PoisonError::into_inner).iter().copied().collect();
            live.choose(&chosen);
            match live.frame() {
                Ok(None) => {}
                Ok(Some(frame)) => {
                    let text: Text = json::frame(&frame).into();
                    let place = &mut shared.board().frame;
                    *place = (place.0 + 1, text);
                }
                // Its files are being removed.
                Err(_) if live.is_over() => {}
                Err(error) => return Err(error),
            }
            shared.changed.send_replace(());
            if over {
                return Ok("the run has ended");
            }
        }
        clock::sleep_until_ns(now_ns + FRAME_EVERY_NS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shared() -> Feed {
        Feed(Arc::new(Shared {
            board: Mutex::default(),
            changed: watch::channel(()).0,
            pages: AtomicUsize::new(0),
            chosen: Mutex::default(),
            over: AtomicBool::new(false),
        }))
    }

    fn next(page: &mut Page) -> Option<Message> {
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        runtime.block_on(page.next())
    }

    #[test]
    fn a_slow_page_gets_the_newest_frame_and_every_event() {
        let feed = shared();
        let mut page = feed.page();
        for number in 1..=100 {
            let mut board = feed.0.board();
            board.frame = (number, format!("frame {number}").into());
            board.events_seen = number;
            board.events.push_back((number, format!("event {number}").into()));
            drop(board);
            feed.0.changed.send_replace(());
        }
        feed.0.board().end = Some("over".into());
        let mut got = Vec::new();
        while let Some((name, text)) = next(&mut page) {
            got.push(format!("{name}: {text}"));
        }
        assert_eq!(got[0], "frame: frame 100");
        assert_eq!((got[1].as_str(), got[100].as_str()), ("event: event 1", "event: event 100"));
        assert_eq!((got[101].as_str(), got.len()), ("end: over", 102));
        // One that opens later gets what is there now.
        assert_eq!(next(&mut feed.page()).unwrap().1.as_ref(), "frame 100");
    }

    #[test]
    fn pages_are_counted_and_chosen_robots_are_few() {
        let feed = shared();
        let pages: Vec<Page> = (0..3).map(|_| feed.page()).collect();
        assert_eq!(feed.0.pages.load(SeqCst), 3);
        drop(pages);
        assert_eq!(feed.0.pages.load(SeqCst), 0);
        [1, 2, 3, 4, 5, 2].into_iter().for_each(|slot| feed.choose(RobotIndex(slot)));
        let chosen: Vec<u32> = feed.0.chosen.lock().unwrap().iter().map(|index| index.0).collect();
        assert_eq!(chosen, [2, 5, 4, 3]);
    }
}
