// SPDX-License-Identifier: Apache-2.0
//! Causes of ends.
use model::value::Value;

/// Cause of the end of a start.
#[derive(Clone, Debug)]
pub(crate) struct Cause {
    /// Index into the plan's conditions.
    pub condition: usize,
    /// Flat label of the block that reported the condition.
    pub block: Option<String>,
    pub value: Option<Value>,
    pub message: String,
    pub time_ns: i64,
    /// True if the end counts as normal regardless of the condition (a halt requested by the caller that waits for the end).
    pub asked_for: bool,
}
