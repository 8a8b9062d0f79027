// SPDX-License-Identifier: Apache-2.0
//! A recording in progress: the draining thread, the writing thread, and how both end.
use crate::files::{Bounds, Files};
use crate::folder::{Disk, Folder};
use crate::left::{IDENTITY, left};
use crate::page::Page;
use crate::room::{ROOM, Room};
use crate::sources::{Inputs, NumberedRecords, Source, Timing};
use crate::state;
use crate::values::Values;
use indexmap::IndexMap;
use model::refusal::{Class, Refusal, Refusals};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::any::Any;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use supervisor::{Companion, End, Entry, System};

/// Options of a recording.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Names of SVVs, with `*` and `?` as wildcards; SVVs created later are included. Private cells are named `INSTANCE:CELL`.
    pub svvs: Vec<String>,
    /// Also records the private cells of all verb instances.
    pub cells: bool,
    /// Also records all external inputs, so that the run can be replayed. Refused unless the recording starts before the first source is
    /// created.
    pub replay: bool,
    /// Approximate file size in bytes at which the next file is started; `None` for a single file.
    pub split_bytes: Option<u64>,
    /// Number of files to keep if the recording is split (the oldest is deleted); `None` to keep all.
    pub keep: Option<u32>,
    /// Identity by which a later recording that continues this one finds its files; `None` if it cannot be continued.
    pub identity: Option<String>,
    /// Continues after the existing files at that path; files with this identity count towards `keep`.
    pub resumes: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options { svvs: vec!["*".to_owned()], cells: false, replay: false, split_bytes: None, keep: None, identity: None, resumes: false }
    }
}

/// State of a recording; remains available after its end.
#[derive(Clone, Debug, Default, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "RecordingSummary"))]
pub struct Summary {
    /// Path of the file, or of the first file if the recording is split.
    pub path: PathBuf,
    /// Existing files, oldest first; the last one is being written.
    pub files: Vec<PathBuf>,
    pub running: bool,
    /// Number of written messages by channel; while the recording is in progress, only those in complete chunks.
    pub counts: IndexMap<String, u64>,
    /// Number of messages that could not be written, by channel; channels without losses are omitted.
    pub lost: IndexMap<String, u64>,
    /// Total size of the existing files, bytes.
    pub bytes: u64,
    /// Free space on the disk at the last write, bytes, if known.
    pub free_bytes: Option<u64>,
    /// Failure that ended the recording, if any.
    pub failure: Option<String>,
}

/// A recording in progress. It ends with [`Recorder::stop`], or together with its system.
pub struct Recorder {
    room: Arc<Room>,
    stops: Arc<AtomicBool>,
    state: Arc<State>,
    threads: Mutex<Vec<JoinHandle<()>>>,
}

/// State of a recording, on which callers wait for its end.
struct State {
    summary: Mutex<Summary>,
    ended: Condvar,
}

impl State {
    fn locked(&self) -> MutexGuard<'_, Summary> {
        self.summary.lock().expect("nobody panics with the lock held")
    }
}

/// Period at which the sources are drained.
const LOOK: Duration = Duration::from_millis(20);
/// Maximum time for which messages are collected into a chunk, and therefore the time that is lost if the process is killed.
/// `CHUNK_MAX_REPLAY` applies to a recording for replay, in which the lost messages would be the inputs that killed the process.
const CHUNK_MAX: Duration = Duration::from_secs(1);
const CHUNK_MAX_REPLAY: Duration = Duration::from_millis(100);

impl Recorder {
    /// Starts recording to a new file at `path`. The recording belongs to the system and ends with it. Returns its number in the system.
    /// Refuses an existing file, a file that cannot be created, a full disk, a name without `*` that does not exist, and limits that
    /// cannot be met.
    pub fn start(system: &System, path: &Path, options: &Options) -> Result<(u64, Arc<Recorder>), Refusals> {
        let disk = if options.resumes { Disk::behind(path) } else { Disk::new(path) };
        let recorder = Recorder::start_in(system, Box::new(disk), path, options, ROOM)?;
        Ok((system.accompany(recorder.clone()), recorder))
    }

