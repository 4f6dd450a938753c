//! Where moments go: a thread of the process that has the world, behind a queue, and the file that it writes.
//!
//! The process that has the world never waits for the disk in `realtime`: a moment for which the queue has no room is left
//! out and counted, and the record says so where it is missing. In `lockstep` and `single`, whose time is only simulated,
//! it waits, up to a limit. The thread looks for moments at intervals, so it needs no wake-up.

use crate::figures::{Counted, Figures};
use crate::header::Ending;
use crate::moment::Moment;
use crate::writer::{Gap, RecordWriter};
use model::{Mode, Scenario};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::time::{Duration, Instant};

/// How often the thread looks for moments.
const BEAT: Duration = Duration::from_millis(10);
/// A chunk is ended after this long: what a killed run loses of its record.
const CHUNK: Duration = Duration::from_millis(500);
/// How often the processes' figures are written.
const COUNT: Duration = Duration::from_secs(1);
/// How long a run in ticks, and any run at its end, waits for a disk that takes nothing.
const PATIENCE: Duration = Duration::from_secs(30);
/// A step of that waiting.
const STEP: Duration = Duration::from_millis(1);
/// The queue holds this much simulated time, s, in this many moments and at most in so many bytes.
const QUEUE_S: f64 = 10.0;
const QUEUE_MOMENTS: std::ops::RangeInclusive<usize> = 64..=4096;
const QUEUE_BYTES: usize = 64 << 20;
/// What waits besides frames, and is not left out before it has become this much, bytes.
const INPUTS_MAX: usize = 8 << 20;
/// In `realtime` the thread is behind everybody else. A run in ticks waits for it, so there it is not.
const NICE: i32 = 10;

/// Asks what the processes of a fleet have counted so far.
pub type Count = Box<dyn FnMut() -> Vec<(Counted, Figures)> + Send>;

enum Item {
    Moment(Moment, Gap),
    End(Ending, Gap),
}

/// Takes moments and has them written.
pub struct Sink {
    queue: SyncSender<Item>,
    /// Moments whose memory can be used again.
    spare: Receiver<Moment>,
    end: Receiver<io::Result<()>>,
    /// How many items the thread has taken.
    taken: Arc<AtomicU64>,
    /// How long it waits for room; `None`: not at all.
    waits: Option<Duration>,
    gap: Gap,
    left_out: u64,
    /// The queue did not move within [`PATIENCE`].
    stuck: bool,
}

impl Sink {
    /// Begins a record at `target`; from now on there is a file of this name that can be read. An older file of the name
    /// is replaced, not written over: other names of it keep their content.
    ///
    /// # Errors
    /// When there can be no file.
    pub fn begin(target: &Path, scenario: &Scenario) -> io::Result<Sink> {
        Sink::begin_counting(target, scenario, None)
    }

    /// The same; `count` is asked about once a second what the processes of the fleet have counted so far, from the thread.
    ///
    /// # Errors
    /// As [`Sink::begin`].
    pub fn begin_counting(target: &Path, scenario: &Scenario, count: Option<Count>) -> io::Result<Sink> {
        let body = size_of::<crate::Body>();
        let room = QUEUE_BYTES / (body * (scenario.fleet.max_robots + scenario.obstacles.len()).max(1));
        let depth = ((QUEUE_S * scenario.clock.tick_hz) as usize).min(room);
        let depth = depth.clamp(*QUEUE_MOMENTS.start(), *QUEUE_MOMENTS.end());
        let waits = (scenario.clock.mode != Mode::Realtime).then_some(PATIENCE);
        Sink::start(begin_file(target, scenario)?, depth, waits, count, keep)
    }

