// SPDX-License-Identifier: Apache-2.0
//! Starts processes for processors.
use crate::adopting::{self, Enter, WaitingProcess};
use crate::guarding::{GuardedProcess, Guarding, WatchedProcess};
use crate::telling::Telling;
use crate::{BLACK_BOX, BLACK_BOX_SOURCES, GUARD, GUARD_HEART, HANDLES, HEART, LINK, PROCESSOR, RUN, SUPERVISOR_HEART, SYSTEM, text};
use interconnect::{Ends, Link};
use kernel::{BLACK_BOX_LEN, NO_STEP, RETIRED};
use process_kit::{Child, Heartbeat, Launch, Status, UnixLink};
use rtp::{Bounds, ProcessorHold, ProcessorProcess, StartedProcessor, Tell};
use shared_memory::SharedMemory;
use std::collections::HashSet;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Command lines of the processes that a system starts.
#[derive(Clone, Debug)]
pub struct Commands {
    /// Command line of a process that calls [`crate::processor`].
    pub processor: Vec<OsString>,
    /// Command line of a process that calls [`guard::run`].
    pub guard: Vec<OsString>,
    /// Command line of a process that calls `replay::serve`; if empty, recordings cannot be replayed while the system runs.
    pub replay: Vec<OsString>,
    /// Interpreter that tries code modules.
    pub python: OsString,
}

/// Starts the guarded processes of this host that processors request, and finds hosts that have joined.
pub struct Places {
    system: String,
    run: u64,
    commands: Commands,
    guarding: Guarding,
    adopts: bool,
    /// Names of the processes that have been searched for.
    sought: Mutex<HashSet<String>>,
    telling: Telling,
    pub(crate) joined: crate::joined::JoinedHosts,
}

/// Maximum silence of a processor on this host. It beats every 20 ms, but a machine may be held up.
const SILENCE: Duration = Duration::from_secs(5);

/// Maximum CPU time that a real-time thread may use without sleeping.
const REAL_TIME_MAX: Duration = Duration::from_secs(5);

/// Signal with which the guard kills a process.
const SIGKILL: i32 = 9;

/// Time within which a process must exit by itself.
const GRACE: Duration = Duration::from_secs(3);

impl Places {
    /// Starts and finds processes for the processors of the system `system`. If `adopts` is true, it first looks for a surviving process
    /// whose supervisor (of a system with this name) has exited, and starts a new one only if there is none.
    pub fn new(system: &str, commands: Commands, adopts: bool) -> Places {
        let (run, telling) = (shared_memory::new_run(), Telling::default());
        Places {
            system: system.to_owned(),
            run,
            commands,
            guarding: Guarding::new(adopting::guard_place(run), telling.clone()),
            adopts,
            sought: Mutex::default(),
            joined: crate::joined::JoinedHosts::new(telling.clone()),
            telling,
        }
    }

    /// Returns the process of this name that has lost a system of this name; searches only once. Fails with a message if it must not be
    /// taken over.
    fn adopted(&self, name: &str, bounds: &Bounds) -> Result<Option<StartedProcessor>, String> {
        if !self.adopts || !self.sought.lock().expect("nobody panics with the lock held").insert(name.to_owned()) {
            return Ok(None);
        }
        let Some(waiting) = adopting::find(&self.system, name)? else {
            self.telling.tell("processor", name, "none of its processes waits for a new supervisor: a new process is started".to_owned());
            return Ok(None);
        };
        let WaitingProcess { link, guard, process, heart } = waiting;
        let its_heart = same(&heart)?;
        let child = Child::adopt(process.try_clone().map_err(text)?).map_err(text)?;
        let (handles, handles_there) = UnixLink::pair().map_err(text)?;
        let near: Box<dyn Ends> = Box::new(SharedMemory::new(&self.system, self.run).map_err(text)?);
        let black_box = process_kit::SharedMemory::new(BLACK_BOX_SOURCES * BLACK_BOX_LEN).map_err(text)?;
        let handles = Arc::new(handles);
        let known = match &guard {
            Some(path) => self.guarding.adopt(&self.commands.guard, path, (name, child.pid()), bounds.lost_after, &handles)?,
            None => None,
        };
        let is_unguarded = known.is_none();
        let guarded = match known {
            Some(guarded) => guarded,
            None => {
                let watched = WatchedProcess { process, heart, lost_after: bounds.lost_after };
                self.guarding.watch(&self.commands.guard, name, watched, &handles)?
            }
        };
        guarded.own(false);
        let guard = if is_unguarded { self.guarding.path().cloned() } else { guard };
        let [guards, supervises] = guarded.hearts()?;
        let brings = [&handles_there, &black_box.descriptor().map_err(text)?, &guards, &supervises];
        adopting::say(&link, &Enter { run: self.run, guard, is_unguarded }, &brings)?;
        self.telling.tell("processor", name, format!("its process {} has lost its system, and will be taken over", child.pid()));
        let socket = adopting::place(&self.system, name, child.pid().cast_unsigned());
        let running = Arc::new(Process { child, guarded, heart: its_heart, black_box, socket });
        Ok(Some(StartedProcessor { link: Arc::new(link) as Arc<dyn Link>, near, running, silence: SILENCE, is_adopted: true }))
    }
}

impl rtp::Places for Places {
    fn tell_to(&self, tell: Tell) {
        self.telling.to(tell);
    }

