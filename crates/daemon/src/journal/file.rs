// SPDX-License-Identifier: Apache-2.0
//! File of a journal: used exclusively by one daemon, synced after each appended line, and rewritten as a whole by replacing it with a
//! new file.
use crate::journal::lines::{Head, text};
use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;
use serde::Serialize;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// Space reserved in addition to the requested line, bytes.
const AHEAD: u64 = 64 << 10;

/// An open journal file. Dropping it closes the file and makes it available to another daemon.
pub struct LogFile {
    path: PathBuf,
    /// Lock, held for the lifetime of this object. It is on a separate file, because the journal file is replaced.
    _lock: File,
    file: File,
    /// Length of the file, and end of the reserved space, bytes.
    len: u64,
    reserved: u64,
    /// Length of the file when it was last rewritten as a whole, bytes.
    rewritten: u64,
}

/// Reason why a journal is unavailable.
#[derive(Debug)]
pub enum Unavailable {
    /// The journal is in use by another daemon.
    Taken,
    Failed(io::Error),
}

/// Locks a journal, and returns the lock and the existing bytes; `None` if the file does not exist or is empty.
pub fn lock(path: &Path) -> Result<(File, Option<Vec<u8>>), Unavailable> {
    let lock = OpenOptions::new().write(true).create(true).truncate(false).mode(0o600).open(beside(path, "lock")).map_err(Unavailable::Failed)?;
    lock.try_lock().map_err(|why| match why {
        TryLockError::WouldBlock => Unavailable::Taken,
        TryLockError::Error(why) => Unavailable::Failed(why),
    })?;
    refuse_folder(folder(path)).map_err(Unavailable::Failed)?;
    refuse_open(path).and_then(|()| refuse_open(&beside(path, "files"))).map_err(Unavailable::Failed)?;
    match std::fs::read(path) {
        Ok(bytes) => Ok((lock, Some(bytes).filter(|bytes| !bytes.is_empty()))),
        Err(why) if why.kind() == io::ErrorKind::NotFound => Ok((lock, None)),
        Err(why) => Err(Unavailable::Failed(why)),
    }
}

/// Refuses a file or folder that another user of the machine can change, because anyone who can write to the journal controls the next
/// start.
fn refuse_open(path: &Path) -> io::Result<()> {
    let about = match std::fs::metadata(path) {
        Err(why) if why.kind() == io::ErrorKind::NotFound => return Ok(()),
        about => about?,
    };
    let mode = about.mode() & 0o777;
    if mode & 0o022 != 0 {
        let message = format!(
            "others may write '{}' (mode {mode:04o}), and so determine what the next start does: check its content, then chmod go-w it",
            path.display()
        );
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
    }
    let own = rustix::process::geteuid().as_raw();
    if about.uid() != own && about.uid() != 0 {
        let message = format!("'{}' belongs to user {}, but this is user {own}: give a journal of this user", path.display(), about.uid());
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
    }
    Ok(())
}

/// Refuses a folder in which every user of the machine can replace files.
fn refuse_folder(path: &Path) -> io::Result<()> {
    let mode = std::fs::metadata(path)?.mode();
    if mode & 0o002 != 0 && mode & 0o1000 == 0 {
        let message = format!("others may replace files in '{}' (mode {:04o}): chmod o-w it", path.display(), mode & 0o7777);
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
    }
    Ok(())
}

/// Returns the path of a file that accompanies another one: `cell.journal` → `cell.journal.lock`.
pub fn beside(path: &Path, what: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(what);
    name.into()
}

/// Returns the folder that contains a file.
pub fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

impl LogFile {
    /// Rewrites the file with these lines, under a lock that is already held.
    pub fn write<'a, T: Serialize + 'a>(path: &Path, lock: File, head: &Head, lines: impl Iterator<Item = &'a T>) -> io::Result<LogFile> {
        let (file, len) = write_whole(path, head, lines)?;
        Ok(LogFile { path: path.to_owned(), _lock: lock, file, len, reserved: len, rewritten: len })
    }

    /// Reserves space for a line of this many bytes, so that it can be appended after its call. Fails if the disk is full.
    pub fn reserve(&mut self, bytes: u64) -> io::Result<()> {
        let needed = self.len + bytes;
        if needed <= self.reserved {
            return Ok(());
        }
        let to = needed + AHEAD;
        match fallocate(&self.file, FallocateFlags::KEEP_SIZE, self.len, to - self.len) {
            Ok(()) => self.reserved = to,
            // The file system cannot reserve room: a lack of it is noticed only when writing.
            Err(Errno::OPNOTSUPP | Errno::NOSYS) => {}
            Err(why) => return Err(why.into()),
        }
        Ok(())
    }

    /// Appends a line. The line is on disk when this returns.
    pub fn append(&mut self, line: &impl Serialize) -> io::Result<()> {
        let text = text(line);
        self.file.write_all(&text)?;
        self.file.sync_data()?;
        self.len += text.len() as u64;
        Ok(())
    }

    /// Replaces the contents of the file with these lines.
    pub fn rewrite<'a, T: Serialize + 'a>(&mut self, head: &Head, lines: impl Iterator<Item = &'a T>) -> io::Result<()> {
        let (file, len) = write_whole(&self.path, head, lines)?;
        (self.file, self.len, self.reserved, self.rewritten) = (file, len, len, len);
        Ok(())
    }

    /// Returns true if the file has grown so much that most of its content is probably obsolete.
    pub fn has_grown(&self) -> bool {
        self.len > 4 * self.rewritten.max(1 << 20)
    }
}

/// Writes and syncs a new file next to the path and renames it, so that a reader sees either the old or the new file.
fn write_whole<'a, T: Serialize + 'a>(path: &Path, head: &Head, lines: impl Iterator<Item = &'a T>) -> io::Result<(File, u64)> {
    let new = beside(path, "new");
    // Removes the remains of a daemon that died during this step.
    let _gone = std::fs::remove_file(&new);
    let mut file = OpenOptions::new().append(true).create_new(true).mode(0o600).open(&new)?;
    let mut bytes = text(head);
    lines.for_each(|line| bytes.extend(text(line)));
    file.write_all(&bytes)?;
    file.sync_all()?;
    std::fs::rename(&new, path)?;
    File::open(folder(path))?.sync_all()?;
    Ok((file, bytes.len() as u64))
}