    /// Begins the thread. The queue has room for `depth` moments; a full one is waited for, so long.
    fn start<W: Write + Send + 'static>(
        writer: RecordWriter<W>,
        depth: usize,
        waits: Option<Duration>,
        count: Option<Count>,
        keep: fn(W) -> io::Result<()>,
    ) -> io::Result<Sink> {
        let (queue, moments) = sync_channel(depth);
        let (emptied, spare) = sync_channel(depth);
        let (done, end) = sync_channel(1);
        let taken = Arc::new(AtomicU64::new(0));
        let counter = Arc::clone(&taken);
        let nice = if waits.is_some() { 0 } else { NICE };
        let thread = std::thread::Builder::new().name("recorder".to_owned());
        thread.spawn(move || {
            stand_back(nice);
            // Whoever began the record may have given it up.
            let _ = done.send(write(writer, &moments, &counter, &emptied, count, keep));
        })?;
        Ok(Sink { queue, spare, end, taken, waits, gap: Gap::default(), left_out: 0, stuck: false })
    }

    /// Takes what `moment` holds and leaves an empty one. If there is no room, the frame is left out and the rest stays in
    /// `moment`, for the next one.
    pub fn take(&mut self, moment: &mut Moment) {
        let next = self.spare.try_recv().unwrap_or_default();
        let full = std::mem::replace(moment, next);
        match self.send(Item::Moment(full, self.gap)) {
            Ok(()) => self.gap = Gap::default(),
            Err(Some(Item::Moment(back, _))) => {
                *moment = back;
                moment.bodies.clear();
                self.gap.frames += 1;
                self.left_out += 1;
                if moment.input_bytes.len() > INPUTS_MAX {
                    self.gap.inputs += moment.inputs.len() as u64;
                    moment.inputs.clear();
                    moment.input_bytes.clear();
                }
            }
            Err(_) => {}
        }
    }

    /// Frames that were left out so far, because the disk did not keep up.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Ends the record.
    ///
    /// # Errors
    /// With the first thing that went wrong. What was written before can be read.
    pub fn finish(mut self, ending: Ending) -> io::Result<()> {
        let patience = *self.waits.get_or_insert(PATIENCE);
        let gap = self.gap;
        // Whether it was taken or not: the thread knows best what went wrong.
        let _ = self.send(Item::End(ending, gap));
        if self.stuck {
            return Err(stuck(patience));
        }
        // Nothing is added to the queue any more, so this ends.
        loop {
            let before = self.taken.load(Ordering::Relaxed);
            return match self.end.recv_timeout(patience) {
                Ok(written) => written,
                Err(RecvTimeoutError::Timeout) if self.taken.load(Ordering::Relaxed) > before => continue,
                Err(RecvTimeoutError::Timeout) => Err(stuck(patience)),
                Err(RecvTimeoutError::Disconnected) => Err(io::Error::other("the thread that writes it has ended")),
            };
        }
    }

    /// Hands over an item; gives it back if there is no room for it.
    #[expect(clippy::result_large_err, reason = "what finds no room comes back whole")]
    fn send(&mut self, mut item: Item) -> Result<(), Option<Item>> {
        if self.stuck {
            return Err(None);
        }
        let mut waits_since = None;
        loop {
            item = match self.queue.try_send(item) {
                Ok(()) => return Ok(()),
                Err(TrySendError::Disconnected(_)) => return Err(None),
                Err(TrySendError::Full(item)) => item,
            };
            let Some(patience) = self.waits else { return Err(Some(item)) };
            let taken = self.taken.load(Ordering::Relaxed);
            let (before, since) = waits_since.get_or_insert_with(|| (taken, now()));
            if *before != taken {
                waits_since = None;
            } else if since.elapsed() > patience {
                self.stuck = true;
                return Err(None);
            }
            pause(STEP);
        }
    }
}

fn stuck(patience: Duration) -> io::Error {
    let problem = format!("the disk took nothing for {} s; the record ends there", patience.as_secs());
    io::Error::new(io::ErrorKind::TimedOut, problem)
}

#[expect(clippy::disallowed_methods, reason = "the shell of records: a disk has a limit in real time")]
fn now() -> Instant {
    Instant::now()
}

#[expect(clippy::disallowed_methods, reason = "the shell of records: it waits for a disk")]
fn pause(time: Duration) {
    std::thread::sleep(time);
}

/// The thread: writes moments as they come. After a failure it goes on taking them, so that the world does not wait for it.
fn write<W: Write>(
    mut writer: RecordWriter<W>,
    moments: &Receiver<Item>,
    taken: &AtomicU64,
    emptied: &SyncSender<Moment>,
    mut count: Option<Count>,
    keep: fn(W) -> io::Result<()>,
) -> io::Result<()> {
    let mut failed = Ok(());
    let (mut chunk_ended, mut counted) = (now(), now());
    let mut figures = || count.as_mut().map_or_else(Vec::new, |count| count());
    loop {
        let item = moments.try_recv();
        taken.fetch_add(item.is_ok().into(), Ordering::Relaxed);
        match item {
            Ok(Item::Moment(mut moment, gap)) => {
                if failed.is_ok() {
                    failed = writer.moment(&moment, gap);
                }
                moment.clear();
                // One too many is freed.
                let _ = emptied.try_send(moment);
            }
            Ok(Item::End(ending, gap)) => {
                failed?;
                writer.figures(&figures())?;
                return keep(writer.finish(&ending, gap)?);
            }
            Err(TryRecvError::Empty) => pause(BEAT),
            Err(TryRecvError::Disconnected) => return failed,
        }
        if failed.is_ok() && counted.elapsed() >= COUNT {
            failed = writer.figures(&figures());
            counted = now();
        }
        if failed.is_ok() && chunk_ended.elapsed() >= CHUNK {
            if writer.has_open_chunk() {
                failed = writer.end_chunk();
            }
            chunk_ended = now();
        }
    }
}

