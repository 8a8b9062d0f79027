// SPDX-License-Identifier: Apache-2.0
//! A recording that is under way: the thread that drains, the thread that writes, and how both end.
use crate::ABOUT;
use crate::file::{Book, Sink};
use crate::page::Page;
use crate::room::{ROOM, Room};
use crate::sources::{Inputs, Numbered, Source, Timing};
use crate::state;
use crate::values::Values;
use indexmap::IndexMap;
use model::refusal::{Class, Refusal, Refusals};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::any::Any;
use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use supervisor::{Companion, End, Entry, System};

/// What is recorded.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Names of SVVs, `*` and `?` stand for any letters; those that are made later belong to it too. Of private cells: `INSTANCE:CELL`.
    pub svvs: Vec<String>,
    /// The private cells of all verb instances too.
    pub cells: bool,
    /// Everything that comes from outside too, so that the run can be run again. From before the first source is made, or refused.
    pub replay: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options { svvs: vec!["*".to_owned()], cells: false, replay: false }
    }
}

/// How a recording stands, or ended.
#[derive(Clone, Debug, Default, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "RecordingSummary"))]
pub struct Summary {
    /// The file.
    pub path: PathBuf,
    pub running: bool,
    /// Messages in the file, by channel; while it runs, in its whole chunks.
    pub counts: IndexMap<String, u64>,
    /// Messages that are not in it, by channel, where there are any.
    pub lost: IndexMap<String, u64>,
    /// Bytes of the file.
    pub bytes: u64,
    /// Why nothing more could be written, which ended it.
    pub failure: Option<String>,
}

/// A recording. Ends with [`Recorder::stop`], or with its system.
pub struct Recorder {
    room: Arc<Room>,
    stops: Arc<AtomicBool>,
    state: Arc<State>,
    threads: Mutex<Vec<JoinHandle<()>>>,
}

/// How a recording stands, for who waits for its end.
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
/// How long a chunk is filled: what a process that is killed loses. Of a run that is to be run again that is what killed it.
const CHUNK_MAX: Duration = Duration::from_secs(1);
const CHUNK_MAX_REPLAY: Duration = Duration::from_millis(100);

impl Recorder {
    /// Begins to record into a new file at `path`; the recording belongs to the system from then on, and ends with it. Its number there.
    /// Refused where the file cannot be made or there is one already, and where a name without `*` is of nothing.
    pub fn start(system: &System, path: &Path, options: &Options) -> Result<(u64, Arc<Recorder>), Refusals> {
        let file = OpenOptions::new().write(true).create_new(true).open(path).map_err(|why| {
            let remedy = if why.kind() == std::io::ErrorKind::AlreadyExists {
                "give it another name, or delete that file"
            } else {
                "does the folder exist, and may you write there?"
            };
            vec![Refusal::new(Class::ValueRefused, format!("cannot record into '{}': {why}", path.display())).remedy(remedy)]
        })?;
        let recorder = Recorder::start_in(system, Box::new(file), path, options, ROOM).inspect_err(|_| {
            // A file that holds nothing; where it cannot be deleted it says so by being empty.
            let _gone = std::fs::remove_file(path);
        })?;
        Ok((system.accompany(recorder.clone()), recorder))
    }

    /// The same into any sink, with `room` bytes for what waits for it, and without a place in the system.
    pub fn start_in(system: &System, sink: Box<dyn Sink>, path: &Path, options: &Options, room: usize) -> Result<Arc<Recorder>, Refusals> {
        let state_of = state::State::new(system.observer());
        let values = Values::new(system.tap_all(&options.svvs, options.cells)?);
        values.tap.hold_time();
        let (log, ends, timing) = (Numbered::log(system.observer()), Numbered::ends(system.observer()), Timing::new(system.observer()));
        values.tap.heard(log.next(), ends.next());
        let cannot =
            |why: String| vec![Refusal::new(Class::ValueRefused, format!("cannot record into '{}': {why}", path.display())).remedy("is the disk full?")];
        let chunk_max = if options.replay { CHUNK_MAX_REPLAY } else { CHUNK_MAX };
        let said = about(system);
        let book = Book::new(sink, (ABOUT, &said), chunk_max).map_err(|why| cannot(why.to_string()))?;
        let inputs = options.replay.then(|| Inputs::begin(system)).transpose()?;
        let recorder = Recorder {
            room: Arc::new(Room::new(room)),
            stops: Arc::default(),
            state: Arc::new(State { summary: Mutex::new(Summary { path: path.to_owned(), running: true, ..Summary::default() }), ended: Condvar::new() }),
            threads: Mutex::default(),
        };
        let (room, state, observer) = (recorder.room.clone(), recorder.state.clone(), system.observer());
        let stops = recorder.stops.clone();
        let writer = spawn("recorder-disk", move || write(&room, book, &state, &observer, &stops, said)).map_err(cannot)?;
        let drain =
            Drain { room: recorder.room.clone(), stops: recorder.stops.clone(), system: system.observer(), values, log, ends, timing, state: state_of, inputs };
        let drained = spawn("recorder", move || drain.run()).map_err(|why| {
            recorder.room.close();
            cannot(why)
        })?;
        recorder.locked_threads().extend([drained, writer]);
        Ok(Arc::new(recorder))
    }

    /// How it stands.
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

/// What is said of a recording in its file.
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
    room: Arc<Room>,
    stops: Arc<AtomicBool>,
    system: System,
    values: Values,
    log: Numbered<Entry>,
    ends: Numbered<End>,
    timing: Timing,
    state: state::State,
    inputs: Option<Inputs>,
}

impl Drain {
    fn run(mut self) {
        let mut page = Page::default();
        let mut channels = 0;
        loop {
            let stops = self.stops.load(Ordering::Acquire);
            page.renew(channels);
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
                page = self.room.put(page, self.system.is_virtual());
            }
            if stops {
                return self.room.close();
            }
            self.values.tap.wait(LOOK);
        }
    }
}

/// Writes until nothing more comes. A file that cannot be written any more ends the recording.
fn write(room: &Room, mut book: Book, state: &State, system: &System, stops: &AtomicBool, mut said: BTreeMap<String, String>) {
    let told = |book: &Book, running: bool| {
        let mut summary = state.locked();
        summary.running = running;
        summary.bytes = book.bytes;
        for count in &book.counts {
            summary.counts.insert(count.topic.clone(), count.written);
            if count.lost > 0 {
                summary.lost.insert(count.topic.clone(), count.lost);
            }
        }
        let is_new = book.failure.is_some() && summary.failure.is_none();
        summary.failure.clone_from(&book.failure);
        is_new.then(|| format!("cannot write '{}' any more: {}", summary.path.display(), book.failure.as_deref().unwrap_or_default()))
    };
    let mut has_lost = false;
    while let Some(page) = room.take() {
        book.write(&page);
        if !page.definitions.is_empty() && tell_more(system, &mut said) {
            book.say((ABOUT, &said));
        }
        let loses = !has_lost && !page.lost.is_empty();
        room.written(page);
        if let Some(failure) = told(&book, book.failure.is_none()) {
            system.recording_failed(&failure);
            stops.store(true, Ordering::Release);
        } else if loses {
            has_lost = true;
            system.note("recorder", "system", "values are lost: the disk is too slow, or they come too fast");
        }
    }
    if tell_more(system, &mut said) {
        book.say((ABOUT, &said));
    }
    book.finish();
    if let Some(failure) = told(&book, false) {
        system.recording_failed(&failure);
    }
    room.release();
    state.ended.notify_all();
}
