// SPDX-License-Identifier: Apache-2.0
//! Locks on files, which the system takes away from a process that is killed. Used when ends are made and dropped, never on the real-time path.
//!
//! There are two kinds, and they do not know each other: one on the whole file, and one on each of its bytes. Both belong to the open file, so they
//! also hold between two openings of one process.
use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;

/// How a whole file is locked.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Whole {
    /// Beside others that lock it so.
    Shared,
    /// Alone.
    Alone,
}

/// Locks the whole file, waiting for who has it otherwise.
pub(crate) fn lock(file: &File, how: Whole) -> io::Result<()> {
    loop {
        match flock(file, operation(how)) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            result => return result,
        }
    }
}

/// As [`lock`], but false where it would have to wait.
pub(crate) fn try_lock(file: &File, how: Whole) -> io::Result<bool> {
    match flock(file, operation(how) | libc::LOCK_NB) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(false),
        Err(error) => Err(error),
    }
}

/// Gives the lock on the whole file back.
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
pub(crate) fn claim(file: &File, at: u32) -> io::Result<bool> {
    match of_byte(file, libc::F_OFD_SETLK, libc::F_WRLCK, at) {
        Ok(_) => Ok(true),
        Err(error) if matches!(error.raw_os_error(), Some(libc::EAGAIN | libc::EACCES)) => Ok(false),
        Err(error) => Err(error),
    }
}

/// Gives byte `at` back.
pub(crate) fn give_back(file: &File, at: u32) -> io::Result<()> {
    of_byte(file, libc::F_OFD_SETLK, libc::F_UNLCK, at).map(|_| ())
}

/// True if somebody else, in a process that lives, has byte `at`.
pub(crate) fn is_claimed(file: &File, at: u32) -> io::Result<bool> {
    Ok(i32::from(of_byte(file, libc::F_OFD_GETLK, libc::F_WRLCK, at)?.l_type) != libc::F_UNLCK)
}

fn of_byte(file: &File, command: i32, kind: i32, at: u32) -> io::Result<libc::flock> {
    let kind = kind.try_into().expect("the kinds of locks are small numbers");
    let whence = libc::SEEK_SET.try_into().expect("a small number too");
    let mut byte = libc::flock { l_type: kind, l_whence: whence, l_start: i64::from(at), l_len: 1, l_pid: 0 };
    // SAFETY: the structure lives through the call.
    if unsafe { libc::fcntl(file.as_raw_fd(), command, &mut byte) } == 0 { Ok(byte) } else { Err(io::Error::last_os_error()) }
}
