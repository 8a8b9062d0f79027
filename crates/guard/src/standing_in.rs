// SPDX-License-Identifier: Apache-2.0
//! A guard that stands in for another one. The operating system tells the parent of a guard at once that it was stopped or has ended;
//! until it is
//! certain that it will not go on, which takes 0.1 s, another process guards in its place. One that goes on is kept, and its stand-in ends.
use crate::guard_event::GuardCommand;
use crate::messages::{Ask, HANDED_OVER};
use crate::registry::Registry;
use crate::serve::Hearts;
use crate::starting::{launch, send};
use interconnect::LinkClosed;
use process_kit::{Child, ChildChange, UnixLink, next_change};
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// Above every ordinary thread, so that no load delays the start of another guard; below every kernel.
const PRIORITY: i32 = 1;

/// Guard process that guards as every other one does, but does not beat and cannot be found until it is asked to lead.
pub(crate) struct StandIn {
    pub link: UnixLink,
    pub child: Child,
    /// Answers that it owes, its greeting among them. They wait in its link.
    pub awaited: usize,
}

impl StandIn {
    /// Starts one and tells it everything that is registered. Errors: it cannot be started, in words.
    pub fn start(command: &GuardCommand, hearts: &Hearts, registry: &Registry) -> Result<StandIn, String> {
        let (link, child) = launch(command, hearts, true).map_err(|error| error.0)?;
        let mut stand_in = StandIn { link, child, awaited: 1 };
        registry.everything(|ask, descriptors| stand_in.send(ask, descriptors)).map_err(|LinkClosed| "it ended at once".to_owned())?;
        Ok(stand_in)
    }

    fn send(&mut self, ask: Ask, descriptors: &[OwnedFd]) -> Result<(), LinkClosed> {
        self.awaited += 1;
        send(&self.link, HANDED_OVER, ask, descriptors)
    }

    /// Tells it one thing more. One that is gone by then is found to be gone by who hears it.
    pub fn tell(&mut self, ask: Ask, descriptors: &[OwnedFd]) {
        let _gone = self.send(ask, descriptors);
    }

    /// Ends it: nobody needs it.
    pub fn end(self) {
        self.child.kill();
    }
}

/// Thread that waits for the changes of a guard process.
pub(crate) struct ChildWait {
    thread: JoinHandle<()>,
    is_over: Arc<AtomicBool>,
}

impl ChildWait {
    /// Starts it for a child of this process: of another one only its parent is told. `changed`: does what follows from a change, and
    /// stores whether
    /// that was the last one, with the lock that who asks [`ChildWait::is_over`] has; false where nobody has the guard. Without a thread
    /// or a
    /// descriptor there is none.
    pub fn start(child: &Child, changed: impl Fn(ChildChange, &AtomicBool) -> bool + Send + 'static) -> Option<ChildWait> {
        let process = child.descriptor().ok()?;
        let is_over = Arc::new(AtomicBool::new(false));
        let over = is_over.clone();
        let body = move || {
            prioritise();
            let mut last = ChildChange::Continued;
            while last != ChildChange::Ended {
                last = next_change(process.as_fd(), last == ChildChange::Stopped);
                if !changed(last, &over) {
                    return;
                }
            }
        };
        Some(ChildWait { thread: std::thread::Builder::new().name("waits-guard".into()).spawn(body).ok()?, is_over })
    }

    /// Returns whether it has dealt with the end of its process.
    pub fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Acquire)
    }

    /// Waits until it ends, which it does with its process.
    pub fn join(self) {
        // One that panicked has said so.
        let _ended = self.thread.join();
    }
}

/// Takes real-time priority where it is given, and passes it on to what is started here.
fn prioritise() {
    let parameter = libc::sched_param { sched_priority: PRIORITY };
    if process_kit::limit_real_time() {
        // SAFETY: this thread's own scheduling.
        unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &parameter) };
    }
}
