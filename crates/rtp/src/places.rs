// SPDX-License-Identifier: Apache-2.0
//! Sources of remote processors: processes of this host, and other hosts.
use device::SafeHandle;
use interconnect::{Ends, Link};
use std::ffi::OsString;
use std::sync::Arc;
use std::time::Duration;

/// Refusal of a build without links between hosts.
pub const NO_HOSTS: &str = "this build has no links between hosts: `make setup-hosts` builds them in the sources, and the wheel has them";

/// Carrier of the connections between this process and a processor.
pub type Near = Box<dyn Ends>;

/// Starts processors in processes of this host, and finds those that joined from others. Given to a system by its maker.
pub trait Places: Send + Sync {
    /// Sets the receiver of notes for people: their subject, and what happened. Called once, before the first process.
    fn tell_to(&self, _tell: Tell) {}

    /// Starts a process of this host for processors: `name` is that of the only one, or what those that share it call it.
    ///
    /// # Errors
    /// Returns why it cannot start, in words.
    fn process(&self, name: &str, bounds: &Bounds) -> Result<StartedProcessor, String>;

    /// Guards this process itself, for a processor that is threads of it; `lost_after`: how long it may stand still, where that was configured.
    ///
    /// # Errors
    /// There is no guard, in words.
    fn this(&self, _processor: &str, _lost_after: Option<Duration>) -> Result<Box<dyn ProcessorHold>, String> {
        Err("this system was made without a guard".to_owned())
    }

    /// Lets other hosts join; `options`: JSON. `epoch_ns`: of the system, on CLOCK_MONOTONIC.
    ///
    /// # Errors
    /// In words: the address is taken, or not secured as it needs.
    fn listen(&self, _options: &str, _epoch_ns: i64) -> Result<(), String> {
        Err(NO_HOSTS.to_owned())
    }

    /// Closes: nothing of what was started for the system stays.
    fn close(&self) {}

    /// Returns the command line of a process that runs a recording again, and the interpreter that tries its modules; none if there is none.
    fn replay(&self) -> Option<(Vec<OsString>, OsString)> {
        None
    }

    /// Returns a host that has joined, for a processor.
    ///
    /// # Errors
    /// None of that name has joined, in words.
    fn host(&self, host: &str, processor: &str) -> Result<StartedProcessor, String>;
}

/// Gives the guard what makes a device safe, instead of what it had for it, and waits until it has that; nothing: the device was closed.
pub type Holder = Box<dyn Fn(&str, &[SafeHandle]) -> Result<(), String> + Send + Sync>;

/// A processor of this process, guarded until this is dropped.
pub trait ProcessorHold: Send + Sync {
    /// Returns the holder that gives it handles; it may outlive this.
    fn holder(&self) -> Holder;

    /// Notes that the kernels here serve. Never waits.
    fn beat(&self);
}

/// Bounds for the silence of each side of a remote processor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Time after which a processor in a process of this host is ended if its heart stands still; none: as long as its guard finds right.
    pub lost_after: Option<Duration>,
    /// Time for which a process that goes on without its commander waits for a supervisor that takes it over.
    pub patience: Duration,
    /// Time after which its commander, if it only stands still, counts as gone.
    pub silence: Duration,
}

impl Default for Bounds {
    fn default() -> Bounds {
        Bounds { lost_after: None, patience: Duration::from_secs(10), silence: Duration::from_secs(40) }
    }
}

/// Tells people: kind, about what, text.
pub type Tell = Box<dyn Fn(&'static str, &str, String) + Send + Sync>;

/// A processor that runs and has not been greeted yet.
pub struct StartedProcessor {
    /// To it.
    pub link: Arc<dyn Link>,
    /// Carrier of the connections between this process and the processor.
    pub near: Near,
    /// Its process.
    pub running: Arc<dyn ProcessorProcess>,
    /// Time without a word after which it is lost.
    pub silence: Duration,
    /// True if it ran before, without a supervisor, and is about to be taken over.
    pub is_adopted: bool,
}

/// The process of a processor.
pub trait ProcessorProcess: Send + Sync {
    /// Returns the cause of its end in words: `was killed by signal 9 (SIGKILL)`. May wait a moment for its end to be known.
    fn cause(&self) -> String;

    /// Returns the step that source `place`, by the order in which the sources there were made, ran when it was looked at; none if none did.
    fn step(&self, _place: usize) -> Option<u32> {
        None
    }

    /// Returns the place, by the same order, of the timer that kept its heart from beating when that was looked at; none if none did.
    fn stuck(&self) -> Option<usize> {
        None
    }

    /// Notes that it is about to be told to end.
    fn ending(&self) {}

    /// Notes that it was adopted, and belongs to this side.
    fn taken_over(&self) {}

    /// Waits for its end, and ends it where it takes too long. Nothing of it is left.
    fn end(&self);
}