    fn replay(&self) -> Option<(Vec<OsString>, OsString)> {
        let Commands { replay, python, .. } = &self.commands;
        (!replay.is_empty()).then(|| (replay.clone(), python.clone()))
    }

    fn close(&self) {
        self.guarding.close();
        self.joined.close();
    }

    fn this(&self, processor: &str, lost_after: Option<Duration>) -> Result<Box<dyn ProcessorHold>, String> {
        Ok(Box::new(self.guarding.watch_this(&self.commands.guard, processor, lost_after)?))
    }

    fn process(&self, name: &str, bounds: &Bounds) -> Result<StartedProcessor, String> {
        if let Some(adopted) = self.adopted(name, bounds)? {
            return Ok(adopted);
        }
        let (link, other) = UnixLink::pair().map_err(text)?;
        let (handles, handles_there) = UnixLink::pair().map_err(text)?;
        let heart = Heartbeat::new().map_err(text)?;
        let black_box = process_kit::SharedMemory::new(BLACK_BOX_SOURCES * BLACK_BOX_LEN).map_err(text)?;
        let [guards, supervises] = self.guarding.hearts(&self.commands.guard)?;
        // Before the process, which then finds it.
        let near: Box<dyn Ends> = Box::new(SharedMemory::new(&self.system, self.run).map_err(text)?);
        let mut launch = Launch::new(self.commands.processor.iter().cloned())
            .descriptor(LINK, other)
            .descriptor(HANDLES, handles_there)
            .descriptor(HEART, heart.descriptor().map_err(text)?)
            .descriptor(GUARD_HEART, guards)
            .descriptor(SUPERVISOR_HEART, supervises)
            .descriptor(BLACK_BOX, black_box.descriptor().map_err(text)?)
            .variable(SYSTEM, &self.system)
            .variable(RUN, self.run.to_string())
            .variable(PROCESSOR, name)
            .real_time_max(REAL_TIME_MAX);
        if let Some(path) = self.guarding.path() {
            launch = launch.variable(GUARD, path);
        }
        let child = launch.start().map_err(text)?;
        let watched = WatchedProcess { process: child.descriptor().map_err(text)?, heart, lost_after: bounds.lost_after };
        let heart = same(&watched.heart)?;
        let guarded = self.guarding.watch(&self.commands.guard, name, watched, &Arc::new(handles))?;
        let socket = adopting::place(&self.system, name, child.pid().cast_unsigned());
        let running = Arc::new(Process { child, guarded, heart, black_box, socket });
        Ok(StartedProcessor { link: Arc::new(link) as Arc<dyn Link>, near, running, silence: SILENCE, is_adopted: false })
    }

    fn host(&self, host: &str, processor: &str) -> Result<StartedProcessor, String> {
        self.joined.start(&self.system, host, processor)
    }

    fn listen(&self, options: &str, epoch_ns: i64) -> Result<(), String> {
        self.joined.listen(&self.system, options, epoch_ns)
    }
}

/// Duplicates the heartbeat. Fails with a message if no descriptors are left.
fn same(heart: &Heartbeat) -> Result<Heartbeat, String> {
    Heartbeat::received(heart.descriptor().map_err(text)?).map_err(text)
}

struct Process {
    child: Child,
    guarded: GuardedProcess,
    heart: Heartbeat,
    black_box: process_kit::SharedMemory,
    /// Path at which a new supervisor finds the process.
    socket: Option<PathBuf>,
}

impl Process {
    /// Removes the process's socket, which a killed process leaves behind.
    fn take_away(&self) {
        if let Some(socket) = self.socket.as_ref().filter(|_| !self.child.is_running()) {
            // It may have been removed already.
            let _removed = std::fs::remove_file(socket);
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.take_away();
    }
}

const RETIRED_TEXT: &str =
    "has ended itself: a block could not be ended, because it was in a library function that may hold a lock, or had masked every signal";

impl ProcessorProcess for Process {
    fn cause(&self) -> String {
        let ended = self.child.wait(Duration::from_secs(1));
        let killed = matches!(ended, Some(Status::Killed { signal: SIGKILL, .. } | Status::Ended));
        let stood_still = if killed { self.guarded.stood_still() } else { None };
        if ended == Some(Status::Exited(RETIRED)) {
            return RETIRED_TEXT.to_owned();
        }
        stood_still.or(ended.map(|status| status.to_string())).unwrap_or_else(|| "does not answer".to_owned())
    }

    fn step(&self, place: usize) -> Option<u32> {
        let word = (place < BLACK_BOX_SOURCES).then(|| self.black_box.word(place * BLACK_BOX_LEN).load(Ordering::Relaxed))?;
        let started = self.black_box.word(place * BLACK_BOX_LEN + 8).load(Ordering::Relaxed);
        // The step is the first half; it is meaningless if no loop was started.
        let step = word as u32;
        (step != NO_STEP && started != 0).then_some(step)
    }

    fn stuck(&self) -> Option<usize> {
        self.heart.held_up_by()
    }

    fn ending(&self) {
        self.guarded.forget();
    }

    fn taken_over(&self) {
        self.guarded.own(true);
    }

    fn end(&self) {
        if self.child.wait(GRACE).is_none() {
            self.child.end(GRACE);
        }
        self.take_away();
    }
}
