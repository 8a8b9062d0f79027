// SPDX-License-Identifier: Apache-2.0
//! A guard that stands in for another one. The operating system immediately notifies the parent of a guard that was stopped or has
//! exited. It takes 0.1 s to be certain that the guard will not resume; in the meantime, another process guards in its place. If the
//! guard resumes, it is kept and its stand-in is terminated.
use crate::guard_event::GuardCommand;
use crate::messages::{Ask, HANDED_OVER};
use crate::registry::Registry;
use crate::serve::Hearts;
use crate::starting::{launch, send};
use interconnect::LinkClosed;
use process_kit::{Child, ChildChange, UnixLink, next_change};
use scheduling::Children;
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// Real-time priority of the waiting thread: above every ordinary thread, so that no load delays the start of another guard; below every
/// kernel.
const PRIORITY: u8 = 1;

/// Guard process that guards like any other, but neither beats nor listens until it is asked to lead.
pub(crate) struct StandIn {
    pub link: UnixLink,
    pub child: Child,
    /// Number of answers that the stand-in owes, including its greeting. They stay queued in its link.
    pub awaited: usize,
}

impl StandIn {
    /// Starts a stand-in and sends it all registrations. Fails with a human-readable reason if it cannot be started.
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

    /// Sends the stand-in another request. If it has exited by then, the receiver of its messages detects this.
    pub fn tell(&mut self, ask: Ask, descriptors: &[OwnedFd]) {
        let _gone = self.send(ask, descriptors);
    }

    /// Terminates the stand-in, which is no longer needed.
    pub fn end(self) {
        self.child.kill();
    }
}

/// Thread that waits for state changes of a guard process.
pub(crate) struct ChildWait {
    thread: JoinHandle<()>,
    is_over: Arc<AtomicBool>,
}

impl ChildWait {
    /// Starts the thread for a child of this process, because only the parent is notified of state changes. `changed` handles a change
    /// and stores whether it was the last one, under the lock that callers of [`ChildWait::is_over`] hold; it returns false if the guard
    /// no longer has an owner. Returns `None` if no thread or descriptor can be created.
    pub fn start(child: &Child, changed: impl Fn(ChildChange, &AtomicBool) -> bool + Send + 'static) -> Option<ChildWait> {
        let process = child.descriptor().ok()?;
        let is_over = Arc::new(AtomicBool::new(false));
        let over = is_over.clone();
        let body = move || {
            // Processes that this thread starts inherit the priority.
            let _granted = scheduling::prioritise(PRIORITY, Children::Inherit);
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

    /// Returns true if the exit of the process has been handled.
    pub fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Acquire)
    }

    /// Joins the thread, which exits once the guard process has exited.
    pub fn join(self) {
        // A panic of the thread has been printed already.
        let _ended = self.thread.join();
    }
}
