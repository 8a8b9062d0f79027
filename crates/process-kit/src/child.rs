// SPDX-License-Identifier: Apache-2.0
//! A process started here, or by a predecessor of this process. It is held by a descriptor, never by its process ID alone, which may have
//! been reused.
use crate::Status;
use crate::process::{ended, pid_of, process_descriptor, signal};
use std::io;
use std::os::fd::{AsFd, AsRawFd, OwnedFd};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time within which a dropped child must exit by itself.
const GRACE: Duration = Duration::from_secs(2);

/// A process. Dropping a process that was started here terminates it, along with every process that it started in its own group, unless
/// [`Child::leave`] is called. An adopted process continues when dropped.
#[derive(Debug)]
pub struct Child {
    pid: libc::pid_t,
    descriptor: OwnedFd,
    /// True if this process is the parent and must reap the child.
    is_ours: bool,
    /// Exit status of the child, once known.
    status: Mutex<Option<Status>>,
    is_left: bool,
}

impl Child {
    /// Wraps the process `pid`, which this process has just started and not yet reaped.
    pub(crate) fn started(pid: libc::pid_t) -> io::Result<Child> {
        match process_descriptor(pid) {
            Ok(descriptor) => Ok(Child { pid, descriptor, is_ours: true, status: Mutex::new(None), is_left: false }),
            Err(error) => {
                // SAFETY: the process is our child and not reaped: the number is its own.
                unsafe {
                    libc::kill(pid, libc::SIGKILL);
                    libc::waitpid(pid, std::ptr::null_mut(), 0);
                }
                Err(error)
            }
        }
    }

    /// Wraps a process that another process started, identified by its descriptor. Used by a returning supervisor to adopt its
    /// predecessor's processes.
    ///
    /// # Errors
    /// `InvalidData` if the descriptor does not refer to a process.
    pub fn adopt(descriptor: OwnedFd) -> io::Result<Child> {
        let pid = pid_of(descriptor.as_fd())?;
        Ok(Child { pid, descriptor, is_ours: false, status: Mutex::new(None), is_left: true })
    }

    /// Returns the process ID; -1 for an adopted process that had already exited.
    pub fn pid(&self) -> i32 {
        self.pid
    }

    /// Returns a second descriptor of the process, to send to another process.
    ///
    /// # Errors
    /// Fails if no descriptors are left.
    pub fn descriptor(&self) -> io::Result<OwnedFd> {
        self.descriptor.try_clone()
    }

    /// Waits for at most `limit` until the process has exited, and reaps it. Returns its exit status, or `None` if it is still running.
    pub fn wait(&self, limit: Duration) -> Option<Status> {
        let deadline = Instant::now() + limit;
        let mut status = self.status.lock().unwrap_or_else(PoisonError::into_inner);
        if status.is_none() && ended(self.descriptor.as_fd(), deadline.saturating_duration_since(Instant::now())) {
            *status = Some(self.reap());
        }
        *status
    }

    /// Returns true if the process is still running.
    pub fn is_running(&self) -> bool {
        self.wait(Duration::ZERO).is_none()
    }

    /// Kills the process immediately (SIGKILL).
    pub fn kill(&self) {
        signal(self.descriptor.as_fd(), libc::SIGKILL);
    }

    /// Asks the process to exit (SIGTERM), and kills it after `grace`. Returns its exit status.
    pub fn end(&self, grace: Duration) -> Status {
        signal(self.descriptor.as_fd(), libc::SIGTERM);
        // A stopped process would not receive the request.
        signal(self.descriptor.as_fd(), libc::SIGCONT);
        if let Some(status) = self.wait(grace) {
            return status;
        }
        self.kill();
        self.wait(GRACE).unwrap_or(Status::Ended)
    }

    /// Lets the process continue to run after this one has exited.
    pub fn leave(mut self) {
        self.is_left = true;
    }

    /// Removes the process's remains: the rest of its group and, if it is a child of this process, its zombie.
    fn reap(&self) -> Status {
        if !self.is_ours {
            return Status::Ended;
        }
        // SAFETY: all zeroes is a valid value, which the call fills; the process is our child and not reaped, so the number of its
        // group is still its own.
        let about = unsafe {
            libc::kill(-self.pid, libc::SIGKILL);
            let mut about: libc::siginfo_t = std::mem::zeroed();
            if libc::waitid(libc::P_PIDFD, self.descriptor.as_raw_fd() as libc::id_t, &mut about, libc::WEXITED) != 0 {
                return Status::Ended;
            }
            about
        };
        // SAFETY: `waitid` has filled the member of ended children.
        let status = unsafe { about.si_status() };
        match about.si_code {
            libc::CLD_EXITED => Status::Exited(status),
            code => Status::Killed { signal: status, core: code == libc::CLD_DUMPED },
        }
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        if !self.is_left && self.is_running() {
            self.end(GRACE);
        }
    }
}
