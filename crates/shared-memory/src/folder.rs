// SPDX-License-Identifier: Apache-2.0
//! The folder of one run of a system: the names under which its processes find each other's memory, and how nothing of them stays.
//!
//! It holds names and locks only; memory is found through it (`offer`), and never lies in it.
//!
//! Each process that uses the folder locks the file `members` beside the others; the system takes that lock away when the process ends, however it ends.
//! A member that gets the lock alone knows that nobody is left, and removes the folder: each member tries when it leaves, and each
//! that enters tries it with the folders of other runs. A folder of another user, or one that others may write, is left alone.
use crate::locks::{self, Whole};
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The file system that is memory.
const ROOT: &str = "/dev/shm";
const PREFIX: &str = "opengpac-";
const MEMBERS: &str = "members";
/// Hexadecimal digits of a run's number.
const RUN_LEN: usize = 16;
/// Of a system's name in a folder's name; the run tells apart what is cut off.
const NAME_LEN_MAX: usize = 100;

/// A membership in a folder: it stays until the last member has left.
pub(crate) struct Folder {
    path: PathBuf,
    run: u64,
    members: File,
    /// Between the ends of one membership, which locks of their file do not tell apart.
    alone: Mutex<()>,
}

/// As long as it lives, nobody else changes a name of the folder.
pub(crate) struct Alone<'a> {
    folder: &'a Folder,
    at: u64,
    _here: MutexGuard<'a, ()>,
}

impl Drop for Alone<'_> {
    fn drop(&mut self) {
        // It fails for no file that was locked before.
        let _given = locks::give_back(&self.folder.members, self.at);
    }
}

impl Folder {
    /// Enters the folder of a run, which is made if this is its first member.
    pub fn enter(system: &str, run: u64) -> io::Result<Self> {
        let path = Path::new(ROOT).join(format!("{PREFIX}{}-{run:0RUN_LEN$x}", in_a_file_name(system)));
        loop {
            match DirBuilder::new().mode(0o700).create(&path) {
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
                _ => {}
            }
            if !is_ours(&path) {
                if !path.exists() {
                    // A sweep has found it without a member.
                    continue;
                }
                return Err(io::Error::other(format!("'{}' belongs to another user, or others may write there", path.display())));
            }
            let members = match open(&path.join(MEMBERS)) {
                // Its last member has removed it since.
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                members => members?,
            };
            locks::lock(&members, Whole::Shared)?;
            if is_at(&members, &path.join(MEMBERS)) {
                return Ok(Folder { path, run, members, alone: Mutex::new(()) });
            }
        }
    }

    /// The run that it is of.
    pub fn run(&self) -> u64 {
        self.run
    }

    /// Returns the path of a name in the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// All names in it.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        fs::read_dir(&self.path).into_iter().flatten().flatten().map(|entry| entry.path())
    }

    /// Waits for who comes or goes under the same number in any process; for a while, and no longer.
    pub fn alone(&self, at: u64) -> io::Result<Alone<'_>> {
        // Who panicked with it held has changed nothing half.
        let here = self.alone.lock().unwrap_or_else(PoisonError::into_inner);
        locks::claim_soon(&self.members, at)?;
        Ok(Alone { folder: self, at, _here: here })
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        remove_if_alone(&self.path, &self.members);
    }
}

/// Removes the folders of runs that have no member left, as of processes that were killed; how many there were.
pub(crate) fn sweep() -> usize {
    let Ok(entries) = fs::read_dir(ROOT) else { return 0 };
    let paths = entries.flatten().map(|entry| entry.path()).filter(|path| is_of_a_run(path) && is_ours(path));
    paths.filter(|path| open(&path.join(MEMBERS)).is_ok_and(|members| remove_if_alone(path, &members))).count()
}

fn is_of_a_run(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).and_then(|name| name.strip_prefix(PREFIX));
    let run = name.and_then(|name| name.rsplit_once('-')).map(|(_, run)| run);
    run.is_some_and(|run| run.len() == RUN_LEN && run.bytes().all(|b| b.is_ascii_hexdigit()))
}

/// Returns whether it is a folder, no link to one, of this user, where nobody else may write: else its maker says what is removed there.
fn is_ours(path: &Path) -> bool {
    // SAFETY: asks for a number.
    let user = unsafe { libc::geteuid() };
    fs::symlink_metadata(path).is_ok_and(|about| about.is_dir() && about.uid() == user && about.mode() & 0o022 == 0)
}

