// SPDX-License-Identifier: Apache-2.0
//! Locks on files, which the system takes away from a process that is killed. Used when ends are made and dropped, never on the real-time path.
//!
//! There are two kinds, and they do not know each other: one on the whole file, and one on each of its bytes. Both belong to the open file, so they
//! also hold between two openings of one process.
//!
//! A thread that waits for one waits for a while and no longer: a process may be stopped with a lock held, or hold it on purpose.
use std::fs::File;
use std::io;
use std::os::fd::{AsFd, AsRawFd};
use std::time::{Duration, Instant};

/// Bound for the wait for a lock, and the time between two tries.
const WAIT_MAX: Duration = Duration::from_secs(2);
const AGAIN: Duration = Duration::from_micros(200);

/// Tries until it has succeeded; an error where somebody else has what is tried for too long.
fn within(mut has: impl FnMut() -> io::Result<bool>) -> io::Result<()> {
    let since = Instant::now();
    while !has()? {
        if since.elapsed() > WAIT_MAX {
            let text = format!("another process has held a lock for {} s: it is stopped, or holds it on purpose; end it", WAIT_MAX.as_secs());
            return Err(io::Error::new(io::ErrorKind::TimedOut, text));
        }
        std::thread::sleep(AGAIN);
    }
    Ok(())
}

/// Lock on a whole file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Whole {
    /// Beside others that lock it so.
    Shared,
    /// Alone.
    Alone,
}

/// Locks the whole file, waiting for who has it otherwise.
pub(crate) fn lock(file: &File, how: Whole) -> io::Result<()> {
    within(|| try_lock(file, how))
}

/// Locks byte `at`, waiting for who has it.
pub(crate) fn claim_soon(file: &impl AsFd, at: u64) -> io::Result<()> {
    within(|| claim(file, at))
}

/// As [`lock`], but false where it would have to wait.
pub(crate) fn try_lock(file: &File, how: Whole) -> io::Result<bool> {
    match flock(file, operation(how) | libc::LOCK_NB) {
        Ok(()) => Ok(true),
        Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => Ok(false),
        Err(error) => Err(error),
    }
}

/// Gives the lock on the whole file back, as the end of its process does.
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

/// Locks byte `at`, if nobody has; false where somebody has.
pub(crate) fn claim(file: &impl AsFd, at: u64) -> io::Result<bool> {
    match of_byte(file, libc::F_OFD_SETLK, libc::F_WRLCK, at) {
        Ok(_) => Ok(true),
        Err(error) if matches!(error.raw_os_error(), Some(libc::EAGAIN | libc::EACCES)) => Ok(false),
        Err(error) => Err(error),
    }
}

/// Gives byte `at` back.
pub(crate) fn give_back(file: &impl AsFd, at: u64) -> io::Result<()> {
    of_byte(file, libc::F_OFD_SETLK, libc::F_UNLCK, at).map(|_| ())
}

/// True if somebody else, in a process that lives, has byte `at`.
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
