// SPDX-License-Identifier: Apache-2.0
//! Scripts in progress, with their owners until the kernel acknowledges them.
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Consequence of the acknowledgement of a script.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Ticket(pub u64);

/// Owner of a submitted script.
pub(crate) enum Purpose {
    /// Script of this instance's sequence; the epoch identifies sequences that were abandoned.
    Sequence { instance: u64, epoch: u64 },
    /// Snapshot that the caller awaits under this ticket.
    Read { ticket: Ticket },
    /// Script of which the caller awaits only the acknowledgement.
    Carried { done: Arc<AtomicBool> },
    /// The acknowledgement has no effect.
    Nothing,
}

/// Scripts by number.
#[derive(Default)]
pub(crate) struct Scripts(HashMap<u64, Purpose>);

impl Scripts {
    pub fn sent(&mut self, script: u64, purpose: Purpose) {
        self.0.insert(script, purpose);
    }

    /// Removes the acknowledged script and returns its purpose.
    pub fn acknowledged(&mut self, script: u64) -> Purpose {
        self.0.remove(&script).unwrap_or(Purpose::Nothing)
    }

    /// Drops the values that a script will return for this ticket.
    pub fn give_up(&mut self, asked: Ticket) {
        self.0.retain(|_, purpose| !matches!(purpose, Purpose::Read { ticket } if *ticket == asked));
    }
}
