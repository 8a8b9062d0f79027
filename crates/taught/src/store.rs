// SPDX-License-Identifier: Apache-2.0
//! Access to a file's text: it is read, locked against other programs, and written atomically. The lock is the same as in the Python
//! package: it is on the folder, leaves no file behind, and also works for a file that does not exist yet.
use crate::refuse;
use model::refusal::{Class, Refusals};
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Maximum time that a change waits for another program's change to finish.
const WAIT_MAX: Duration = Duration::from_secs(2);
/// Interval between attempts to take the lock.
const LOOK: Duration = Duration::from_millis(5);
/// Maximum size of a file, bytes; sufficient for ten thousand points.
const BYTES_MAX: u64 = 4 << 20;
/// Number of files written by this process, used in the names of temporary files.
static WRITES: AtomicU64 = AtomicU64::new(0);

/// Returns the text of a file; `None` if the file does not exist.
pub fn read(path: &Path) -> Result<Option<String>, Refusals> {
    let cannot = |why: String| {
        refuse(Class::InvalidState, format!("cannot read the points file '{}': {why}", path.display()), "check that it is a text file that the system may read")
    };
    match fs::metadata(path) {
        Ok(about) if about.len() > BYTES_MAX => return Err(cannot(format!("it has {} bytes, but at most {BYTES_MAX} are supported", about.len()))),
        _ => {}
    }
    match fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(why) if why.kind() == ErrorKind::NotFound => Ok(None),
        Err(why) => Err(cannot(why.to_string())),
    }
}

/// Prevents other programs from changing files in the folder until the returned lock is dropped. Fails if another program holds the lock
/// for too long.
pub fn lock(path: &Path) -> Result<Option<OwnedFd>, Refusals> {
    // A folder that does not exist or does not support locks is not locked: the write reports the fault.
    let Ok(folder) = open(folder_of(&real(path)), OFlags::RDONLY | OFlags::CLOEXEC, Mode::empty()) else { return Ok(None) };
    let until = Instant::now() + WAIT_MAX;
    loop {
        match flock(&folder, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => return Ok(Some(folder)),
            Err(rustix::io::Errno::WOULDBLOCK) if Instant::now() < until => std::thread::sleep(LOOK),
            Err(rustix::io::Errno::WOULDBLOCK) => {
                let message = format!("cannot change the points file '{}': another program is changing files in that folder", path.display());
                return Err(refuse(Class::InvalidState, message, "try again"));
            }
            Err(_) => return Ok(None),
        }
    }
}

/// Replaces the file with a text in one step. Fails if the text cannot be written, in which case the file is unchanged; or if only the
/// sync of its folder failed, in which case the file has been replaced, but a power failure may undo this.
pub fn write(path: &Path, text: &str) -> Result<(), Refusals> {
    let path = real(path);
    let failed = |what: &'static str, remedy: &'static str| {
        let path = path.clone();
        move |why: std::io::Error| refuse(Class::InvalidState, format!("cannot {what} the points file '{}': {why}", path.display()), remedy)
    };
    put(&path, text).map_err(failed("write", "check that there is disk space, and that the system may write there; the file is unchanged"))?;
    // The new name must reach the disk too.
    File::open(folder_of(&path)).and_then(|folder| folder.sync_all()).map_err(failed("sync", "the file contains the change, but a power failure may undo it"))
}

fn put(path: &Path, text: &str) -> std::io::Result<()> {
    let name = path.file_name().ok_or(ErrorKind::InvalidInput)?.to_string_lossy();
    // A folder that supports no locks lets several threads of this process write at once.
    let new = path.with_file_name(format!(".{name}.{}.{}.new", std::process::id(), WRITES.fetch_add(1, Ordering::Relaxed)));
    let written = write_new(&new, path, text).and_then(|()| fs::rename(&new, path));
    if written.is_err() {
        let _left = fs::remove_file(&new);
    }
    written
}

fn write_new(new: &Path, path: &Path, text: &str) -> std::io::Result<()> {
    let mut file = File::create(new)?;
    file.write_all(text.as_bytes())?;
    if let Ok(about) = fs::metadata(path) {
        file.set_permissions(about.permissions())?;
    }
    file.sync_all()
}

/// Returns the file that a path resolves to, so that a link stays a link.
fn real(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf())
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
