// SPDX-License-Identifier: Apache-2.0
//! Companions: objects outside the supervisor, such as recordings, that accompany a system and end with it.
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

/// An object that accompanies a system and ends with it.
pub trait Companion: Any + Send + Sync {
    /// Notifies the companion that the system is closing: nothing moves, but everything can still be read. Idempotent.
    fn end(&self);

    /// Returns the companion for a caller that knows its type.
    fn as_any(self: Arc<Self>) -> Arc<dyn Any + Send + Sync>;
}

/// Companions by number.
#[derive(Default)]
pub(crate) struct Companions {
    pub last: u64,
    pub present: BTreeMap<u64, Arc<dyn Companion>>,
}
