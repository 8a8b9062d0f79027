// SPDX-License-Identifier: Apache-2.0
//! A process, held by a descriptor, never by its process ID alone, which may have been reused.
use std::io;
use std::os::fd::{AsRawFd, BorrowedFd, FromRawFd, OwnedFd};
use std::time::{Duration, Instant};

/// Returns a descriptor of a process. It becomes readable when the process exits, and signals sent through it cannot reach any other
/// process.
///
/// # Errors
/// Fails if there is no such process, or no descriptors are left.
pub fn process_descriptor(pid: libc::pid_t) -> io::Result<OwnedFd> {
    // SAFETY: asks for a descriptor; it is closed on exec by itself.
    match unsafe { libc::syscall(libc::SYS_pidfd_open, pid, 0) } {
        made if made >= 0 => {
            // SAFETY: it was made just now.
            Ok(unsafe { OwnedFd::from_raw_fd(made as i32) })
        }
        _ => Err(io::Error::last_os_error()),
    }
}

/// Returns a descriptor of this process, to send to the guard.
///
/// # Errors
/// Fails if no descriptors are left.
pub fn this_process() -> io::Result<OwnedFd> {
    process_descriptor(std::process::id().cast_signed())
}

/// Returns the process ID; -1 if the process has exited and was reaped.
///
/// # Errors
/// `InvalidData` if the descriptor does not refer to a process.
pub fn pid_of(process: BorrowedFd<'_>) -> io::Result<libc::pid_t> {
    let about = std::fs::read_to_string(format!("/proc/self/fdinfo/{}", process.as_raw_fd()))?;
    let pid = about.lines().find_map(|line| line.strip_prefix("Pid:")?.trim().parse::<libc::pid_t>().ok());
    pid.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "the descriptor is not one of a process"))
}

/// Returns true if a process has exited. Never blocks.
pub fn has_ended(process: BorrowedFd<'_>) -> bool {
    let mut poll = libc::pollfd { fd: process.as_raw_fd(), events: libc::POLLIN, revents: 0 };
    // SAFETY: one entry of our own; no time to wait.
    unsafe { libc::poll(&mut poll, 1, 0) > 0 }
}

/// Waits for at most `limit` until the process has exited; returns true if it has.
pub fn ended(process: BorrowedFd<'_>, limit: Duration) -> bool {
    let deadline = Instant::now() + limit;
    loop {
        let mut poll = libc::pollfd { fd: process.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        let left_ms = deadline.saturating_duration_since(Instant::now()).as_millis();
        // SAFETY: one entry of our own.
        let ready = unsafe { libc::poll(&mut poll, 1, i32::try_from(left_ms).unwrap_or(i32::MAX)) };
        if ready > 0 {
            return true;
        }
        if deadline <= Instant::now() + Duration::from_millis(1) {
            return false;
        }
    }
}

/// State change of a child of this process, reported by the operating system to the parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChildChange {
    /// The child was stopped by a signal (SIGSTOP).
    Stopped,
    /// The stopped child has continued.
    Continued,
    /// The child has exited.
    Ended,
}

/// Waits for the next state change of a child without reaping it: its exit, or [`ChildChange::Continued`] if it `is_stopped`, or
/// otherwise [`ChildChange::Stopped`]. A stop by a debugger is not reported. A process that is not a child of this one, or has been
/// reaped, counts as exited.
pub fn next_change(child: BorrowedFd<'_>, is_stopped: bool) -> ChildChange {
    let change = if is_stopped { libc::WCONTINUED } else { libc::WSTOPPED };
    loop {
        // SAFETY: all zeroes is a valid value, which the call fills.
        let (waited, code) = unsafe {
            let mut about: libc::siginfo_t = std::mem::zeroed();
            let waited = libc::waitid(libc::P_PIDFD, child.as_raw_fd() as libc::id_t, &mut about, change | libc::WEXITED | libc::WNOWAIT);
            (waited, about.si_code)
        };
        match code {
            libc::CLD_STOPPED if waited == 0 => return ChildChange::Stopped,
            libc::CLD_CONTINUED if waited == 0 => return ChildChange::Continued,
            _ if waited != 0 && io::Error::last_os_error().kind() == io::ErrorKind::Interrupted => {}
            _ => return ChildChange::Ended,
        }
    }
}

/// Sends a signal to exactly this process. Returns false if it has exited, or the caller is not permitted to signal it.
pub fn signal(process: BorrowedFd<'_>, signal: i32) -> bool {
    // SAFETY: takes no memory of ours.
    unsafe { libc::syscall(libc::SYS_pidfd_send_signal, process.as_raw_fd(), signal, std::ptr::null::<libc::siginfo_t>(), 0) == 0 }
}
