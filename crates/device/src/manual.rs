// SPDX-License-Identifier: Apache-2.0
//! Declaration of a driver in a format that can be sent and printed.
use crate::accepted::options_of;
use crate::counters::CounterWord;
use crate::declaration::Declaration;
use crate::life::SafeState;
use crate::option_word::OptionWord;
use crate::services::ServiceWord;
use hints::Interval;
use serde::{Deserialize, Serialize};

/// Declaration of a driver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Manual {
    /// Name by which a program requests the driver.
    pub kind: String,
    /// Description, one line.
    pub doc: String,
    /// Execution context of the driver's exchange: "inline", "worker" or "process".
    pub class: String,
    pub options: Vec<OptionAbout>,
    /// Time for which the driver waits for a device that is not present yet, ns.
    pub waits_ns: i64,
    /// Maximum time from the last response of a lost device until its loss is reported, ns.
    pub lost_within_ns: i64,
    pub safe_state: SafeStateAbout,
    pub services: Vec<ServiceAbout>,
    pub counters: Vec<CounterAbout>,
    /// Privileges required beyond those of an ordinary user process.
    pub rights: Vec<String>,
    /// True if the driver can search for devices.
    pub scans: bool,
}

/// An option of a driver, or an argument of a service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "DriverOption"))]
pub struct OptionAbout {
    pub name: String,
    /// "text", "number", "whole", "bool", "list" or "table".
    pub kind: String,
    /// Unit, or empty if none.
    pub unit: String,
    /// Range of a number, or of each number in a list, such as `(0, 10]`: a round bracket excludes the end. Omitted if every number is
    /// valid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<String>,
    /// Description of the default; null if the option is required.
    pub default: Option<String>,
    pub doc: String,
}

/// A service of a driver: a command off the cycle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "DriverService"))]
pub struct ServiceAbout {
    pub name: String,
    pub doc: String,
    pub arguments: Vec<OptionAbout>,
    /// Kind of the service's answer; null if there is none.
    pub answer: Option<String>,
    /// True if the service moves the device and is therefore refused while an emergency stop is latched.
    #[serde(default)]
    pub moves: bool,
}

/// A counter of a driver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "DriverCounter"))]
pub struct CounterAbout {
    pub name: String,
    /// Unit, or empty for a plain number.
    pub unit: String,
    pub doc: String,
}

/// The safe state of a device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "DriverSafeState"))]
pub struct SafeStateAbout {
    /// Description of the state.
    pub doc: String,
    /// Agents that establish the state: "driver", "guard", "device", "end of process".
    pub by: Vec<String>,
    /// Maximum time from the request until the state is reached, ns.
    pub within_ns: i64,
}

impl From<&'static Declaration> for Manual {
    fn from(of: &'static Declaration) -> Manual {
        Manual {
            kind: of.kind.to_owned(),
            doc: of.doc.to_owned(),
            class: of.class.to_string(),
            options: options_of(of).into_iter().map(OptionAbout::from).collect(),
            waits_ns: of.life.waits_ns,
            lost_within_ns: of.life.lost_within_ns,
            safe_state: SafeStateAbout::from(&of.safe_state),
            services: of.services.iter().map(ServiceAbout::from).collect(),
            counters: of.counters.iter().map(CounterAbout::from).collect(),
            rights: of.rights.iter().map(|&right| right.to_owned()).collect(),
            scans: of.scan.is_some(),
        }
    }
}

impl From<&OptionWord> for OptionAbout {
    fn from(of: &OptionWord) -> OptionAbout {
        let OptionWord { name, kind, unit, default, doc, .. } = *of;
        let range = Some(of.interval()).filter(|range| of.is_numeric() && *range != Interval::ANY).map(|range| range.to_string());
        OptionAbout { name: name.into(), kind: kind.name().into(), unit: unit.into(), range, default: default.map(str::to_owned), doc: doc.into() }
    }
}

impl From<&ServiceWord> for ServiceAbout {
    fn from(of: &ServiceWord) -> ServiceAbout {
        let arguments = of.arguments.iter().map(OptionAbout::from).collect();
        ServiceAbout { name: of.name.into(), doc: of.doc.into(), arguments, answer: of.answer.map(|kind| kind.name().to_owned()), moves: of.moves }
    }
}

impl From<&CounterWord> for CounterAbout {
    fn from(of: &CounterWord) -> CounterAbout {
        CounterAbout { name: of.name.into(), unit: of.unit.into(), doc: of.doc.into() }
    }
}

impl From<&SafeState> for SafeStateAbout {
    fn from(of: &SafeState) -> SafeStateAbout {
        SafeStateAbout { doc: of.doc.into(), by: of.by.iter().map(ToString::to_string).collect(), within_ns: of.within_ns }
    }
}
