// SPDX-License-Identifier: Apache-2.0
//! Folder of one run of a system: the names under which its processes find each other's memory, and the removal of the folder.
//!
//! It contains only names and locks; memory is found through it (`offer`) but never stored in it.
//!
//! Each process that uses the folder holds a shared lock on the file `members`; the operating system releases the lock when the process
//! ends for whatever reason. A member that obtains the exclusive lock knows that it is the last one, and removes the folder: each member
//! tries this when it leaves, and each newcomer tries it with the folders of other runs. A folder that belongs to another user, or that
//! others can write to, is left alone.
use crate::locks::{self, Whole};
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Mount point of the in-memory file system.
const ROOT: &str = "/dev/shm";
const PREFIX: &str = "opengpac-";
const MEMBERS: &str = "members";
/// Number of hexadecimal digits in a run's number.
const RUN_LEN: usize = 16;
/// Maximum length of the system's name in the name of a folder; folders with truncated names are distinguished by their runs.
const NAME_LEN_MAX: usize = 100;

/// Membership in a folder, which exists until the last member has left.
pub(crate) struct Folder {
    path: PathBuf,
    run: u64,
    members: File,
    /// Serialises the ends of one membership. They share an open file, so file locks do not exclude them from one another.
    alone: Mutex<()>,
}

/// Guard during which no other thread or process changes a name of the folder.
pub(crate) struct Alone<'a> {
    folder: &'a Folder,
    at: u64,
    _here: MutexGuard<'a, ()>,
}

impl Drop for Alone<'_> {
    fn drop(&mut self) {
        // It cannot fail for a file that was locked before.
        let _given = locks::give_back(&self.folder.members, self.at);
    }
}

impl Folder {
    /// Enters the folder of a run; the first member creates it.
    pub fn enter(system: &str, run: u64) -> io::Result<Self> {
        let path = Path::new(ROOT).join(format!("{PREFIX}{}-{run:0RUN_LEN$x}", in_a_file_name(system)));
        loop {
            match DirBuilder::new().mode(0o700).create(&path) {
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
                _ => {}
            }
            if !is_ours(&path) {
                if !path.exists() {
                    // A sweep found it without a member.
                    continue;
                }
                return Err(io::Error::other(format!("'{}' belongs to another user, or others may write there", path.display())));
            }
            let members = match open(&path.join(MEMBERS)) {
                // Its last member has removed it meanwhile.
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                members => members?,
            };
            locks::lock(&members, Whole::Shared)?;
            if is_at(&members, &path.join(MEMBERS)) {
                return Ok(Folder { path, run, members, alone: Mutex::new(()) });
            }
        }
    }

    /// Returns the run that the folder belongs to.
    pub fn run(&self) -> u64 {
        self.run
    }

    /// Returns the path of a name in the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Returns all names in the folder.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        fs::read_dir(&self.path).into_iter().flatten().flatten().map(|entry| entry.path())
    }

    /// Excludes ends that are created or dropped under the same number in any process. Waits for them for a limited time.
    pub fn alone(&self, at: u64) -> io::Result<Alone<'_>> {
        // A holder that panicked left nothing half changed.
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

/// Removes the folders of runs that have no members left, for example because their processes were killed. Returns the number of folders
/// removed.
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

/// Returns true if the path is a folder (not a link) of this user that no other user can write to; otherwise, its creator would control
/// what is removed there.
fn is_ours(path: &Path) -> bool {
    // SAFETY: asks for a number.
    let user = unsafe { libc::geteuid() };
    fs::symlink_metadata(path).is_ok_and(|about| about.is_dir() && about.uid() == user && about.mode() & 0o022 == 0)
}

/// Removes a folder if the opener of `members` is its only member; returns true if this call removed it.
fn remove_if_alone(path: &Path, members: &File) -> bool {
    // The lock is held until the folder is deleted, so nobody enters meanwhile. It may be on a file that has been removed since it was
    // opened; the folder is then a different one.
    locks::try_lock(members, Whole::Alone).unwrap_or(false) && is_at(members, &path.join(MEMBERS)) && remove(path)
}

/// Removes a folder without members; returns true if this call removed it.
fn remove(path: &Path) -> bool {
    // `members` is removed last: until then a newcomer waits for the lock, and finds afterwards that the file is a different one. A
    // newcomer that enters between the last two steps has made a new one, and keeps the folder.
    let entries = fs::read_dir(path).map(|entries| entries.flatten().map(|entry| entry.path()).collect::<Vec<_>>());
    for file in entries.unwrap_or_default().iter().filter(|file| !file.ends_with(MEMBERS)) {
        fs::remove_file(file).ok();
    }
    fs::remove_file(path.join(MEMBERS)).ok();
    fs::remove_dir(path).is_ok()
}

/// Opens a file for reading and writing, creating it if necessary; accessible only to its owner.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).create(true).truncate(false).mode(0o600).custom_flags(libc::O_NOFOLLOW).open(path)
}

/// Returns true if `path` still refers to `file`, which has been neither removed nor replaced since it was opened.
pub(crate) fn is_at(file: &File, path: &Path) -> bool {
    let identity = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    match (file.metadata(), fs::metadata(path)) {
        (Ok(opened), Ok(found)) => identity(opened) == identity(found),
        _ => false,
    }
}

/// Returns a system's name in a form that is safe in a file name: shortened, with every character except ASCII letters, digits, `_` and
/// `-` replaced by a dot.
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
        // The state that a killed process leaves: no lock, but the files.
        locks::unlock(&folder.members).expect("it was locked");
        // A concurrent sweep may hold the lock and then removes it.
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
