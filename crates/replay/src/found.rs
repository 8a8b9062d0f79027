// SPDX-License-Identifier: Apache-2.0
//! Result of a replay, readable by people and by other programs.
use crate::comparison::Difference;
use crate::condition::number;
use crate::player::Svv;
use serde::{Deserialize, Serialize};

/// Reason why a run was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "ReplayStopped"))]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The record has ended.
    End,
    /// The requested condition holds.
    Condition,
    /// The requested time has been reached.
    Time,
    /// A value differs from the recorded one.
    Difference,
    /// The record lacks the data to continue.
    Unplayable,
}

/// Position at which a replay stopped, and its findings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "ReplayFound"))]
pub struct ReplayResult {
    pub stopped: StopReason,
    /// Number of firings that were replayed.
    pub firings: u64,
    /// Fingerprint of the run so far; identical for all records of one run.
    pub fingerprint: String,
    /// True if every value so far equals that of the record, bit for bit.
    pub same: bool,
    /// Source of the last firing.
    pub source: String,
    /// Number of the source's firing.
    pub number: u64,
    /// Release time of the firing, ns.
    pub time_ns: i64,
    /// The first difference.
    pub difference: Option<DifferenceText>,
    /// Reason why the record cannot be replayed further, and other notes.
    pub message: String,
    /// Requested SVVs.
    pub svvs: Vec<ShownSvv>,
}

/// Difference as human-readable text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "ReplayDifference"))]
pub struct DifferenceText {
    /// Source in which the difference occurred.
    pub source: String,
    /// Number of the firing.
    pub number: u64,
    /// Release time of the firing, ns.
    pub time_ns: i64,
    /// True if the difference occurred between two firings.
    pub between: bool,
    /// Label of the block, with its instance; empty if unknown.
    pub block: String,
    /// Port; empty if unknown.
    pub port: String,
    /// SVV in which the value is stored; empty if it is a private cell or unknown.
    pub svv: String,
    /// Type of the port.
    pub type_text: String,
    /// Elements of the recorded value; hexadecimal digits if it contains no numbers.
    pub recorded: Vec<String>,
    /// Elements of the replayed value, in the same format.
    pub replayed: Vec<String>,
    /// Deviation of the execution of the source from the record; empty if there is none.
    pub how: String,
    /// SVVs that blocks of the source store, with their current values; used if the block is unknown.
    pub stored: Vec<ShownSvv>,
}

/// An SVV at the end of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "ReplayShown"))]
pub struct ShownSvv {
    /// Name.
    pub name: String,
    /// C type.
    pub type_text: String,
    /// Unit.
    pub unit: String,
    /// Elements of the value.
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

/// Formats the elements of a value without loss of any bit. A value that contains no numbers is formatted as hexadecimal digits.
pub fn elements(type_text: &str, bytes: &[u8]) -> Vec<String> {
    let numbers: Vec<String> = (0..).map_while(|element| number(type_text, bytes, element)).map(|number| format!("{number:?}")).collect();
    if numbers.is_empty() && !bytes.is_empty() {
        return vec![bytes.iter().map(|byte| format!("{byte:02x}")).collect()];
    }
    numbers
}
