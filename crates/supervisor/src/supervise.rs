// SPDX-License-Identifier: Apache-2.0
//! The supervisor's thread.
use crate::precedence::first;
use crate::refuse::refuse;
use crate::stopping::emergency_stop::watch_inputs;
use crate::stopping::lost_processors::{look_for_lost, next_answer};
use crate::system::SystemState;
use model::refusal::{Class, Refusals};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Starts the supervisor's thread, which handles kernel notifications and deadlines.
pub(crate) fn supervise(shared: &Arc<SystemState>) -> Result<std::thread::JoinHandle<()>, Refusals> {
    let shared = shared.clone();
    let body = move || {
        // Ends and stops are handled here: this thread never waits for readers.
        first(|| serve(&shared));
    };
    std::thread::Builder::new()
        .name("supervisor".to_owned())
        .spawn(body)
        .map_err(|why| refuse(Class::InvalidState, format!("cannot start the supervisor: {why}"), "close other programs and try again"))
}

fn serve(shared: &SystemState) {
    loop {
        // Must be read before everything else, so that any change in between wakes the thread; commands of other threads poll too.
        let seen = shared.host.rings();
        if shared.closing.load(Ordering::Acquire) {
            return;
        }
        shared.take_post();
        let deadline = {
            let mut core = shared.locked();
            core.drain();
            let now_ns = shared.host.now_ns();
            core.serve_deadlines(now_ns);
            look_for_lost(&mut core);
            watch_inputs(&mut core);
            core.drain();
            shared.announce(&mut core);
            [core.next_wake(now_ns), next_answer(&core)].into_iter().flatten().min()
        };
        shared.host.park_since(seen, deadline);
    }
}

impl SystemState {
    /// Applies the core and priority of the supervisor's thread, if these have changed.
    fn take_post(&self) {
        let mut post = self.post.lock().expect("nobody panics with the lock held");
        if let (false, Some((priority, core))) = (post.taken, post.wanted) {
            post.missing = runtime::take_for_supervisor(priority, core);
            post.taken = true;
        }
    }
}
