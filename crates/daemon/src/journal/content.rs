// SPDX-License-Identifier: Apache-2.0
//! Content to which calls refer and which is too large for a line of a journal: code modules and model files, stored by SHA-256 digest in
//! a folder next to it.
use crate::journal::file;
use crate::requests::is_sha256;
use std::collections::BTreeSet;
use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// Content folder of a journal.
pub struct Content {
    folder: PathBuf,
}

impl Content {
    /// Opens the content folder of a journal: `cell.journal.files`, mode 0700.
    pub fn beside(journal: &Path) -> io::Result<Content> {
        let folder = file::beside(journal, "files");
        DirBuilder::new().recursive(true).mode(0o700).create(&folder)?;
        Ok(Content { folder })
    }

    /// Stores content under its digest. The content is on disk when this returns.
    pub fn keep(&self, sha256: &str, bytes: &[u8]) -> io::Result<()> {
        let path = self.folder.join(sha256);
        if path.exists() {
            return Ok(());
        }
        let new = file::beside(&path, "new");
        // Removes the remains of a daemon that died during this step.
        let _gone = fs::remove_file(&new);
        let mut written = OpenOptions::new().write(true).create_new(true).mode(0o600).open(&new)?;
        written.write_all(bytes)?;
        written.sync_all()?;
        fs::rename(&new, &path)?;
        File::open(&self.folder)?.sync_all()
    }

    /// Returns the content with this digest.
    pub fn bytes(&self, sha256: &str) -> io::Result<Vec<u8>> {
        if !is_sha256(sha256) {
            return Err(io::Error::other("this is not a SHA-256 digest"));
        }
        fs::read(self.folder.join(sha256))
    }

    /// Deletes all content except that with these digests.
    pub fn leave(&self, needed: &BTreeSet<String>) {
        for entry in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let ours = name.to_str().is_some_and(|name| is_sha256(name.trim_end_matches(".new")));
            if ours && !name.to_str().is_some_and(|name| needed.contains(name)) {
                // Remaining files only take up room; the next start tries again.
                let _gone = fs::remove_file(entry.path());
            }
        }
    }
}
