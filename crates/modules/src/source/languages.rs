// SPDX-License-Identifier: Apache-2.0
//! Language of a source, by its file name extension.
use std::path::Path;

/// Returns true if a source is written in C++.
pub(super) fn is_cxx(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ["cpp", "cc", "cxx"].iter().any(|cxx| ending == *cxx))
}