/// Removes a folder that has no member but who opened `members`; true if it was this call that did.
fn remove_if_alone(path: &Path, members: &File) -> bool {
    // The lock is held until the folder is gone, so nobody enters meanwhile. It may be on a file that somebody else has removed since it was opened:
    // then the folder is not what it was.
    locks::try_lock(members, Whole::Alone).unwrap_or(false) && is_at(members, &path.join(MEMBERS)) && remove(path)
}

/// Removes a folder that has no member; true if it was this call that did.
fn remove(path: &Path) -> bool {
    // `members` goes last: until then, who enters waits for the lock, and finds that the file is another one afterwards. Who enters between
    // the last two steps has made a new one, and keeps the folder.
    let entries = fs::read_dir(path).map(|entries| entries.flatten().map(|entry| entry.path()).collect::<Vec<_>>());
    for file in entries.unwrap_or_default().iter().filter(|file| !file.ends_with(MEMBERS)) {
        fs::remove_file(file).ok();
    }
    fs::remove_file(path.join(MEMBERS)).ok();
    fs::remove_dir(path).is_ok()
}

/// Opens a file for reading and writing, which is made where there is none; for its owner alone.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).create(true).truncate(false).mode(0o600).custom_flags(libc::O_NOFOLLOW).open(path)
}

/// True if `path` still leads to `file`: it was not removed, nor replaced, since it was opened.
pub(crate) fn is_at(file: &File, path: &Path) -> bool {
    let identity = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    match (file.metadata(), fs::metadata(path)) {
        (Ok(opened), Ok(found)) => identity(opened) == identity(found),
        _ => false,
    }
}

/// A system's name with nothing in it that a path gives a meaning to.
fn in_a_file_name(system: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "_-".contains(c) { c } else { '.' };
    system.chars().take(NAME_LEN_MAX).map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_lives_as_long_as_a_member_does() {
        let run = crate::new_run();
        let first = Folder::enter("folder-test/α", run).expect("there is shared memory");
        let path = first.path.clone();
        assert!(path.to_str().expect("text").contains("opengpac-folder-test..-"), "{path:?}");
        let second = Folder::enter("folder-test/α", run).expect("there is shared memory");
        open(&first.file("c1")).expect("it can be written");
        drop(first);
        assert!(path.exists());
        sweep();
        assert!(path.exists(), "a sweep spares what has a member");
        drop(second);
        assert!(!path.exists());
    }

    #[test]
    fn a_sweep_removes_what_nobody_is_a_member_of() {
        let folder = Folder::enter("swept", crate::new_run()).expect("there is shared memory");
        open(&folder.file("c1")).expect("it can be written");
        let path = folder.path.clone();
        // As a killed process leaves it: the lock goes, the files stay.
        locks::unlock(&folder.members).expect("it was locked");
        // Another sweep may have the lock just now: then that one removes it.
        while path.exists() {
            sweep();
            std::thread::yield_now();
        }
    }

    #[test]
    fn a_sweep_follows_no_link_and_touches_no_folder_where_others_may_write() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let elsewhere = std::env::temp_dir().join(format!("swept-{:x}", crate::new_run()));
        fs::create_dir(&elsewhere).expect("a folder");
        fs::write(elsewhere.join("precious"), "here").expect("it is ours");
        let link = Path::new(ROOT).join(format!("{PREFIX}link-{:016x}", crate::new_run()));
        symlink(&elsewhere, &link).expect("a link");
        let open_to_all = Path::new(ROOT).join(format!("{PREFIX}open-{:016x}", crate::new_run()));
        fs::create_dir(&open_to_all).expect("a folder");
        fs::set_permissions(&open_to_all, fs::Permissions::from_mode(0o777)).expect("it is ours");
        fs::write(open_to_all.join("c1"), "").expect("it is ours");
        sweep();
        assert!(elsewhere.join("precious").exists() && open_to_all.join("c1").exists());
        fs::remove_file(link).expect("it is ours");
        fs::remove_dir_all(open_to_all).expect("it is ours");
        fs::remove_dir_all(elsewhere).expect("it is ours");
    }

    #[test]
    fn a_sweep_leaves_what_is_not_a_runs() {
        for name in ["opengpac-x", "opengpac-x-12", "other-x-0123456789abcdef", "opengpac-x-0123456789abcdeg"] {
            assert!(!is_of_a_run(&Path::new(ROOT).join(name)), "{name}");
        }
        assert!(is_of_a_run(Path::new("/dev/shm/opengpac-a-b-0123456789abcdef")));
    }
}
