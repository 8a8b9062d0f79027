// SPDX-License-Identifier: Apache-2.0
//! End reports: exactly one for each start of a verb instance.
use indexmap::IndexMap;
use model::value::Value;
use serde::Serialize;

/// Further condition that occurred in the firing that ended the verb, or while the ending condition was being handled.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Other {
    pub condition: String,
    pub block: String,
    pub time_s: f64,
}

/// A command list that the verb left because of a condition.
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
    /// Number of this start of the instance, counted from 1.
    pub start: u64,
    /// Termination condition.
    pub condition: String,
    /// True for a normal end, which raises no exception in the programming system.
    pub normal: bool,
    /// Command list that was running.
    pub command_list: String,
    /// Block that reported the condition, if any.
    pub block: Option<String>,
    /// Time of the end, and time of the start, s on the system's clock.
    pub time_s: f64,
    pub started_s: f64,
    /// Value that the condition reported, if it has one.
    pub value: Option<Value>,
    /// Description of the cause.
    pub message: String,
    /// Output values of the condition that ended the verb and of all conditions that led to it: for each name the latest value, or null
    /// if it was not reported in this start.
    pub outputs: IndexMap<String, Option<Value>>,
    pub others: Vec<Other>,
    /// Transitions taken, in order; at most the last 64 are kept.
    pub way: Vec<PassedList>,
}
