// SPDX-License-Identifier: Apache-2.0
//! A caller that takes what the kernels tell by itself, while the supervisor's thread sleeps: two threads that wake one after the other, and
//! want the same lock, cost more than what they do. The supervisor's thread is woken for what came after the caller's last look, where what
//! it looked at is due earlier than that thread knows, and by a source where the caller has not looked for a millisecond.
use crate::core::Core;
use crate::stopping::lost_processors::next_answer;
use runtime::Host;
use std::sync::Arc;

/// The supervisor's thread may sleep as long as it lives.
pub(crate) struct Attending {
    host: Arc<Host>,
    /// Number of rings at the last look.
    seen: u32,
    due: [Option<i64>; 2],
    is_settled: bool,
}

impl Attending {
    /// Begins, before anything is asked of the kernels.
    pub fn new(core: &Core) -> Attending {
        let (host, due) = (core.host.clone(), due(core));
        let seen = host.rings();
        host.attend();
        Attending { host, seen, due, is_settled: false }
    }

    /// Ends. `core`: from which everything was taken that was rung for until `seen`.
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

/// Returns the times at which the supervisor's thread wakes up by itself.
fn due(core: &Core) -> [Option<i64>; 2] {
    [core.next_wake(0), next_answer(core)]
}
