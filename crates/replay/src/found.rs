// SPDX-License-Identifier: Apache-2.0
//! Result of a replay, for people and for other programs.
use crate::comparison::Difference;
use crate::condition::number;
use crate::player::Svv;
use serde::{Deserialize, Serialize};

/// Reason why a run went no further.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "ReplayStopped"))]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The record has ended.
    End,
    /// The condition that was asked for holds.
    Condition,
    /// The time that was asked for has come.
    Time,
    /// A value is not as it was recorded.
    Difference,
    /// The record does not have what follows.
    Unplayable,
}

/// Place at which a replay stopped, and its findings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "ReplayFound"))]
pub struct ReplayResult {
    pub stopped: StopReason,
    /// Firings that were run again.
    pub firings: u64,
    /// One number for all that happened so far: records of the same run have the same.
    pub fingerprint: String,
    /// True where every value so far is that of the record, bit for bit.
    pub same: bool,
    /// Source of the last moment.
    pub source: String,
    /// Number of its firing.
    pub number: u64,
    /// Its release, ns.
    pub time_ns: i64,
    /// The first difference.
    pub difference: Option<DifferenceText>,
    /// Cause that keeps the record from being run on, and other notes.
    pub message: String,
    /// The SVVs that were asked for.
    pub svvs: Vec<ShownSvv>,
}

/// A difference, for people.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "ReplayDifference"))]
pub struct DifferenceText {
    /// Source.
    pub source: String,
    /// Number of the firing.
    pub number: u64,
    /// Its release, ns.
    pub time_ns: i64,
    /// True if it came between two firings.
    pub between: bool,
    /// Label of the block, with its instance; empty where it is not known.
    pub block: String,
    /// Port; empty where it is not known.
    pub port: String,
    /// The SVV in which it is stored; empty of a private cell, and where it is not known.
    pub svv: String,
    /// Type of the port.
    pub type_text: String,
    /// The elements of the recorded value; hexadecimal digits of what has no numbers.
    pub recorded: Vec<String>,
    /// The same of the value now.
    pub replayed: Vec<String>,
    /// Difference in the way that the source went, where there is one.
    pub how: String,
    /// SVVs that blocks of the source store, with their values now, where the block is not known.
    pub stored: Vec<ShownSvv>,
}

/// An SVV at the end of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "ReplayShown"))]
pub struct ShownSvv {
    /// Its name.
    pub name: String,
    /// Its C type.
    pub type_text: String,
    /// Its unit.
    pub unit: String,
    /// Its elements.
    pub value: Vec<String>,
}

impl ShownSvv {
    pub(crate) fn of(svv: Svv) -> ShownSvv {
        ShownSvv { value: elements(&svv.type_text, &svv.bytes), name: svv.name, type_text: svv.type_text, unit: svv.unit }
    }
}

impl DifferenceText {
    pub(crate) fn of(difference: &Difference) -> DifferenceText {
        let (block, port) = difference.port.clone().unwrap_or_default();
        DifferenceText {
            source: difference.source.clone(),
            number: difference.number,
            time_ns: difference.time_ns,
            between: difference.between,
            block,
            port,
            svv: difference.svv.clone().unwrap_or_default(),
            recorded: elements(&difference.type_text, &difference.recorded),
            replayed: elements(&difference.type_text, &difference.replayed),
            type_text: difference.type_text.clone(),
            how: difference.how.clone().unwrap_or_default(),
            stored: Vec::new(),
        }
    }
}

/// Returns the elements of a value as text that says every bit; hexadecimal digits of what has no numbers.
pub fn elements(type_text: &str, bytes: &[u8]) -> Vec<String> {
    let numbers: Vec<String> = (0..).map_while(|element| number(type_text, bytes, element)).map(|number| format!("{number:?}")).collect();
    if numbers.is_empty() && !bytes.is_empty() {
        return vec![bytes.iter().map(|byte| format!("{byte:02x}")).collect()];
    }
    numbers
}
