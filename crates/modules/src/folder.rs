// SPDX-License-Identifier: Apache-2.0
//! Temporary private folders.

use std::fs::DirBuilder;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A new folder that only this user can enter; removed when dropped.
pub struct Folder {
    path: PathBuf,
}

impl Folder {
    /// Creates a folder among the temporary files.
    pub fn new() -> std::io::Result<Folder> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        loop {
            let path = std::env::temp_dir().join(format!("opengpac-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed)));
            match DirBuilder::new().mode(0o700).create(&path) {
                Ok(()) => return Ok(Folder { path }),
                // Left by an earlier process with this number.
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(error),
            }
        }
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // If it cannot be removed, the system will clean it up with the temporary files.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}
