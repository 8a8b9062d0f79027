// SPDX-License-Identifier: Apache-2.0
//! Numbers that no other process draws.
use std::hash::{BuildHasher, Hasher, RandomState};

/// Returns a number that no other process draws: the keys of the hasher come from the operating system. Not for secrets.
pub(crate) fn number() -> u64 {
    RandomState::new().build_hasher().finish()
}
