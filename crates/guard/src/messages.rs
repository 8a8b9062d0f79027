// SPDX-License-Identifier: Apache-2.0
//! Messages between a supervisor and the guard: one JSON text per frame, with descriptors.
use crate::watch::{Bounds, Cause};
use serde::{Deserialize, Serialize};

/// Request number of registrations handed over to another guard; requests of callers have higher numbers.
pub(crate) const HANDED_OVER: u64 = 0;

/// Request to the guard. Each is answered by one [`Tell::Done`] or [`Tell::Refused`] with its number.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct GuardRequest {
    pub request: u64,
    pub ask: Ask,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Ask {
    /// Guard a process. Descriptors: the process, then its heartbeat if it has bounds.
    Ward(WardText),
    /// Writes that make outputs of its device safe. The descriptor is that of their file.
    Handle(HandleText),
    /// The device was closed or made safe in an orderly way: its handles are forgotten.
    Release { ward: u64, device: String },
    /// The process ends in an orderly way, or its loss has been handled: it is forgotten, with its handles.
    Forget { ward: u64 },
    /// Request to beat, and to listen at the path: the guard that it stood in for has exited.
    Lead,
    /// Request of a returning supervisor: send everything that is guarded, including descriptors, then answer.
    Adopt,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct WardText {
    pub ward: u64,
    pub name: String,
    /// Maximum standstill of its heart, if it has one.
    pub bounds: Option<Bounds>,
    /// True if it is not killed when it stands still.
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
    /// First message on each link: rights that the operating system did not grant.
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
    /// A spared process stands still, and its outputs are safe.
    MadeSafe(Loss),
    /// The process continues.
    GoesOn {
        ward: u64,
    },
    /// Answer to [`Ask::Adopt`]. Descriptors: the hearts of guard and supervisor.
    Hearts,
    /// Answer to [`Ask::Adopt`], with the descriptors of [`Ask::Ward`] and [`Ask::Handle`].
    Ward(WardText),
    Handle(HandleText),
}

/// A process that was lost, or stands still and is spared, and the guard's reaction. Times are on the monotonic clock, which all
/// processes of a host share.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Loss {
    /// Number with which it was registered.
    pub ward: u64,
    /// Name of the process.
    pub name: String,
    /// Observation of the guard.
    pub cause: Cause,
    /// Time of the observation, ns.
    pub seen_ns: i64,
    /// Time at which the last safe value was written, ns.
    pub safe_ns: i64,
    /// Number of safe handles that were written.
    pub written: usize,
    /// Handles that could not be written, with the reason; the guard retries for some seconds.
    pub failed: Vec<String>,
}

impl std::fmt::Display for Loss {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let what = match self.cause {
            Cause::Died => "has ended",
            Cause::Frozen => "stood still (its heartbeat stopped)",
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
