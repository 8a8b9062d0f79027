// SPDX-License-Identifier: Apache-2.0
//! Copy on write: changed under a lock and read without it. A reader keeps the value as it was, and a change makes a copy only while there
//! is a reader.
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// State that can be copied as it is now, see the module; and its number of changes.
#[derive(Default)]
pub(crate) struct CopiedState<T>(Arc<T>, u64);

impl<T> CopiedState<T> {
    /// Returns it as it is now, whatever becomes of it.
    pub fn as_it_is(&self) -> Arc<T> {
        self.0.clone()
    }

    /// Returns the number of changes: the same number means the same content, but for what was changed [`CopiedState::aside`].
    pub fn changes(&self) -> u64 {
        self.1
    }
}

impl<T: Clone> CopiedState<T> {
    /// Returns it for a change that does not count: of what comes and goes with each verb instance, and is compared itself.
    pub fn aside(&mut self) -> &mut T {
        Arc::make_mut(&mut self.0)
    }
}

impl<T> Deref for CopiedState<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: Clone> DerefMut for CopiedState<T> {
    fn deref_mut(&mut self) -> &mut T {
        self.1 += 1;
        Arc::make_mut(&mut self.0)
    }
}
