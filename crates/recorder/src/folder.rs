// SPDX-License-Identifier: Apache-2.0
//! The folder that contains a recording's files: its disk, and the names of the files.
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file of a recording.
pub trait Sink: Write + Send {
    /// Truncates the file to its first `len` bytes.
    fn cut(&mut self, len: u64) -> io::Result<()>;
}

impl Sink for File {
    fn cut(&mut self, len: u64) -> io::Result<()> {
        self.set_len(len)
    }
}

/// Free space on a disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Space {
    /// Number of bytes that may still be written.
    pub free: u64,
    /// Number of bytes that a recording leaves free.
    pub spared: u64,
}

/// Folder in which the files of a recording are created.
pub trait Folder: Send {
    /// Creates the next file, empty. Fails if it cannot be created, or if the first file already exists.
    fn next(&mut self) -> io::Result<(PathBuf, Box<dyn Sink>)>;
    /// Deletes a file of the recording.
    fn remove(&mut self, path: &Path) -> io::Result<()>;
    /// Returns the free space on the disk; `None` if unknown.
    fn space(&self) -> Option<Space>;
}

/// Number of bytes that a recording leaves free on a large disk, for the journal, the audit file and the log on the same disk.
const SPARED: u64 = 256 << 20;
/// Divisor that gives the fraction of a small disk that a recording leaves free.
const SPARED_PART: u64 = 20;

/// Maximum number of names to try for the next file.
const TRIES: usize = 10;

/// Disk on which the files for a path are stored.
pub(crate) struct Disk {
    path: PathBuf,
    begun: bool,
}

impl Disk {
    /// Creates a folder that names files after `path`; the first file is `path` itself.
    pub fn new(path: &Path) -> Disk {
        Disk { path: path.to_owned(), begun: false }
    }

    /// Creates a folder whose new files continue the series after its last existing file.
    pub fn behind(path: &Path) -> Disk {
        Disk { path: path.to_owned(), begun: true }
    }

    fn make(path: &Path) -> io::Result<Box<dyn Sink>> {
        Ok(Box::new(OpenOptions::new().write(true).create_new(true).open(path)?))
    }
}

impl Folder for Disk {
    fn next(&mut self) -> io::Result<(PathBuf, Box<dyn Sink>)> {
        if !std::mem::replace(&mut self.begun, true) {
            return Ok((self.path.clone(), Disk::make(&self.path)?));
        }
        let mut made = Err(io::ErrorKind::AlreadyExists.into());
        for _ in 0..TRIES {
            let path = next_beside(&self.path);
            made = Disk::make(&path).map(|sink| (path, sink));
            // The file may have been created by another process meanwhile.
            if !made.as_ref().is_err_and(|why| why.kind() == io::ErrorKind::AlreadyExists) {
                break;
            }
        }
        made
    }

    fn remove(&mut self, path: &Path) -> io::Result<()> {
        match std::fs::remove_file(path) {
            Err(why) if why.kind() == io::ErrorKind::NotFound => Ok(()),
            removed => removed,
        }
    }

    fn space(&self) -> Option<Space> {
        let disk = rustix::fs::statvfs(parent(&self.path)).ok()?;
        Some(Space { free: disk.f_bavail.saturating_mul(disk.f_frsize), spared: SPARED.min(disk.f_blocks.saturating_mul(disk.f_frsize) / SPARED_PART) })
    }
}

fn parent(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Returns the next path in the series of a recording: `run.mcap`, then `run-2.mcap`, `run-3.mcap` and so on, after the last one that
/// exists.
///
/// Gaps in the numbers are not filled, so that numerical order is chronological order.
pub fn next_beside(path: &Path) -> PathBuf {
    let (stem, ending) = parts(path);
    let last = series(path).pop().map(|(number, _)| number);
    last.map_or_else(|| path.to_owned(), |last| path.with_file_name(format!("{stem}-{}{ending}", last.saturating_add(1).max(2))))
}

/// Returns the existing files of the series of `path` with their numbers, in numerical order; `path` itself is number 1.
pub(crate) fn series(path: &Path) -> Vec<(u64, PathBuf)> {
    let (stem, ending) = parts(path);
    let number = |name: &str| name.strip_prefix(&stem)?.strip_suffix(&ending)?.strip_prefix('-')?.parse::<u64>().ok();
    let names = std::fs::read_dir(parent(path)).into_iter().flatten().flatten().filter_map(|entry| entry.file_name().into_string().ok());
    let numbered = names.filter_map(|name| Some((number(&name)?, path.with_file_name(name))));
    let mut found: Vec<_> = numbered.chain(path.exists().then(|| (1, path.to_owned()))).collect();
    found.sort();
    found
}

/// Returns the stem of a file name, and its extension including the dot.
fn parts(path: &Path) -> (String, String) {
    let part = |of: Option<&std::ffi::OsStr>| of.map(|of| of.to_string_lossy().into_owned()).unwrap_or_default();
    (part(path.file_stem()), path.extension().map(|of| format!(".{}", of.to_string_lossy())).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_on_behind_the_last_one() {
        let folder = std::env::temp_dir().join(format!("opengpac-names-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let next = || next_beside(&folder.join("run.mcap")).file_name().unwrap().to_str().unwrap().to_owned();
        let make = |name: &str| std::fs::write(folder.join(name), "").unwrap();
        assert_eq!(next(), "run.mcap");
        make("run.mcap");
        assert_eq!(next(), "run-2.mcap");
        for other in ["run-x.mcap", "run-9.csv", "runs-8.mcap", "run-.mcap"] {
            make(other);
        }
        assert_eq!(next(), "run-2.mcap");
        make("run-11.mcap");
        std::fs::remove_file(folder.join("run.mcap")).unwrap();
        assert_eq!(next(), "run-12.mcap");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