/// Sees to it that what was written stays.
fn keep(file: File) -> io::Result<()> {
    file.sync_all()?;
    match file.metadata()?.nlink() {
        0 => Err(io::Error::new(io::ErrorKind::NotFound, "the file was removed while it was written")),
        _ => Ok(()),
    }
}

/// The calling thread is an ordinary one, whatever class of scheduling the process has, and as nice as this.
fn stand_back(nice: i32) {
    let ordinary = libc::sched_param { sched_priority: 0 };
    // SAFETY: the pointer is to a live value of the right type; 0 is the calling thread.
    unsafe { libc::sched_setscheduler(0, libc::SCHED_OTHER, &raw const ordinary) };
    // A thread may always become nicer; where it may not, it writes all the same.
    let _ = rustix::process::setpriority_process(None, nice);
}

/// Makes the file and writes the beginning of the record.
fn begin_file(target: &Path, scenario: &Scenario) -> io::Result<RecordWriter<File>> {
    let hidden = hidden(target);
    let _ = fs::remove_file(&hidden);
    let beside = OpenOptions::new().write(true).create_new(true).open(&hidden).and_then(|file| {
        let permissions = fs::metadata(target).ok().filter(fs::Metadata::is_file).map(|old| old.permissions());
        permissions.map_or(Ok(()), |permissions| file.set_permissions(permissions))?;
        let writer = RecordWriter::begin(file, scenario)?;
        fs::rename(&hidden, target)?;
        Ok(writer)
    });
    beside.or_else(|error| {
        let _ = fs::remove_file(&hidden);
        // A mount point cannot be replaced, and a directory may not be writable where the file in it is.
        match OpenOptions::new().write(true).open(target) {
            Ok(file) if error.kind() != io::ErrorKind::StorageFull => {
                file.set_len(0)?;
                RecordWriter::begin(file, scenario)
            }
            _ => Err(error),
        }
    })
}

