// SPDX-License-Identifier: Apache-2.0
//! Course of a verb instance: the operations that advance it.
use crate::core::Core;

/// A verb instance together with the core that runs it. Calls on a deleted instance have no effect.
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
