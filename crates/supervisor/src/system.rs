// SPDX-License-Identifier: Apache-2.0
//! A real-time system, with the calls of a programming system. Every call either takes full effect or refuses and changes nothing; calls
//! that wait can be abandoned at any time.
use crate::core::Core;
use crate::definitions::system_definitions::Definitions;
use crate::devices::errands::Errands;
use crate::observation::companions::Companions;
use crate::precedence::{Changes, LockedCore, Precedence};
use crate::processors::guard::ProcessGuard;
use crate::refuse::refuse;
use model::refusal::{Class, Refusals};
use runtime::Host;
use std::os::fd::{AsRawFd, OwnedFd, RawFd};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};

/// A real-time system in this process.
pub struct System {
    pub(crate) name: String,
    pub(crate) shared: Arc<SystemState>,
    pub(crate) supervisor: Mutex<Option<std::thread::JoinHandle<()>>>,
    /// False for an observer.
    pub(crate) owns: bool,
}

/// State shared by the calls and the supervisor's thread.
pub(crate) struct SystemState {
    pub host: Arc<Host>,
    /// Identifier of this run of the system.
    pub run: String,
    pub is_virtual: bool,
    pub definitions: Mutex<Definitions>,
    pub core: Precedence<Core>,
    /// Signals every change for which a thread may be waiting.
    pub changes: Changes,
    /// Flag that all devices of the host obey: an emergency stop sets it before waiting for anything.
    pub stop: Arc<AtomicBool>,
    pub closing: AtomicBool,
    pub closed: AtomicBool,
    /// Core and priority of the supervisor's thread: the core of its processor, and a priority above that of the processor's sources.
    pub post: Mutex<Post>,
    /// Provider of remote processors.
    pub places: OnceLock<Arc<dyn rtp::Places>>,
    pub companions: Mutex<Companions>,
    /// Driver service calls in progress.
    pub errands: Mutex<Errands>,
    /// Guard of this process.
    pub guarded: ProcessGuard,
    /// Descriptor that becomes readable after an end, for event loops.
    pub ended_fd: OwnedFd,
}

/// Configured core and priority of the supervisor's thread, and the privileges that it was not granted.
#[derive(Default)]
pub(crate) struct Post {
    pub wanted: Option<(u8, Option<usize>)>,
    pub taken: bool,
    pub missing: Vec<String>,
}

/// Result of a wait.
pub enum WaitResult<T> {
    Done(T),
    TimedOut,
    /// The time slice has expired: the caller may check for signals or show progress, and continue waiting.
    Slice,
}

impl System {
    pub(crate) fn of(name: &str, shared: Arc<SystemState>) -> System {
        System { name: name.to_owned(), shared, supervisor: Mutex::new(None), owns: false }
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the identifier of this run of the system; any later run has a different one, even under the same name.
    pub fn run(&self) -> &str {
        &self.shared.run
    }

    /// Returns true if time is virtual and advanced only by waits and `advance`.
    pub fn is_virtual(&self) -> bool {
        self.shared.is_virtual
    }

    /// Returns a descriptor that is readable whenever an instance has ended.
    pub fn ended_fd(&self) -> RawFd {
        self.shared.ended_fd.as_raw_fd()
    }
}

impl SystemState {
    pub fn definitions(&self) -> MutexGuard<'_, Definitions> {
        self.definitions.lock().expect("nobody panics while definitions change")
    }

    pub fn locked(&self) -> LockedCore<'_, Core> {
        self.core.lock()
    }

    /// Passes a command to the supervisor, and handles the kernels' immediate answers.
    pub fn command<T>(&self, command: impl FnOnce(&mut Core) -> Result<T, Refusals>) -> Result<T, Refusals> {
        let mut core = self.locked();
        if self.closed.load(Ordering::Acquire) {
            return Err(refuse(Class::InvalidState, "the system is closed", "create a new one"));
        }
        let wake = core.next_wake(0);
        core.drain();
        let result = command(&mut core);
        core.drain();
        self.announce(&mut core);
        // The supervisor's thread sleeps until its known deadline: wake it only if that has changed.
        let changed = core.next_wake(0) != wake;
        drop(core);
        if changed && !self.is_virtual {
            self.host.unpark();
        }
        result
    }

    /// Queries the kernels through the supervisor without changing anything.
    pub fn ask<T>(&self, ask: impl FnOnce(&mut Core) -> Result<T, Refusals>) -> Result<T, Refusals> {
        let mut core = self.locked();
        if self.closed.load(Ordering::Acquire) {
            return Err(refuse(Class::InvalidState, "the system is closed", "create a new one"));
        }
        ask(&mut core)
    }

    /// Handles the pending notifications of the kernels.
    pub fn settle(&self) {
        let mut core = self.locked();
        core.drain();
        self.announce(&mut core);
    }

    /// Wakes the waiting threads.
    pub fn announce(&self, core: &mut Core) {
        if core.observation.ended > 0 {
            let count: u64 = std::mem::take(&mut core.observation.ended);
            // SAFETY: the descriptor is open as long as `self` lives, and 8 bytes are what an eventfd takes.
            unsafe { libc::write(self.ended_fd.as_raw_fd(), (&raw const count).cast(), 8) };
        }
        self.changes.tell();
    }
}
