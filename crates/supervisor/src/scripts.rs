// SPDX-License-Identifier: Apache-2.0
//! Scripts on their way: whose each of them is, until its kernel acknowledges it.
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What somebody waits for that a script brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Ticket(pub u64);

/// Whose script it was that a kernel acknowledges.
pub(crate) enum Purpose {
    /// Of this instance's sequence (the count tells a sequence that was given up).
    Sequence { instance: u64, epoch: u64 },
    /// A snapshot: the caller waits under this ticket.
    Read { ticket: Ticket },
    /// Somebody waits for nothing but that.
    Carried { done: Arc<AtomicBool> },
    /// Nobody waits.
    Nothing,
}

/// By their numbers.
#[derive(Default)]
pub(crate) struct Scripts(HashMap<u64, Purpose>);

impl Scripts {
    pub fn sent(&mut self, script: u64, purpose: Purpose) {
        self.0.insert(script, purpose);
    }

    /// Whose the acknowledged script was.
    pub fn acknowledged(&mut self, script: u64) -> Purpose {
        self.0.remove(&script).unwrap_or(Purpose::Nothing)
    }

    /// What a script brings for this ticket is no longer waited for.
    pub fn nobody_reads(&mut self, asked: Ticket) {
        self.0.retain(|_, purpose| !matches!(purpose, Purpose::Read { ticket } if *ticket == asked));
    }
}
