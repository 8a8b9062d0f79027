// SPDX-License-Identifier: Apache-2.0
//! Locks whose holders never panic.
use std::sync::{Mutex, MutexGuard};

pub(crate) fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().expect("nobody panics with the lock held")
}
