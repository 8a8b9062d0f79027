// SPDX-License-Identifier: Apache-2.0
//! A recording that is under way: the thread that drains, the thread that writes, and how both end.
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
    /// Names of SVVs, `*` and `?` stand for any letters; those that are made later belong to it too. Of private cells: `INSTANCE:CELL`.
    pub svvs: Vec<String>,
    /// The private cells of all verb instances too.
    pub cells: bool,
    /// Everything that comes from outside too, so that the run can be run again. From before the first source is made, or refused.
    pub replay: bool,
    /// Bytes of a file, about, from which on the next one begins; none: there is one file.
    pub split_bytes: Option<u64>,
    /// Files that stay where the recording is split, the oldest goes; none: all.
    pub keep: Option<u32>,
    /// Identity of the recording, by which its files are known to one that goes on behind them; none: nothing goes on behind them.
    pub identity: Option<String>,
    /// Goes on behind the files of that path that are there; those of this identity count for `keep`.
    pub resumes: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options { svvs: vec!["*".to_owned()], cells: false, replay: false, split_bytes: None, keep: None, identity: None, resumes: false }
    }
}

/// State of a recording, or its end.
#[derive(Clone, Debug, Default, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "RecordingSummary"))]
pub struct Summary {
    /// The file; of a recording that is split the first one.
    pub path: PathBuf,
    /// The files that are there, the oldest first; the last one is written.
    pub files: Vec<PathBuf>,
    pub running: bool,
    /// Messages that were written, by channel; while it runs, in whole chunks.
    pub counts: IndexMap<String, u64>,
    /// Messages that could not be written, by channel, where there are any.
    pub lost: IndexMap<String, u64>,
    /// Bytes of the files that are there.
    pub bytes: u64,
    /// Bytes that were free on their disk when it was written to last, where that is known.
    pub free_bytes: Option<u64>,
    /// Failure that ended the recording, if one did.
    pub failure: Option<String>,
}

/// A recording. Ends with [`Recorder::stop`], or with its system.
pub struct Recorder {
    room: Arc<Room>,
    stops: Arc<AtomicBool>,
    state: Arc<State>,
    threads: Mutex<Vec<JoinHandle<()>>>,
}

/// State of a recording, for callers that wait for its end.
struct State {
    summary: Mutex<Summary>,
    ended: Condvar,
}

impl State {
    fn locked(&self) -> MutexGuard<'_, Summary> {
        self.summary.lock().expect("nobody panics with the lock held")
    }
}

/// Between two looks at the sources.
const LOOK: Duration = Duration::from_millis(20);
/// Time for which a chunk is filled, and which a process that is killed loses. Of a run that is to be run again these are the inputs that killed it.
const CHUNK_MAX: Duration = Duration::from_secs(1);
const CHUNK_MAX_REPLAY: Duration = Duration::from_millis(100);

impl Recorder {
    /// Begins to record into a new file at `path`; the recording belongs to the system from then on, and ends with it. Its number there.
    /// Refused where the file cannot be made or there is one already, where its disk is full, where a name without `*` is of nothing, and
    /// bounds that cannot be kept.
    pub fn start(system: &System, path: &Path, options: &Options) -> Result<(u64, Arc<Recorder>), Refusals> {
        let disk = if options.resumes { Disk::behind(path) } else { Disk::new(path) };
        let recorder = Recorder::start_in(system, Box::new(disk), path, options, ROOM)?;
        Ok((system.accompany(recorder.clone()), recorder))
    }

    /// Starts the same into any folder, with `room` bytes for what waits for it, and without a place in the system.
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
                ErrorKind::StorageFull => "make room on that disk, or record on another one",
                _ => "does the folder exist, and may you write there?",
            };
            cannot(why.to_string(), remedy)
        })?;
        match Drain::new(system, options) {
            Ok(drain) => Recorder::run(drain, files, room).map_err(|why| cannot(why, "does the machine run out of threads or of memory?")),
            Err(refused) => {
                files.give_up();
                Err(refused)
            }
        }
    }

    /// Starts the thread that drains and the one that writes. Errors: why there is no thread.
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

    /// Returns its state.
    pub fn summary(&self) -> Summary {
        self.state.locked().clone()
    }

    /// Ends it, and waits at most so long for that: `running` tells whether it has ended.
    pub fn stop_within(&self, patience: Duration) -> Summary {
        self.stops.store(true, Ordering::Release);
        let state = self.state.locked();
        let waited = self.state.ended.wait_timeout_while(state, patience, |summary| summary.running).expect("nobody panics with the lock held");
        let summary = waited.0.clone();
        drop(waited);
        if !summary.running {
            // Both threads are at their ends. A thread keeps its stack until it is joined, and a recording stays known to its system.
            self.join();
        }
        summary
    }

    /// Ends it: what has come is written, then the end of the file. Twice is once.
    pub fn stop(&self) -> Summary {
        self.stops.store(true, Ordering::Release);
        self.join();
        self.summary()
    }

    fn join(&self) {
        for thread in self.locked_threads().drain(..) {
            // One that panicked has said so; the file ends with its last chunk.
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
        // When the system's clock stood at 0: times of messages are of that clock.
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

/// Puts the present configuration into what is said of a recording; whether it has become another. A recording for a replay begins
/// before there is any hardware. One that is taken apart at the end is told as it was.
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
    /// Taps what is to be recorded. Refused: a name is of nothing, or a replay can no longer begin.
    fn new(system: &System, options: &Options) -> Result<Drain, Refusals> {
        let values = Values::new(system.tap_all(&options.svvs, options.cells)?);
        values.tap.hold_time();
        let (log, ends, timing) = (NumberedRecords::log(system.observer()), NumberedRecords::ends(system.observer()), Timing::new(system.observer()));
        values.tap.heard(log.next(), ends.next());
        let inputs = options.replay.then(|| Inputs::begin(system)).transpose()?;
        Ok(Drain { state: state::State::new(system.observer()), system: system.observer(), values, log, ends, timing, inputs })
    }

    /// Fills pages until the recording is to stop. `begun`: another file has begun.
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
            // A file that has begun meanwhile is told what is installed too.
            room.wait_written();
            if !begun.load(Ordering::Acquire) {
                return room.close();
            }
        }
    }
}

/// Writes until nothing more comes. A file that can no longer be written ends the recording.
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
                self.system.note("recorder", "system", "values are lost: the disk is too slow, or they come too fast");
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

    /// Tells how the recording stands; why it fails, the first time.
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
        is_new.then(|| format!("cannot write '{}' any more: {}", self.files.path().display(), book.failure.as_deref().unwrap_or_default()))
    }
}
