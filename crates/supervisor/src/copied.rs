// SPDX-License-Identifier: Apache-2.0
//! Copy on write: values that are changed under a lock and read without it. A reader keeps its snapshot; a change copies the value only
//! if there is a reader.
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// State that supports snapshots, with a change counter.
#[derive(Default)]
pub(crate) struct CopiedState<T>(Arc<T>, u64);

impl<T> CopiedState<T> {
    /// Returns a snapshot, which later changes do not affect.
    pub fn as_it_is(&self) -> Arc<T> {
        self.0.clone()
    }

    /// Returns the change counter. The same number means the same content, except for changes made through [`CopiedState::aside`].
    pub fn changes(&self) -> u64 {
        self.1
    }
}

impl<T: Clone> CopiedState<T> {
    /// Returns the state for a change that is not counted, that is, a change to entries that are added and removed with each verb
    /// instance and are compared separately.
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
