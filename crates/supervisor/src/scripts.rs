// SPDX-License-Identifier: Apache-2.0
//! Scripts in progress, with their owners until the kernel acknowledges them.
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Ticket under which a caller waits for the answer to a script.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Ticket(pub u64);

/// Owner of a submitted script.
pub(crate) enum Purpose {
    /// Script in the sequence of this instance. The epoch distinguishes it from scripts of abandoned sequences.
    Sequence { instance: u64, epoch: u64 },
    /// Snapshot for which the caller waits under this ticket.
    Read { ticket: Ticket },
    /// Script for which the caller waits only until it is acknowledged.
    Carried { done: Arc<AtomicBool> },
    /// Script whose acknowledgement has no effect.
    Nothing,
}

/// Scripts by number.
#[derive(Default)]
pub(crate) struct Scripts(HashMap<u64, Purpose>);

impl Scripts {
    pub fn sent(&mut self, script: u64, purpose: Purpose) {
        self.0.insert(script, purpose);
    }

    /// Removes an acknowledged script and returns its purpose.
    pub fn acknowledged(&mut self, script: u64) -> Purpose {
        self.0.remove(&script).unwrap_or(Purpose::Nothing)
    }

    /// Drops the values that a script will return for this ticket.
    pub fn give_up(&mut self, asked: Ticket) {
        self.0.retain(|_, purpose| !matches!(purpose, Purpose::Read { ticket } if *ticket == asked));
    }
}
