// SPDX-License-Identifier: Apache-2.0
//! Failures of an invocation, with their messages.

/// Cause of a failed invocation. The invocation has changed nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The body returned this code.
    Returned(u32),
    /// The body panicked.
    Panicked,
    /// This output was not finite.
    NonFinite { item: String },
    /// A C++ exception escaped the body; contains its message.
    Threw { what: String },
    /// The body changed the floating-point control words.
    Floats,
    /// The body called fork().
    Forked,
    /// The body was aborted by a signal.
    Signal(i32),
    /// The body exceeded its time budget.
    Budget,
    /// A signal (its number, or 0 for an exceeded budget) in code of a library that may hold a lock: this process can no longer be
    /// trusted.
    Lost(i32),
}

impl core::fmt::Display for Fault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Fault::Returned(code) => write!(f, "the block returned fault {code}"),
            Fault::Panicked => write!(f, "the block panicked"),
            Fault::NonFinite { item } => write!(f, "output '{item}' is not finite"),
            Fault::Threw { what } => write!(f, "the block threw an exception: {what}"),
            Fault::Floats => write!(f, "the block {FLOATS_CHANGED}"),
            Fault::Forked => write!(f, "the block {CALLED_FORK}"),
            Fault::Signal(signal) => write!(f, "the block: {}", signal_text(*signal)),
            Fault::Budget => write!(f, "the block used up its time budget"),
            Fault::Lost(signal) => write!(f, "the block {}", lost_text(*signal)),
        }
    }
}

impl std::error::Error for Fault {}

/// Returns the text for a fault in code of a library; `signal` 0 represents an exceeded budget.
pub fn lost_text(signal: i32) -> String {
    let what = match signal {
        0 => "did not return in time from a library function that may hold a lock".to_owned(),
        signal => format!("has failed in a library function that may hold a lock: {}", signal_text(signal)),
    };
    format!("{what}; other users of that library may hang, so start this program again")
}

/// Text about a block that changed the floating-point control words or the direction flag.
pub const FLOATS_CHANGED: &str =
    "changed the floating-point state of its thread (rounding, flush-to-zero, traps or precision) or its direction flag; restore it before the body returns";

/// Text about a block that forked its process.
pub const CALLED_FORK: &str =
    "called fork(); the copy of the process was ended at once, because it shares the devices; start programs with posix_spawn(), outside the firing";

/// Pseudo signal number of a block that terminated its thread.
const ENDED_ITS_THREAD: i32 = 0xfd;

/// Returns the text for a signal.
pub fn signal_text(signal: i32) -> String {
    match signal {
        4 => "illegal instruction".to_owned(),
        5 => "a trap (SIGTRAP)".to_owned(),
        6 => "abort(), as a failed assertion and std::terminate() call it (SIGABRT)".to_owned(),
        7 => "access to memory that does not exist (bus error)".to_owned(),
        8 => "division by zero or another arithmetic fault".to_owned(),
        11 => "access to memory that it does not own (segmentation fault)".to_owned(),
        ENDED_ITS_THREAD => "pthread_exit(), which ends the thread of its source".to_owned(),
        other => format!("signal {other}"),
    }
}
