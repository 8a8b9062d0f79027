// SPDX-License-Identifier: Apache-2.0
//! The driver to be checked, with its options.
use super::rig::{Joint, Rig};
use device::{Class, Declaration, DriverError, Kind, OpenedDriver};
use serde_json::{Value, json};

/// Option of a worker that makes it exchange in place, so that it can be checked cycle by cycle.
const IN_PLACE: &str = "in_place";

pub(crate) struct Subject {
    pub(crate) kind: String,
    pub(crate) options: Value,
    pub(crate) of: &'static Declaration,
    /// Maximum number of exchanges in the long check.
    pub(crate) exchanges: u64,
}

impl Subject {
    /// Creates a driver with the given options instead of its own.
    pub(crate) fn with(&self, options: &Value) -> Result<OpenedDriver, DriverError> {
        device::open(&self.kind, options)
    }

    /// Creates the driver with its own options.
    pub(crate) fn made(&self) -> Result<OpenedDriver, String> {
        self.with(&self.options).map_err(|why| why.to_string())
    }

    /// Creates a driver with its buffers, which exchanges on this thread.
    pub(crate) fn rig(&self) -> Result<Rig, String> {
        let options = if self.of.class == Class::Worker { self.and(IN_PLACE, true.into()) } else { self.options.clone() };
        let rig = Rig::new(self.with(&options).map_err(|why| format!("it cannot be created: {why}"))?);
        // A driver that is replaced in virtual time, by another one or by other options, has a time of its own.
        Ok(if device::in_virtual_time(&self.kind, &options) == (self.kind.clone(), options) { rig } else { rig.at_own_pace() })
    }

    /// Creates a driver with its buffers and opens it.
    pub(crate) fn open(&self) -> Result<Rig, String> {
        let mut rig = self.rig()?;
        rig.open()?;
        Ok(rig)
    }

    /// Opens a driver and returns it with its parts; `None` if it has no parts.
    pub(crate) fn open_with_parts(&self) -> Result<Option<(Rig, Vec<Joint>)>, String> {
        let rig = self.open()?;
        let joints = rig.joints();
        Ok((!joints.is_empty()).then_some((rig, joints)))
    }

    /// Returns the options with another one added.
    pub(crate) fn and(&self, option: &str, value: Value) -> Value {
        let mut options = if self.options.is_object() { self.options.clone() } else { json!({}) };
        options[option] = value;
        options
    }

    /// Returns true if the driver's exchange must be bounded, so that it may neither allocate nor block.
    pub(crate) fn is_inline(&self) -> bool {
        self.of.class == Class::Inline
    }
}

/// Returns a value of a different kind.
pub(crate) fn of_another_kind(kind: Kind) -> Value {
    match kind {
        Kind::Text => json!(7),
        Kind::Number | Kind::Whole => json!("seven"),
        Kind::Bool => json!("yes"),
        Kind::List => json!({ "a": 1 }),
        Kind::Table => json!([1]),
    }
}
