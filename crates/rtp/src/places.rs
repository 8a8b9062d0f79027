// SPDX-License-Identifier: Apache-2.0
//! Providers of remote processors: processes of this host, and other hosts.
use device::SafeHandle;
use interconnect::{Ends, Link};
use std::ffi::OsString;
use std::sync::Arc;
use std::time::Duration;

/// Refusal text of a build without links between hosts.
pub const NO_HOSTS: &str = "this build has no links between hosts: build them with `make setup-hosts` in the sources, or use the wheel, which has them";

/// Carrier of the connections between this process and a processor.
pub type Near = Box<dyn Ends>;

/// Starts processors in processes of this host, and finds processors that have joined from other hosts. Passed to a system by its
/// creator.
pub trait Places: Send + Sync {
    /// Sets the receiver of messages for users. Called once, before the first process.
    fn tell_to(&self, _tell: Tell) {}

    /// Starts a process of this host for processors: `name` is the name of its only processor, or the common name if several share it.
    ///
    /// # Errors
    /// Fails with a message if the process cannot start.
    fn process(&self, name: &str, bounds: &Bounds) -> Result<StartedProcessor, String>;

    /// Guards this process itself, for a processor that consists of threads of this process; `lost_after`: maximum suspension, if
    /// configured.
    ///
    /// # Errors
    /// Fails with a message if there is no guard.
    fn this(&self, _processor: &str, _lost_after: Option<Duration>) -> Result<Box<dyn ProcessorHold>, String> {
        Err("this system has no guard".to_owned())
    }

    /// Allows other hosts to join; `options`: JSON. `epoch_ns`: epoch of the system, on CLOCK_MONOTONIC.
    ///
    /// # Errors
    /// Fails with a message if the address is in use, or is not secured as required.
    fn listen(&self, _options: &str, _epoch_ns: i64) -> Result<(), String> {
        Err(NO_HOSTS.to_owned())
    }

    /// Closes everything that was started for the system.
    fn close(&self) {}

    /// Returns the command line of a process that replays a recording, and the interpreter that tries its modules; `None` if replay is
    /// not available.
    fn replay(&self) -> Option<(Vec<OsString>, OsString)> {
        None
    }

    /// Returns a processor on a host that has joined.
    ///
    /// # Errors
    /// Fails with a message if no host of that name has joined.
    fn host(&self, host: &str, processor: &str) -> Result<StartedProcessor, String>;
}

/// Function that replaces the handles with which the guard makes a device safe, and waits until the guard has received them. The list is
/// empty if the device was closed.
pub type Holder = Box<dyn Fn(&str, &[SafeHandle]) -> Result<(), String> + Send + Sync>;

/// A processor of this process, guarded until this value is dropped.
pub trait ProcessorHold: Send + Sync {
    /// Returns the function that passes handles to the guard; it may outlive this value.
    fn holder(&self) -> Holder;

    /// Reports that the local kernels are serving. Never blocks.
    fn beat(&self);
}

/// Maximum silence of each side of a remote processor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Time after which a processor in a process of this host is terminated if its heart stops beating; `None`: the guard decides.
    pub lost_after: Option<Duration>,
    /// Time for which a process that continues without its commander waits for a supervisor to take it over.
    pub patience: Duration,
    /// Time after which a commander that is merely suspended counts as disconnected.
    pub silence: Duration,
}

impl Default for Bounds {
    fn default() -> Bounds {
        Bounds { lost_after: None, patience: Duration::from_secs(10), silence: Duration::from_secs(40) }
    }
}

/// Function that reports a message to the user: kind, subject, text.
pub type Tell = Box<dyn Fn(&'static str, &str, String) + Send + Sync>;

/// A processor that runs but has not been greeted yet.
pub struct StartedProcessor {
    /// To it.
    pub link: Arc<dyn Link>,
    /// Carrier of the connections between this process and the processor.
    pub near: Near,
    /// Process of the processor.
    pub running: Arc<dyn ProcessorProcess>,
    /// Time without a message after which the processor is lost.
    pub silence: Duration,
    /// True if the processor was already running without a supervisor, and is about to be taken over.
    pub is_adopted: bool,
}

/// The process of a processor.
pub trait ProcessorProcess: Send + Sync {
    /// Returns the reason why the process ended, for example `was killed by signal 9 (SIGKILL)`. May wait briefly until the reason is
    /// known.
    fn cause(&self) -> String;

    /// Returns the step that was last seen running in a source of the process; `place` is the index of the source, in order of creation.
    /// Returns `None` if no step was running.
    fn step(&self, _place: usize) -> Option<u32> {
        None
    }

    /// Returns the index, in order of creation, of the timer that was last seen to keep the heart from beating; `None` if there was none.
    fn stuck(&self) -> Option<usize> {
        None
    }

    /// Notifies the implementation that the process is about to be asked to exit.
    fn ending(&self) {}

    /// Notifies the implementation that the process was adopted, and now belongs to this side.
    fn taken_over(&self) {}

    /// Waits for the process to exit, and kills it if that takes too long. Leaves nothing behind.
    fn end(&self);
}
