// SPDX-License-Identifier: Apache-2.0
//! The files of a recording whose process has died, for the one that goes on behind them.
use crate::ABOUT;
use crate::folder::series;
use mcap::{Reader, Record};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Identity of the recording, in what each of its files says of it.
pub(crate) const IDENTITY: &str = "recording";
/// Name of the file before this one, which ends with the value that this one begins with.
pub(crate) const FOLLOWS: &str = "follows";
/// Name of the file before this one, whose process died: what came between the two is not there.
pub(crate) const RESUMES: &str = "resumes";

/// Returns the files of the series of `path` that say that they are of this recording, with their bytes, the oldest first. Files of other
/// recordings of that name are none of them.
pub(crate) fn left(path: &Path, identity: &str) -> Vec<(PathBuf, u64)> {
    let of = |path: &Path| said(path).is_some_and(|said| said.get(IDENTITY).is_some_and(|of| of == identity));
    let bytes = |path: &Path| std::fs::metadata(path).map_or(0, |about| about.len());
    series(path).into_iter().filter(|(_, file)| of(file)).map(|(_, file)| (file.clone(), bytes(&file))).collect()
}

/// Returns what a file says of its recording at its beginning; none where it is no recording of ours, or cannot be read.
fn said(path: &Path) -> Option<BTreeMap<String, String>> {
    let mut reader = Reader::new(File::open(path).ok()?).ok()?;
    match reader.next_record().ok()?? {
        Record::Metadata { name, texts } if name == ABOUT => Some(texts),
        _ => None,
    }
}