    /// Starts recording to any folder, with `room` bytes for pending pages, without registering the recording in the system.
    pub fn start_in(system: &System, folder: Box<dyn Folder>, path: &Path, options: &Options, room: usize) -> Result<Arc<Recorder>, Refusals> {
        let bounds = Bounds { split: options.split_bytes, keep: options.keep };
        bounds.check(options.replay).map_err(|why| vec![why])?;
        let cannot =
            |why: String, remedy: &str| vec![Refusal::new(Class::ValueRefused, format!("cannot record into '{}': {why}", path.display())).remedy(remedy)];
        let chunk_max = if options.replay { CHUNK_MAX_REPLAY } else { CHUNK_MAX };
        let mut said = about(system);
        said.extend(options.identity.iter().map(|identity| (IDENTITY.to_owned(), identity.clone())));
        let left = options.identity.as_deref().filter(|_| options.resumes).map_or_else(Vec::new, |identity| left(path, identity));
        let files = Files::begin(folder, bounds, said, left, chunk_max).map_err(|why| {
            let remedy = match why.kind() {
                ErrorKind::AlreadyExists => "give it another name, or delete that file",
                ErrorKind::StorageFull => "free up space on that disk, or record on another one",
                _ => "check that the folder exists and that you may write there",
            };
            cannot(why.to_string(), remedy)
        })?;
        match Drain::new(system, options) {
            Ok(drain) => Recorder::run(drain, files, room).map_err(|why| cannot(why, "check whether the machine is out of threads or memory")),
            Err(refused) => {
                files.give_up();
                Err(refused)
            }
        }
    }

    /// Starts the draining and writing threads. Fails with the reason if a thread cannot be created.
    fn run(drain: Drain, files: Files, room: usize) -> Result<Arc<Recorder>, String> {
        let summary = Summary { path: files.path().clone(), files: files.paths(), free_bytes: files.free(), running: true, ..Summary::default() };
        let recorder = Recorder {
            room: Arc::new(Room::new(room)),
            stops: Arc::default(),
            state: Arc::new(State { summary: Mutex::new(summary), ended: Condvar::new() }),
            threads: Mutex::default(),
        };
        let (room, stops, state, system) = (recorder.room.clone(), recorder.stops.clone(), recorder.state.clone(), drain.system.observer());
        let begun: Arc<AtomicBool> = Arc::default();
        let writer = Writer { room: recorder.room.clone(), stops: stops.clone(), begun: begun.clone(), state, system, files };
        let writer = spawn("recorder-disk", move || writer.run())?;
        let drained = spawn("recorder", move || drain.run(&room, &stops, &begun)).inspect_err(|_| recorder.room.close())?;
        recorder.locked_threads().extend([drained, writer]);
        Ok(Arc::new(recorder))
    }

    /// Returns the state of the recording.
    pub fn summary(&self) -> Summary {
        self.state.locked().clone()
    }

    /// Ends the recording, waiting at most `patience` for it to end; `running` in the result is false if it has ended.
    pub fn stop_within(&self, patience: Duration) -> Summary {
        self.stops.store(true, Ordering::Release);
        let state = self.state.locked();
        let waited = self.state.ended.wait_timeout_while(state, patience, |summary| summary.running).expect("nobody panics with the lock held");
        let summary = waited.0.clone();
        drop(waited);
        if !summary.running {
            // Both threads have finished. They are joined because a thread keeps its stack until then, and a recording stays registered
            // in its system.
            self.join();
        }
        summary
    }

    /// Ends the recording: writes the pending messages, then the end record. Idempotent.
    pub fn stop(&self) -> Summary {
        self.stops.store(true, Ordering::Release);
        self.join();
        self.summary()
    }

    fn join(&self) {
        for thread in self.locked_threads().drain(..) {
            // A thread that panicked has reported so; the file ends with its last chunk.
            let _ended = thread.join();
        }
    }

    fn locked_threads(&self) -> MutexGuard<'_, Vec<JoinHandle<()>>> {
        self.threads.lock().expect("nobody panics with the lock held")
    }
}

impl Companion for Recorder {
    fn end(&self) {
        self.stop();
    }

    fn as_any(self: Arc<Self>) -> Arc<dyn Any + Send + Sync> {
        self
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.stop();
    }
}

