// SPDX-License-Identifier: Apache-2.0
//! End reports: exactly one for each start of a verb instance.
use indexmap::IndexMap;
use model::value::Value;
use serde::Serialize;

/// A further condition that occurred in the firing that ended the verb, or while it was moving.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Other {
    pub condition: String,
    pub block: String,
    pub time_s: f64,
}

/// A command list that the verb left by a condition.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PassedList {
    pub command_list: String,
    pub condition: String,
    /// Block that reported the condition, if any.
    pub block: Option<String>,
    pub time_s: f64,
}

/// The end of one start of a verb instance.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Report {
    pub instance: String,
    pub verb: String,
    /// Number of this start of the instance, from 1.
    pub start: u64,
    /// Termination condition.
    pub condition: String,
    /// True for a normal end, which raises no exception in the programming system.
    pub normal: bool,
    /// List that was running.
    pub command_list: String,
    /// Block that reported the condition, if any.
    pub block: Option<String>,
    /// Time of the end and of the start, s on the system's clock.
    pub time_s: f64,
    pub started_s: f64,
    /// Value that the condition reported, if it has one.
    pub value: Option<Value>,
    /// Cause in words.
    pub message: String,
    /// Output values of all conditions on the way and of the last one; for each name, the latest. Null for a value that was not reported
    /// in this start.
    pub outputs: IndexMap<String, Option<Value>>,
    pub others: Vec<Other>,
    /// Transitions taken, in order; at most the last 64.
    pub way: Vec<PassedList>,
}
