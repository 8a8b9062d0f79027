// SPDX-License-Identifier: Apache-2.0
//! Random numbers that are unique across processes.
use std::hash::{BuildHasher, Hasher, RandomState};

/// Returns a random number that no other process draws, because the hasher's keys come from the operating system. Not for secrets.
pub(crate) fn number() -> u64 {
    RandomState::new().build_hasher().finish()
}
