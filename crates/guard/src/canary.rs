// SPDX-License-Identifier: Apache-2.0
//! Canary: a thread whose exit indicates that its process is dying. To the operating system, a killed process has ended only after its
//! memory has been freed, which takes tens of milliseconds if the memory is large and locked. Its threads exit immediately.
//!
//! The memory of the heart identifies the canary. If the operating system cannot wait for a thread (before Linux 6.9), the exit of the
//! process is detected instead.
use process_kit::Heartbeat;
use process_kit::{ended, has_ended};
use scheduling::Children;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, FromRawFd, OwnedFd};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Priority above every kernel, so that the canary exits before any other thread runs.
const PRIORITY: u8 = 98;
/// Flag of `pidfd_open` for a thread instead of a process.
const PIDFD_THREAD: libc::c_long = libc::O_EXCL as libc::c_long;

/// Identity of the canary of a heart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Who {
    process: u32,
    thread: u32,
}

impl Who {
    fn of(word: u64) -> Option<Who> {
        let who = Who { process: (word >> 32) as u32, thread: word as u32 };
        (who.process != 0 && who.thread != 0).then_some(who)
    }

    fn this() -> Who {
        // SAFETY: asks about this thread.
        Who { process: std::process::id(), thread: unsafe { libc::gettid() }.cast_unsigned() }
    }

    fn word(self) -> u64 {
        u64::from(self.process) << 32 | u64::from(self.thread)
    }

    fn is_there(self) -> bool {
        Path::new(&format!("/proc/{}/task/{}", self.process, self.thread)).exists()
    }
}

/// Guard value: during its lifetime, the thread that created it is the canary of a heart.
pub(crate) struct Sings<'a>(&'a Heartbeat);

impl Sings<'_> {
    pub fn here(heart: &Heartbeat) -> Sings<'_> {
        heart.set_canary(Who::this().word());
        Sings(heart)
    }
}

impl Drop for Sings<'_> {
    /// Ends the canary in an orderly way, so that its exit is not taken for the death of the process.
    fn drop(&mut self) {
        self.0.set_canary(0);
    }
}

/// Makes the canary of one heart the canary of another heart too.
pub(crate) fn share(of: &Heartbeat, with: &Heartbeat) {
    with.set_canary(of.canary());
}

/// Starts a canary for the heart of this process, which lives as long as the process.
///
/// # Errors
/// Fails if no thread can be started.
pub fn sing(heart: Arc<Heartbeat>) -> io::Result<()> {
    let body = move || {
        let _granted = scheduling::prioritise(PRIORITY, Children::Ordinary);
        let _sings = Sings::here(&heart);
        loop {
            std::thread::park();
        }
    };
    std::thread::Builder::new().name("canary".into()).spawn(body).map(drop)
}

/// Canary of a heart, as seen by another process.
#[derive(Debug, Default)]
pub struct Canary {
    /// Identity last read from the heart, and the thread, if the operating system can wait for it.
    said: u64,
    thread: Option<Arc<OwnedFd>>,
}

impl Canary {
    /// Reads the canary's identity; `process`: the process to which the canary must belong, if known.
    pub fn look(&mut self, heart: &Heartbeat, process: Option<i32>) {
        let said = heart.canary();
        if said == self.said {
            return;
        }
        let who = Who::of(said).filter(|who| process.is_none_or(|process| process.cast_unsigned() == who.process));
        (self.said, self.thread) = (said, who.and_then(thread_of).map(Arc::new));
    }

    /// Returns true, once, if the canary has exited without being asked to: its process is dying.
    pub fn notice_dying(&mut self, heart: &Heartbeat) -> bool {
        let has_ended = self.thread.as_ref().is_some_and(|thread| has_ended(thread.as_fd()));
        if has_ended {
            self.thread = None;
        }
        // A canary that ends in an orderly way announces it first.
        has_ended && heart.canary() == self.said
    }

    /// Returns the descriptor to wait on.
    pub fn waits_for(&self) -> Option<BorrowedFd<'_>> {
        self.thread.as_ref().map(|thread| thread.as_fd())
    }

    /// Returns the same descriptor, for a thread that waits on it without this value.
    pub fn thread(&self) -> Option<Arc<OwnedFd>> {
        self.thread.clone()
    }
}

/// Waits for at most `span` until the thread exits.
pub fn wait(thread: &OwnedFd, span: Duration) {
    ended(thread.as_fd(), span);
}

fn thread_of(who: Who) -> Option<OwnedFd> {
    // SAFETY: asks for a descriptor; it is closed on exec by itself.
    let made = unsafe { libc::syscall(libc::SYS_pidfd_open, libc::c_long::from(who.thread), PIDFD_THREAD) };
    // SAFETY: it was made just now.
    let made = (made >= 0).then(|| unsafe { OwnedFd::from_raw_fd(made as i32) })?;
    // Information from another process is not trusted: the thread must belong to that process, and must have when the descriptor was
    // made.
    who.is_there().then_some(made)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_canary_that_ends_in_good_order_is_no_death() {
        let heart = Arc::new(Heartbeat::new().unwrap());
        let (ends, told) = std::sync::mpsc::channel::<()>();
        let (here, there) = std::sync::mpsc::channel::<()>();
        let its = heart.clone();
        let thread = std::thread::spawn(move || {
            let _sings = Sings::here(&its);
            here.send(()).unwrap();
            told.recv().unwrap();
        });
        there.recv().unwrap();
        let mut canary = Canary::default();
        canary.look(&heart, Some(std::process::id().cast_signed()));
        assert!(!canary.notice_dying(&heart));
        ends.send(()).unwrap();
        thread.join().unwrap();
        assert!(!canary.notice_dying(&heart));
    }

    #[test]
    fn what_names_no_thread_of_that_process_is_not_believed() {
        let heart = Heartbeat::new().unwrap();
        for (word, process) in [(7, None), (u64::from(std::process::id()) << 32 | 1, None), (Who::this().word(), Some(1))] {
            heart.set_canary(word);
            let mut canary = Canary::default();
            canary.look(&heart, process);
            assert!(canary.waits_for().is_none() && !canary.notice_dying(&heart), "{word:x}");
        }
    }
}
