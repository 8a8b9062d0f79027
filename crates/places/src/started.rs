// SPDX-License-Identifier: Apache-2.0
//! Starting processes for processors.
use crate::guarding::{Guarded, Guarding};
use crate::{BLACK_BOX, BLACK_BOX_SOURCES, HANDLES, HEART, LINK, PYTHON, RUN, SYSTEM};
use guard::{Child, Heartbeat, Launch, UnixLink};
use interconnect::{Ends, Link};
use kernel::{BLACK_BOX_LEN, NO_STEP};
use rtp::{Running, Started, Tell};
use shared_memory::SharedMemory;
use std::ffi::OsString;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Command lines of the processes that a system starts.
#[derive(Clone, Debug)]
pub struct Commands {
    /// Comes to call [`crate::processor`].
    pub processor: Vec<OsString>,
    /// Comes to call [`guard::run`].
    pub guard: Vec<OsString>,
    /// The interpreter that tries code modules.
    pub python: OsString,
}

/// Starts a process of this host for each processor that asks for one, guarded; and finds hosts that have joined.
pub struct Places {
    system: String,
    run: u64,
    commands: Commands,
    guarding: Guarding,
    #[cfg(feature = "hosts")]
    pub(crate) joined: crate::joined::Joined,
}

/// How long a processor of this host may be silent: it beats every 20 ms, but machines are held up.
const SILENCE: Duration = Duration::from_secs(5);

/// Processor time that a real-time thread may take without sleeping.
const REAL_TIME_MAX: Duration = Duration::from_secs(5);

/// How long a process may take to end by itself.
const GRACE: Duration = Duration::from_secs(3);

impl Places {
    /// For a system of this name.
    pub fn new(system: &str, commands: Commands) -> Places {
        Places {
            system: system.to_owned(),
            run: shared_memory::new_run(),
            commands,
            guarding: Guarding::default(),
            #[cfg(feature = "hosts")]
            joined: crate::joined::Joined::default(),
        }
    }
}

impl rtp::Places for Places {
    fn tell_to(&self, tell: Tell) {
        let tell: Arc<Tell> = Arc::new(tell);
        #[cfg(feature = "hosts")]
        {
            let tell = tell.clone();
            let _first = self.joined.tell.set(Box::new(move |kind, about, text| tell(kind, about, text)));
        }
        self.guarding.tell_to(Box::new(move |kind, about, text| tell(kind, about, text)));
    }

    fn close(&self) {
        self.guarding.close();
        #[cfg(feature = "hosts")]
        self.joined.close();
    }

    fn process(&self, processor: &str) -> Result<Started, String> {
        let (link, other) = UnixLink::pair().map_err(text)?;
        let (handles, handles_there) = UnixLink::pair().map_err(text)?;
        let heart = Heartbeat::new().map_err(text)?;
        let black_box = guard::SharedMemory::new(BLACK_BOX_SOURCES * BLACK_BOX_LEN).map_err(text)?;
        // Before the process, which then finds it there.
        let near: Box<dyn Ends> = Box::new(SharedMemory::new(&self.system, self.run).map_err(text)?);
        let child = Launch::new(self.commands.processor.iter().cloned())
            .descriptor(LINK, other)
            .descriptor(HANDLES, handles_there)
            .descriptor(HEART, heart.descriptor().map_err(text)?)
            .descriptor(BLACK_BOX, black_box.descriptor().map_err(text)?)
            .variable(SYSTEM, &self.system)
            .variable(RUN, self.run.to_string())
            .variable(PYTHON, &self.commands.python)
            .variable("OPENGPAC_PROCESSOR", processor)
            .real_time_max(REAL_TIME_MAX)
            .start()
            .map_err(text)?;
        let descriptor = child.descriptor().map_err(text)?;
        let guarded = self.guarding.watch(&self.commands.guard, processor, descriptor, heart, handles)?;
        let running = Arc::new(Process { child, guarded, black_box });
        Ok(Started { link: Arc::new(link) as Arc<dyn Link>, near, running, silence: SILENCE })
    }

    fn host(&self, host: &str, processor: &str) -> Result<Started, String> {
        #[cfg(feature = "hosts")]
        return self.joined.start(&self.system, host, processor);
        #[cfg(not(feature = "hosts"))]
        Err(format!("no host '{host}' has joined system '{}' for processor '{processor}': this build is without hosts", self.system))
    }

    #[cfg(feature = "hosts")]
    fn listen(&self, options: &str, epoch_ns: i64) -> Result<(), String> {
        self.joined.listen(&self.system, options, epoch_ns)
    }
}

struct Process {
    child: Child,
    guarded: Guarded,
    black_box: guard::SharedMemory,
}

impl Running for Process {
    fn cause(&self) -> String {
        self.child.wait(Duration::from_secs(1)).map_or_else(|| "does not answer".to_owned(), |status| status.to_string())
    }

    fn step(&self, place: usize) -> Option<u32> {
        let word = (place < BLACK_BOX_SOURCES).then(|| self.black_box.word(place * BLACK_BOX_LEN).load(Ordering::Relaxed))?;
        let started = self.black_box.word(place * BLACK_BOX_LEN + 8).load(Ordering::Relaxed);
        // The step is the first half; no loop ran where none was started.
        let step = word as u32;
        (step != NO_STEP && started != 0).then_some(step)
    }

    fn ending(&self) {
        self.guarded.forget();
    }

    fn end(&self) {
        if self.child.wait(GRACE).is_none() {
            self.child.end(GRACE);
        }
    }
}

pub(crate) fn text(why: impl std::fmt::Display) -> String {
    why.to_string()
}
