// SPDX-License-Identifier: Apache-2.0
//! Recently used recordings, kept open so that the file need not be reopened to read another value.
use crate::Archive;
use model::refusal::{Class, Refusal, Refusals};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::UNIX_EPOCH;

/// Maximum number of recordings that are kept open.
const OPEN_MAX: usize = 4;

/// Path, inode and archive. The inode distinguishes a new file of the same name, which is a different recording.
type OpenRecording = (PathBuf, u64, Arc<Archive>);

static SHELF: Mutex<Vec<OpenRecording>> = Mutex::new(Vec::new());

/// Returns the recording at a path, including everything written to the file so far. Fails if it cannot be read or is not a recording of
/// OpenGPAC.
pub fn opened(path: &Path) -> Result<Arc<Archive>, Refusals> {
    let known = || SHELF.lock().unwrap_or_else(PoisonError::into_inner);
    let identity = std::fs::metadata(path).map_or(0, |about| std::os::unix::fs::MetadataExt::ino(&about));
    let found = known().iter().find(|(name, file, _)| name == path && *file == identity).map(|(.., archive)| archive.clone());
    if let Some(archive) = found {
        archive.refresh()?;
        return Ok(archive);
    }
    let archive = Arc::new(Archive::open(path)?);
    let mut known = known();
    known.retain(|(name, ..)| name != path);
    known.insert(0, (path.to_owned(), identity, archive.clone()));
    known.truncate(OPEN_MAX);
    Ok(archive)
}

/// A file in a folder of recordings.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RecordingFile {
    /// Name of the file without its folder.
    pub name: String,
    /// Size of the file, bytes.
    pub bytes: u64,
    /// Time of the last write, s since the Unix epoch.
    pub written_unix_s: u64,
}

/// Returns the recordings in a folder, newest first: regular files named `*.mcap`. Fails if the folder cannot be read.
pub fn recordings(folder: &Path) -> Result<Vec<RecordingFile>, Refusals> {
    let cannot = |why: std::io::Error| {
        let said = format!("cannot read the folder of recordings '{}': {why}", folder.display());
        vec![Refusal::new(Class::ValueRefused, said).remedy("check that it exists and that the system may read it")]
    };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(cannot)? {
        let entry = entry.map_err(cannot)?;
        // Entries that are not files, or have been deleted meanwhile, are skipped.
        let (Ok(name), Ok(about)) = (entry.file_name().into_string(), entry.metadata()) else { continue };
        if !about.is_file() || Path::new(&name).extension().is_none_or(|extension| extension != "mcap") {
            continue;
        }
        let written_unix_s = about.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok()).map_or(0, |since| since.as_secs());
        found.push(RecordingFile { name, bytes: about.len(), written_unix_s });
    }
    found.sort_by(|one, other| (other.written_unix_s, &one.name).cmp(&(one.written_unix_s, &other.name)));
    Ok(found)
}
