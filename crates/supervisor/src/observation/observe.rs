// SPDX-License-Identifier: Apache-2.0
//! Snapshots and histories of a running system, read without disturbing it.
use crate::svvs::values::{Reading, are_read, ask_for, forget_snapshot, kept, taken, unanswered};
use crate::system::{System, WaitResult};
use model::refusal::Refusals;
use std::time::Duration;

/// A value in the history of an SVV: number, time in ns, bytes.
pub type Past = (u64, i64, Vec<u8>);

impl System {
    /// Returns one consistent snapshot: its time, and the bytes, number and time of each SVV. Each source reads its SVVs at its next
    /// boundary.
    pub fn read(&self, names: &[String]) -> Result<(i64, Vec<Reading>), Refusals> {
        if !self.shared.is_virtual {
            // A device that was just opened is read within a period of its source; `ask_for` names devices that are not.
            let _waited = self.shared.wait_for(None, FIRST_READING_MAX, |core| Ok(are_read(core, names).then_some(())))?;
        }
        let snapshot = self.shared.ask(|core| ask_for(core, names))?;
        let waited = self.shared.wait_for(None, READ_MAX, |core| Ok(taken(core, &snapshot, names.len())))?;
        match waited {
            WaitResult::Done(read) => Ok(read),
            _ => {
                let mut core = self.shared.locked();
                let why = unanswered(&core, &snapshot);
                forget_snapshot(&mut core, &snapshot);
                Err(why)
            }
        }
    }

    /// Returns up to `count` most recent values, oldest first.
    pub fn history(&self, name: &str, count: usize) -> Result<Vec<Past>, Refusals> {
        // The kept rows are referenced under the lock and copied without it, so no command waits.
        let kept = kept(&self.shared.locked(), name)?;
        Ok(kept.last(count))
    }
}

/// Maximum time for which a read waits for the first reading of a device.
const FIRST_READING_MAX: Duration = Duration::from_secs(1);
/// Maximum time for kernels to answer. They answer within a firing; a longer delay means that a processor is not running.
const READ_MAX: Duration = Duration::from_secs(5);
