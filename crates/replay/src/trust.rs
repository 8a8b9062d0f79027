// SPDX-License-Identifier: Apache-2.0
//! Trust in native code from a file. A record contains the code modules of its blocks, and replaying it means running them. No file is
//! trusted merely because it exists: the user declares trust in all its modules, or in those with certain digests.
use crate::file::Reader;
use crate::recording::Item;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Modules of a file that may run.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub enum Trust {
    /// Trust in all modules if true, in none if false.
    Said(bool),
    /// Trust in the modules with these digests.
    Of(Vec<String>),
}

impl Default for Trust {
    fn default() -> Trust {
        Trust::Said(false)
    }
}

/// A code module in a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CodeFile {
    /// Name.
    pub name: String,
    /// Size of the shared object, bytes.
    pub len: usize,
    /// SHA-256 of the shared object, in hexadecimal digits.
    pub sha256: String,
}

impl CodeFile {
    fn of(name: &str, bytes: &[u8]) -> CodeFile {
        CodeFile { name: name.to_owned(), len: bytes.len(), sha256: rtp::sha256(bytes) }
    }
}

/// Returns the code modules in a file, as far as the file can be read, without running them.
///
/// # Errors
/// Fails with a message if the file does not exist or is not a record.
pub fn modules_in(path: &Path) -> Result<Vec<CodeFile>, String> {
    let mut reader = Reader::open(path)?;
    let mut found: Vec<CodeFile> = Vec::new();
    // Items after a damaged part are not replayed either.
    while let Ok(Some(item)) = reader.next_item() {
        if let Item::Module { name, bytes, .. } = item {
            let one = CodeFile::of(&name, &bytes);
            if !found.contains(&one) {
                found.push(one);
            }
        }
    }
    Ok(found)
}

impl Trust {
    /// Fails with a message if the file contains modules that are not trusted.
    pub(crate) fn check_file(&self, path: &Path) -> Result<(), String> {
        if *self == Trust::Said(true) {
            return Ok(());
        }
        let strange: Vec<CodeFile> = modules_in(path)?.into_iter().filter(|one| !self.covers(one)).collect();
        if strange.is_empty() { Ok(()) } else { Err(refusal(&path.display().to_string(), &strange)) }
    }

    /// Checks one module that is about to be loaded, because the file may have changed since it was checked.
    pub(crate) fn check(&self, path: &Path, name: &str, bytes: &[u8]) -> Result<(), String> {
        if *self == Trust::Said(true) {
            return Ok(());
        }
        let one = CodeFile::of(name, bytes);
        if self.covers(&one) { Ok(()) } else { Err(refusal(&path.display().to_string(), &[one])) }
    }

    fn covers(&self, one: &CodeFile) -> bool {
        match self {
            Trust::Said(all) => *all,
            Trust::Of(digests) => digests.contains(&one.sha256),
        }
    }
}

fn refusal(path: &str, strange: &[CodeFile]) -> String {
    let told: Vec<String> = strange.iter().map(|one| format!("'{}' ({} bytes, SHA-256 {})", one.name, one.len, one.sha256)).collect();
    format!(
        "'{path}' contains native code, which a replay runs with all your privileges: {}; the file does not say who built it: if you trust its origin, replay it with trust=True (opengpac replay --trust)",
        told.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_module_is_trusted_by_its_bytes_and_not_by_its_name() {
        let [one, other] = [CodeFile::of("press", b"one"), CodeFile::of("press", b"other")];
        assert!(!Trust::default().covers(&one) && Trust::Said(true).covers(&one));
        let trust = Trust::Of(vec![one.sha256.clone()]);
        assert!(trust.covers(&one) && !trust.covers(&other));
        let refused = trust.check(Path::new("run.mcap"), "press", b"other").expect_err("other bytes");
        assert!(refused.contains(&other.sha256) && refused.contains("'press' (5 bytes") && refused.contains("--trust"), "{refused}");
        assert_eq!(one.sha256, "7692c3ad3540bb803c020b3aee66cd8887123234ea0c6e7143c0add73ff431ed");
    }
}