fn spawn(name: &str, run: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>, String> {
    std::thread::Builder::new().name(name.to_owned()).spawn(run).map_err(|why| why.to_string())
}

/// Returns the description of a recording for its file.
fn about(system: &System) -> BTreeMap<String, String> {
    let unix_ns = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos());
    let epoch_ns = i128::try_from(unix_ns).unwrap_or(0) - i128::from(system.now_ns());
    let clock = if system.is_virtual() { "virtual" } else { "monotonic" };
    [
        ("system", system.name().to_owned()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("clock", clock.to_owned()),
        // Time at which the system's clock was 0: times of messages are on that clock.
        ("epoch_unix_ns", epoch_ns.to_string()),
        ("begins_ns", system.now_ns().to_string()),
        ("configuration", text_of(&system.inventory())),
        ("names", text_of(&system.names())),
        ("schema", json!({"svv": "a channel with metadata kind, type and unit", "time": "ns on the system's clock"}).to_string()),
    ]
    .map(|(name, text)| (name.to_owned(), text))
    .into()
}

fn text_of(answer: &impl Serialize) -> String {
    serde_json::to_string(answer).expect("an answer of the supervisor has a JSON form")
}

/// Updates the configuration in the description of a recording; returns true if it has grown. An update is needed because a recording for
/// replay starts before any hardware is configured. When the configuration is dismantled at the end, the previous one is kept.
fn tell_more(system: &System, said: &mut BTreeMap<String, String>) -> bool {
    let now = about(system);
    let tells = |about: &BTreeMap<String, String>| about.get("configuration").map_or(0, String::len);
    let more = tells(&now) > tells(said);
    if more {
        let changed = now.into_iter().filter(|(name, _)| name == "configuration" || name == "names");
        said.extend(changed);
    }
    more
}

struct Drain {
    system: System,
    values: Values,
    log: NumberedRecords<Entry>,
    ends: NumberedRecords<End>,
    timing: Timing,
    state: state::State,
    inputs: Option<Inputs>,
}

impl Drain {
    /// Taps the recorded values. Fails if a name does not exist, or if it is too late to start a recording for replay.
    fn new(system: &System, options: &Options) -> Result<Drain, Refusals> {
        let values = Values::new(system.tap_all(&options.svvs, options.cells)?);
        values.tap.hold_time();
        let (log, ends, timing) = (NumberedRecords::log(system.observer()), NumberedRecords::ends(system.observer()), Timing::new(system.observer()));
        values.tap.heard(log.next(), ends.next());
        let inputs = options.replay.then(|| Inputs::begin(system)).transpose()?;
        Ok(Drain { state: state::State::new(system.observer()), system: system.observer(), values, log, ends, timing, inputs })
    }

    /// Fills pages until the recording must stop. `begun` is true if another file was started.
    fn run(mut self, room: &Room, stops: &AtomicBool, begun: &AtomicBool) {
        let mut page = Page::default();
        let mut channels = 0;
        loop {
            let stops = stops.load(Ordering::Acquire);
            page.renew(channels);
            if begun.swap(false, Ordering::AcqRel) {
                self.state.renew();
            }
            let heard = self.log.next();
            self.log.drain(&mut page);
            self.ends.drain(&mut page);
            self.timing.drain(&mut page);
            self.state.drain(&mut page, self.log.next() > heard);
            self.values.tap.heard(self.log.next(), self.ends.next());
            let passed_ns = if stops { i64::MAX } else { self.system.now_ns() };
            self.values.drain(&mut page, passed_ns);
            self.inputs.iter_mut().for_each(|inputs| inputs.drain(&mut page));
            if stops {
                self.state.shapes(&mut page, true);
            }
            channels += page.definitions.len();
            if !page.is_empty() {
                page = room.put(page, self.system.is_virtual());
            }
            if !stops {
                self.values.tap.wait(LOOK);
                continue;
            }
            // A file that was started meanwhile gets the installed definitions too.
            room.wait_written();
            if !begun.load(Ordering::Acquire) {
                return room.close();
            }
        }
    }
}

/// Writer of the pages, which runs until none are left. If the file can no longer be written, the recording ends.
struct Writer {
    room: Arc<Room>,
    stops: Arc<AtomicBool>,
    begun: Arc<AtomicBool>,
    state: Arc<State>,
    system: System,
    files: Files,
}

impl Writer {
    fn run(mut self) {
        let mut has_lost = false;
        while let Some(page) = self.room.take() {
            let rollover = self.files.write(&page);
            self.begun.fetch_or(rollover.begins, Ordering::AcqRel);
            if !page.definitions.is_empty() && tell_more(&self.system, self.files.said()) {
                self.files.say();
            }
            let loses = !has_lost && !page.lost.is_empty();
            self.room.written(page);
            if let Some(failure) = self.tell(self.files.book.failure.is_none()) {
                self.system.recording_failed(&failure);
                self.stops.store(true, Ordering::Release);
            } else if loses {
                has_lost = true;
                self.system.note("recorder", "system", "values are lost: the disk is too slow, or they arrive too fast");
            }
            rollover.undeleted.into_iter().for_each(|why| self.system.note("recorder", "system", &why));
        }
        if tell_more(&self.system, self.files.said()) {
            self.files.say();
        }
        self.files.book.finish();
        if let Some(failure) = self.tell(false) {
            self.system.recording_failed(&failure);
        }
        self.room.release();
        self.state.ended.notify_all();
    }

    /// Publishes the state of the recording; returns the reason for a failure the first time it is seen.
    fn tell(&self, running: bool) -> Option<String> {
        let book = &self.files.book;
        let mut summary = self.state.locked();
        (summary.running, summary.bytes, summary.free_bytes) = (running, self.files.bytes(), self.files.free());
        if summary.files.last() != Some(self.files.path()) {
            summary.files = self.files.paths();
        }
        for count in &book.counts {
            summary.counts.insert(count.topic.clone(), count.written);
            if count.lost > 0 {
                summary.lost.insert(count.topic.clone(), count.lost);
            }
        }
        let is_new = book.failure.is_some() && summary.failure.is_none();
        summary.failure.clone_from(&book.failure);
        is_new.then(|| format!("cannot write '{}' any longer: {}", self.files.path().display(), book.failure.as_deref().unwrap_or_default()))
    }
}
