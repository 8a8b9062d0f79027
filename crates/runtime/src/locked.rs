// SPDX-License-Identifier: Apache-2.0
//! Locks of threads that do not panic while they hold one.
use std::sync::{Mutex, MutexGuard};

pub(crate) fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().expect("nobody panics with the lock held")
}
