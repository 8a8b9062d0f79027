// SPDX-License-Identifier: Apache-2.0
//! Companions: what accompanies a system from outside the supervisor and ends with it, such as recordings.
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Companion that ends with the system.
pub trait Companion: Any + Send + Sync {
    /// Notes that the system closes: nothing moves, everything can still be read. Idempotent.
    fn end(&self);

    /// Returns it for a caller that knows its type.
    fn as_any(self: Arc<Self>) -> Arc<dyn Any + Send + Sync>;
}

/// Companions by their numbers.
#[derive(Default)]
pub(crate) struct Companions {
    pub last: u64,
    pub present: BTreeMap<u64, Arc<dyn Companion>>,
}
