// SPDX-License-Identifier: Apache-2.0
//! End reports: exactly one for each start of a verb instance.
use indexmap::IndexMap;
use model::value::Value;
use serde::Serialize;

/// Another condition that came in the firing that ended the verb, or while it was moving.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Other {
    pub condition: String,
    pub block: String,
    pub time_s: f64,
}

/// A command list that a condition led on from.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PassedList {
    pub command_list: String,
    pub condition: String,
    /// The block that reported it, if one did.
    pub block: Option<String>,
    pub time_s: f64,
}

/// The end of one start of a verb instance.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Report {
    pub instance: String,
    pub verb: String,
    /// The number of this start of the instance, from 1.
    pub start: u64,
    /// The termination condition.
    pub condition: String,
    /// True for a normal end, which raises no exception in the programming system.
    pub normal: bool,
    /// The list that was running.
    pub command_list: String,
    /// The block that reported it, if one did.
    pub block: Option<String>,
    /// Time of the end and of the start, s on the system's clock.
    pub time_s: f64,
    pub started_s: f64,
    /// The value that the condition reported, if it has one.
    pub value: Option<Value>,
    /// The cause in words.
    pub message: String,
    /// Output values of the conditions on its way and of the last one: of one name, the latest. Nothing for a condition that was not reported in
    /// this start.
    pub outputs: IndexMap<String, Option<Value>>,
    pub others: Vec<Other>,
    /// The transitions that it took, in order: at most the last 64.
    pub way: Vec<PassedList>,
}
