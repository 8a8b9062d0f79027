// SPDX-License-Identifier: Apache-2.0
//! File locks, which the operating system releases when a process is killed. Used when ends are created and dropped, never on the
//! real-time path.
//!
//! There are two independent kinds: one on the whole file, and one on each of its bytes. Both belong to the open file, so they also apply
//! if one process opens the file twice.
//!
//! Waiting for a lock is limited in time, because a process may be stopped while it holds a lock, or hold it on purpose.
use std::fs::File;
use std::io;
use std::os::fd::{AsFd, AsRawFd};
use std::time::{Duration, Instant};

/// Maximum wait for a lock, and the interval between two attempts.
const WAIT_MAX: Duration = Duration::from_secs(2);
const AGAIN: Duration = Duration::from_micros(200);

/// Retries until `has` succeeds; fails if another holder keeps the lock for too long.
fn within(mut has: impl FnMut() -> io::Result<bool>) -> io::Result<()> {
    let since = Instant::now();
    while !has()? {
        if since.elapsed() > WAIT_MAX {
            let text = format!("another process has held a lock for {} s: it is stopped, or does so on purpose; end it", WAIT_MAX.as_secs());
            return Err(io::Error::new(io::ErrorKind::TimedOut, text));
        }
        std::thread::sleep(AGAIN);
    }
    Ok(())
}

/// Lock on a whole file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Whole {
    /// Shared with the holders of other shared locks.
    Shared,
    /// Exclusive.
    Alone,
}

/// Locks the whole file, waiting for conflicting holders.
pub(crate) fn lock(file: &File, how: Whole) -> io::Result<()> {
    within(|| try_lock(file, how))
}

/// Locks byte `at`, waiting for its holder.
pub(crate) fn claim_soon(file: &impl AsFd, at: u64) -> io::Result<()> {
    within(|| claim(file, at))
}

/// Locks like [`lock`], but returns false instead of waiting.
pub(crate) fn try_lock(file: &File, how: Whole) -> io::Result<bool> {
    match flock(file, operation(how) | libc::LOCK_NB) {
        Ok(()) => Ok(true),
        Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => Ok(false),
        Err(error) => Err(error),
    }
}

/// Releases the lock on the whole file; the end of the process also releases it.
#[cfg(test)]
pub(crate) fn unlock(file: &File) -> io::Result<()> {
    flock(file, libc::LOCK_UN)
}

fn operation(how: Whole) -> i32 {
    if how == Whole::Shared { libc::LOCK_SH } else { libc::LOCK_EX }
}

fn flock(file: &File, operation: i32) -> io::Result<()> {
    // SAFETY: a call on an open file.
    if unsafe { libc::flock(file.as_raw_fd(), operation) } == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

/// Locks byte `at`; returns false if it is locked by another holder.
pub(crate) fn claim(file: &impl AsFd, at: u64) -> io::Result<bool> {
    match of_byte(file, libc::F_OFD_SETLK, libc::F_WRLCK, at) {
        Ok(_) => Ok(true),
        Err(error) if matches!(error.raw_os_error(), Some(libc::EAGAIN | libc::EACCES)) => Ok(false),
        Err(error) => Err(error),
    }
}

/// Releases byte `at`.
pub(crate) fn give_back(file: &impl AsFd, at: u64) -> io::Result<()> {
    of_byte(file, libc::F_OFD_SETLK, libc::F_UNLCK, at).map(|_| ())
}

/// Returns true if another living holder has locked byte `at`.
pub(crate) fn is_claimed(file: &impl AsFd, at: u64) -> io::Result<bool> {
    Ok(i32::from(of_byte(file, libc::F_OFD_GETLK, libc::F_WRLCK, at)?.l_type) != libc::F_UNLCK)
}

fn of_byte(file: &impl AsFd, command: i32, kind: i32, at: u64) -> io::Result<libc::flock> {
    let kind = kind.try_into().expect("the kinds of locks are small numbers");
    let whence = libc::SEEK_SET.try_into().expect("a small number too");
    let mut byte = libc::flock { l_type: kind, l_whence: whence, l_start: (at & (u64::MAX >> 2)).cast_signed(), l_len: 1, l_pid: 0 };
    // SAFETY: the structure lives through the call.
    if unsafe { libc::fcntl(file.as_fd().as_raw_fd(), command, &mut byte) } == 0 { Ok(byte) } else { Err(io::Error::last_os_error()) }
}
