// SPDX-License-Identifier: Apache-2.0
//! Forces in effect.
use indexmap::IndexMap;
use model::value::Value;

/// A force in effect.
pub(crate) struct Force {
    /// Number of the force, unique within the system.
    pub number: u64,
    /// Physical device, and index of its channel.
    pub device: String,
    pub channel: usize,
    pub is_output: bool,
    pub value: Value,
    /// Person or session that set the force.
    pub who: String,
    pub since_ns: i64,
}

impl Force {
    /// Returns the time at which the force was set, s.
    #[allow(clippy::cast_precision_loss, reason = "a time in seconds")]
    pub fn since_s(&self) -> f64 {
        self.since_ns as f64 * 1e-9
    }
}

/// Forces in effect, by logical device.
#[derive(Default)]
pub(crate) struct Forces {
    pub by_signal: IndexMap<String, Force>,
    /// Number of the last force.
    pub last: u64,
}
