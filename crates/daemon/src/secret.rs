// SPDX-License-Identifier: Apache-2.0
//! Files that contain secrets: the tokens and the TLS key. A file that others may read is refused.
use std::fs::File;
use std::io::{Error, ErrorKind, Result};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Opens a file that only its owner may read.
pub fn open(path: &Path) -> Result<File> {
    let file = File::open(path)?;
    let mode = file.metadata()?.mode() & 0o777;
    if mode & 0o077 != 0 {
        return Err(Error::new(ErrorKind::PermissionDenied, format!("others may read '{}' (mode {mode:04o}): chmod 600 it", path.display())));
    }
    Ok(file)
}
