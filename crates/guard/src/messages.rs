// SPDX-License-Identifier: Apache-2.0
//! Messages between a supervisor and the guard: one JSON text per frame, with descriptors.
use crate::watch::{Bounds, Cause};
use serde::{Deserialize, Serialize};

/// Request number of registrations handed over to another guard; requests of callers have higher numbers.
pub(crate) const HANDED_OVER: u64 = 0;

/// Request to the guard. Each request is answered by one [`Tell::Done`] or [`Tell::Refused`] with its number.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct GuardRequest {
    pub request: u64,
    pub ask: Ask,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Ask {
    /// Guards a process. Descriptors: the process and, if it has bounds, its heartbeat.
    Ward(WardText),
    /// Adds the writes that make outputs of a device of the process safe. Descriptor: the file to write to.
    Handle(HandleText),
    /// Removes the handles of a device that was closed or made safe in an orderly way.
    Release { ward: u64, device: String },
    /// Removes a process, with its handles, because it exits in an orderly way or its loss has been handled.
    Forget { ward: u64 },
    /// Makes a stand-in beat, and listen at the path, because the guard for which it stood in has exited.
    Lead,
    /// Request of a returning supervisor: the guard sends everything that it guards, including descriptors, and then the answer.
    Adopt,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct WardText {
    pub ward: u64,
    pub name: String,
    /// Maximum stall of the process's heart, if it has one.
    pub bounds: Option<Bounds>,
    /// True if the process is not killed when it stalls.
    pub is_spared: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct HandleText {
    pub ward: u64,
    pub device: String,
    pub writes: Vec<(u64, Vec<u8>)>,
    pub latches: bool,
}

/// Message from the guard.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Tell {
    /// First message on each link: privileges that the operating system did not grant.
    Hello {
        missing: Vec<String>,
    },
    Done {
        request: u64,
    },
    Refused {
        request: u64,
        problem: String,
    },
    /// A process is lost and its outputs are safe.
    Lost(Loss),
    /// A spared process has stalled, and its outputs are safe.
    MadeSafe(Loss),
    /// The process has resumed.
    GoesOn {
        ward: u64,
    },
    /// Answer to [`Ask::Adopt`]. Descriptors: the heartbeats of the guard and the supervisor.
    Hearts,
    /// Answer to [`Ask::Adopt`], with the same descriptors as [`Ask::Ward`] and [`Ask::Handle`].
    Ward(WardText),
    Handle(HandleText),
}

/// A process that was lost, or has stalled and is spared, and the guard's reaction. Times are on the monotonic clock, which all processes
/// of a host share.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Loss {
    /// Number under which the process was registered.
    pub ward: u64,
    /// Name of the process.
    pub name: String,
    /// Observation that led to the report.
    pub cause: Cause,
    /// Time of the observation, ns.
    pub seen_ns: i64,
    /// Time at which the last safe value was written, ns.
    pub safe_ns: i64,
    /// Number of safe handles that were written.
    pub written: usize,
    /// Handles that could not be written, with the reason; the guard retries for several seconds.
    pub failed: Vec<String>,
}

impl std::fmt::Display for Loss {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let what = match self.cause {
            Cause::Died => "has ended",
            Cause::Frozen => "hung (its heartbeat stopped)",
            Cause::Stopped => "was stopped (SIGSTOP, a debugger)",
        };
        let span_us = (self.safe_ns - self.seen_ns) as f64 * 1e-3;
        write!(f, "process '{}' {what}; {} safe handles were written after {span_us:.0} us", self.name, self.written)?;
        if !self.failed.is_empty() {
            write!(f, "; not made safe: {}", self.failed.join("; "))?;
        }
        Ok(())
    }
}

/// Returns the bytes of a message.
pub(crate) fn encode(message: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec(message).expect("these messages have no map with keys that are no texts")
}
