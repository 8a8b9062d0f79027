// SPDX-License-Identifier: Apache-2.0
//! One verb instance in its course.
use crate::core::Core;

/// A verb instance, and the core in which it runs. The number of a deleted instance is no error: nothing happens.
pub(crate) struct Course<'a> {
    pub core: &'a mut Core,
    pub id: u64,
}

impl Core {
    /// Returns the course of an instance.
    pub fn course(&mut self, id: u64) -> Course<'_> {
        Course { core: self, id }
    }
}
