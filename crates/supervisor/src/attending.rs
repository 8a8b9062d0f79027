// SPDX-License-Identifier: Apache-2.0
//! Attending: a caller handles kernel notifications itself while the supervisor's thread sleeps, because two threads that wake one after
//! the other and contend for the same lock would cost more than their work. The supervisor's thread is woken if a notification arrived
//! after the caller's last check, if something became due earlier than that thread expects, or by a source that the caller has not
//! checked for a millisecond.
use crate::core::Core;
use crate::stopping::lost_processors::next_answer;
use runtime::Host;
use std::sync::Arc;

/// Guard that lets the supervisor's thread sleep as long as it is held.
pub(crate) struct Attending {
    host: Arc<Host>,
    /// Number of rings at the last check.
    seen: u32,
    due: [Option<i64>; 2],
    is_settled: bool,
}

impl Attending {
    /// Starts attending. Must be called before any request to the kernels.
    pub fn new(core: &Core) -> Attending {
        let (host, due) = (core.host.clone(), due(core));
        let seen = host.rings();
        host.attend();
        Attending { host, seen, due, is_settled: false }
    }

    /// Stops attending. `core` is the state in which every notification up to ring `seen` has been handled.
    pub fn end(mut self, core: &Core, seen: u32) {
        self.seen = seen;
        self.is_settled = due(core).iter().zip(self.due).all(|(now, then)| now.is_none_or(|now| then.is_some_and(|then| then <= now)));
    }
}

impl Drop for Attending {
    fn drop(&mut self) {
        self.host.stop_attending(self.seen);
        if !self.is_settled {
            self.host.unpark();
        }
    }
}

/// Returns the times at which the supervisor's thread wakes by itself.
fn due(core: &Core) -> [Option<i64>; 2] {
    [core.next_wake(0), next_answer(core)]
}
