// SPDX-License-Identifier: Apache-2.0
//! Starting processes for processors.
use crate::{LINK, PYTHON, RUN, SYSTEM};
use guard::{Child, Launch, UnixLink};
use interconnect::{Ends, Link};
use rtp::{Running, Started};
use shared_memory::SharedMemory;
use std::ffi::OsString;
use std::sync::Arc;
use std::time::Duration;

/// Starts a process of this host for each processor that asks for one.
pub struct Places {
    system: String,
    run: u64,
    /// Comes to call [`crate::processor`].
    command: Vec<OsString>,
    /// Tries code modules.
    python: OsString,
}

/// How long a processor of this host may be silent: it beats every 20 ms.
const SILENCE: Duration = Duration::from_secs(2);

/// Processor time that a real-time thread may take without sleeping.
const REAL_TIME_MAX: Duration = Duration::from_secs(5);

/// How long a process may take to end by itself.
const GRACE: Duration = Duration::from_secs(3);

impl Places {
    /// For a system of this name. `command` starts a process that comes to call [`crate::processor`]; `python`: the interpreter that tries code modules there.
    pub fn new(system: &str, command: Vec<OsString>, python: OsString) -> Places {
        Places { system: system.to_owned(), run: shared_memory::new_run(), command, python }
    }
}

impl rtp::Places for Places {
    fn process(&self, processor: &str) -> Result<Started, String> {
        let (link, other) = UnixLink::pair().map_err(|why| why.to_string())?;
        // Before the process, which then finds it there.
        let near: Box<dyn Ends> = Box::new(SharedMemory::new(&self.system, self.run).map_err(|why| why.message)?);
        let child = Launch::new(self.command.iter().cloned())
            .descriptor(LINK, other)
            .variable(SYSTEM, &self.system)
            .variable(RUN, self.run.to_string())
            .variable(PYTHON, &self.python)
            .variable("OPENGPAC_PROCESSOR", processor)
            .real_time_max(REAL_TIME_MAX)
            .start()
            .map_err(|why| why.to_string())?;
        Ok(Started { link: Arc::new(link) as Arc<dyn Link>, near, running: Arc::new(Process(child)), silence: SILENCE })
    }

    fn host(&self, host: &str, _processor: &str) -> Result<Started, String> {
        Err(format!("no host '{host}' has joined system '{}'", self.system))
    }
}

struct Process(Child);

impl Running for Process {
    fn cause(&self) -> String {
        self.0.wait(Duration::from_secs(1)).map_or_else(|| "does not answer".to_owned(), |status| status.to_string())
    }

    fn end(&self) {
        if self.0.wait(GRACE).is_none() {
            self.0.end(GRACE);
        }
    }
}
