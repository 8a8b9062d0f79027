// SPDX-License-Identifier: Apache-2.0
//! The cause of an end.
use model::value::Value;

/// Cause of a start's end.
#[derive(Clone, Debug)]
pub(crate) struct Cause {
    /// Index into the plan's conditions.
    pub condition: usize,
    /// Flat label of the block that reported it.
    pub block: Option<String>,
    pub value: Option<Value>,
    pub message: String,
    pub time_ns: i64,
    /// Its end is normal, whatever the condition says (a halt asked for by the waiter).
    pub asked_for: bool,
}
