// SPDX-License-Identifier: Apache-2.0
//! Causes for which starts end.
use model::value::Value;

/// Cause for which a start ends.
#[derive(Clone, Debug)]
pub(crate) struct Cause {
    /// Index into the plan's conditions.
    pub condition: usize,
    /// Flat label of the block that reported the condition.
    pub block: Option<String>,
    pub value: Option<Value>,
    pub message: String,
    pub time_ns: i64,
    /// True if the end counts as normal regardless of the condition (a halt requested by the waiter).
    pub asked_for: bool,
}
