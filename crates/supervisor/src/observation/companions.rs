// SPDX-License-Identifier: Apache-2.0
//! Companions: objects outside the supervisor that accompany a system and end with it, such as recordings.
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A companion that ends with the system.
pub trait Companion: Any + Send + Sync {
    /// Notifies the companion that the system closes: nothing moves, but everything can still be read. Idempotent.
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