/// The name of a file until it takes its place.
fn hidden(target: &Path) -> PathBuf {
    // Names have a limit of their own: one that is just short enough must not fail for our sake.
    let name: String = target.file_name().unwrap_or_default().to_string_lossy().chars().take(40).collect();
    target.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::disallowed_methods, reason = "tests of a shell")]
    use super::*;
    use crate::Record;
    use crate::tests::{moment, scenario};
    use std::sync::{Arc, Mutex};

    /// A disk that takes bytes only while it is let, and no more than it has room for.
    #[derive(Clone, Default)]
    struct Disk(Arc<Mutex<(Vec<u8>, bool, usize)>>);

    impl Disk {
        fn new(runs: bool, room: usize) -> Disk {
            Disk(Arc::new(Mutex::new((Vec::new(), runs, room))))
        }

        fn run(&self) {
            self.0.lock().unwrap().1 = true;
        }

        fn bytes(&self) -> Vec<u8> {
            self.0.lock().unwrap().0.clone()
        }
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            loop {
                let (held, runs, room) = &mut *self.0.lock().unwrap();
                // The beginning of a record is always taken.
                if *runs || held.len() < 2000 {
                    if held.len() + bytes.len() > *room {
                        return Err(io::ErrorKind::StorageFull.into());
                    }
                    held.extend_from_slice(bytes);
                    return Ok(bytes.len());
                }
                std::thread::yield_now();
            }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn sink(disk: &Disk, depth: usize, waits: Option<Duration>) -> Sink {
        let writer = RecordWriter::begin(disk.clone(), &scenario()).unwrap();
        Sink::start(writer, depth, waits, None, |_| Ok(())).unwrap()
    }

    fn ticks(record: &Record) -> Vec<u64> {
        let (mut frames, mut ticks) = (record.frames(), Vec::new());
        while let Some(frame) = frames.next().unwrap() {
            ticks.push(frame.tick);
        }
        ticks
    }

    #[test]
    fn a_disk_that_is_slow_costs_frames_in_realtime_and_nothing_else() {
        let disk = Disk::new(false, usize::MAX);
        let mut sink = sink(&disk, 8, None);
        let begun = now();
        let mut next = Moment::default();
        for tick in 0..400 {
            let Moment { bodies, events, added, .. } = moment(tick);
            next = Moment { tick, bodies, ..next };
            next.events.extend(events);
            next.added.extend(added);
            next.input(tick, crate::InputSource::World, &tick.to_le_bytes());
            sink.take(&mut next);
            // The thread looks now and then, until its first chunk does not go to the disk.
            if tick % 50 == 0 {
                pause(Duration::from_millis(30));
            }
        }
        assert!(begun.elapsed() < Duration::from_secs(5), "the world does not wait for the disk");
        pause(Duration::from_millis(600));
        let mut last = moment(400);
        next = Moment { tick: 400, bodies: std::mem::take(&mut last.bodies), ..next };
        sink.take(&mut next);
        let left_out = sink.left_out();
        assert!(left_out > 300, "{left_out}");
        disk.run();
        sink.finish(Ending::default()).unwrap();
        let record = Record::read(disk.bytes()).unwrap();
        let ticks = ticks(&record);
        assert_eq!((ticks.len() as u64 + left_out, record.left_out()), (401, left_out), "{ticks:?}");
        let events: usize = (0..400).map(|tick| moment(tick).events.len()).sum();
        let held = record.events().len() + next.events.len();
        assert_eq!(held, events, "what happened is not left out");
        assert_eq!(record.inputs().count() + next.inputs.len(), 400, "inputs wait for room");
    }

    #[test]
    fn a_run_in_ticks_waits_for_the_disk_but_not_forever() {
        let disk = Disk::new(false, usize::MAX);
        let mut sink = sink(&disk, 4, Some(Duration::from_millis(700)));
        let begun = now();
        for tick in 0..4000 {
            sink.take(&mut moment(tick));
        }
        let error = sink.finish(Ending::default()).unwrap_err();
        assert!(error.to_string().contains("took nothing"), "{error}");
        assert!((700..5000).contains(&begun.elapsed().as_millis()), "{:?}", begun.elapsed());
        disk.run();
    }

    #[test]
    fn a_thread_that_is_slow_but_takes_something_is_waited_for() {
        let (queue, moments) = sync_channel(2);
        let (_emptied, spare) = sync_channel(1);
        let (done, end) = sync_channel(1);
        let taken = Arc::new(AtomicU64::new(0));
        let counter = Arc::clone(&taken);
        std::thread::spawn(move || {
            for item in moments {
                pause(Duration::from_millis(100));
                counter.fetch_add(1, Ordering::Relaxed);
                if matches!(item, Item::End(..)) {
                    return done.send(Ok(())).unwrap();
                }
            }
        });
        let patience = Duration::from_millis(1000);
        let mut sink =
            Sink { queue, spare, end, taken, waits: Some(patience), gap: Gap::default(), left_out: 0, stuck: false };
        let begun = now();
        for tick in 0..15 {
            sink.take(&mut moment(tick));
        }
        sink.finish(Ending::default()).unwrap();
        assert!(begun.elapsed() > patience, "{:?}: it is not slow", begun.elapsed());
    }

    #[test]
    fn a_full_disk_is_said_and_what_was_written_can_be_read() {
        let disk = Disk::new(true, 200_000);
        let mut sink = sink(&disk, 64, Some(PATIENCE));
        for tick in 0..3000 {
            sink.take(&mut moment(tick));
            if tick % 300 == 299 {
                pause(CHUNK);
            }
        }
        let error = sink.finish(Ending::default()).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull, "{error}");
        let record = Record::read(disk.bytes()).unwrap();
        let ticks = ticks(&record);
        assert!(!record.is_whole() && (100..3000).contains(&ticks.len()), "{} of {}", ticks.len(), disk.bytes().len());
        assert!(ticks.into_iter().eq(0..ticks_end(&record)));
    }

    fn ticks_end(record: &Record) -> u64 {
        ticks(record).last().map_or(0, |last| last + 1)
    }

    #[test]
    fn the_file_is_there_from_the_beginning_and_grows_every_second() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        fs::write(&path, "an older file").unwrap();
        fs::hard_link(&path, folder.path().join("other")).unwrap();
        let mut sink = Sink::begin(&path, &scenario()).unwrap();
        let record = Record::open(&path).unwrap();
        assert_eq!((ticks(&record), record.is_whole(), record.scenario()), (vec![], false, &scenario()));
        for tick in 0..50 {
            sink.take(&mut moment(tick));
        }
        pause(Duration::from_secs(1));
        let record = Record::open(&path).unwrap();
        assert!(ticks(&record).into_iter().eq(0..50) && !record.is_whole());
        sink.finish(Ending::default()).unwrap();
        let record = Record::open(&path).unwrap();
        assert!(ticks(&record).into_iter().eq(0..50) && record.is_whole());
        let names: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(names.len(), 2, "{names:?}");
        assert_eq!(fs::read_to_string(folder.path().join("other")).unwrap(), "an older file");
        assert!(Sink::begin(&folder.path().join("no/such/folder"), &scenario()).is_err());
    }
}
