// SPDX-License-Identifier: Apache-2.0
//! Finds the files of a recording whose process has died, so that a new recording can continue after them.
use crate::ABOUT;
use crate::folder::series;
use mcap::{Reader, Record};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Key of the recording's identity in the description stored in each of its files.
pub(crate) const IDENTITY: &str = "recording";
/// Key of the name of the previous file, whose last value is the first value of this file.
pub(crate) const FOLLOWS: &str = "follows";
/// Key of the name of the previous file, if its process died, so that values between the two files are missing.
pub(crate) const RESUMES: &str = "resumes";

/// Returns the files of the series of `path` whose description contains this identity, with their sizes, oldest first. Files of other
/// recordings that use the same name are excluded.
pub(crate) fn left(path: &Path, identity: &str) -> Vec<(PathBuf, u64)> {
    let of = |path: &Path| said(path).is_some_and(|said| said.get(IDENTITY).is_some_and(|of| of == identity));
    let bytes = |path: &Path| std::fs::metadata(path).map_or(0, |about| about.len());
    series(path).into_iter().filter(|(_, file)| of(file)).map(|(_, file)| (file.clone(), bytes(&file))).collect()
}

/// Returns the description of the recording at the beginning of a file; `None` if the file is not a recording of OpenGPAC or cannot be
/// read.
fn said(path: &Path) -> Option<BTreeMap<String, String>> {
    let mut reader = Reader::new(File::open(path).ok()?).ok()?;
    match reader.next_record().ok()?? {
        Record::Metadata { name, texts } if name == ABOUT => Some(texts),
        _ => None,
    }
}
