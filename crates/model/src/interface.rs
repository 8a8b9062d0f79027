// SPDX-License-Identifier: Apache-2.0
//! Interfaces of function blocks: the paper's five components, and state.
use crate::range::Range;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// Relation of a port's updates to its block's invocations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "PortMode"))]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    Synchronous,
    Ratio(u32),
    Asynchronous,
}

impl Mode {
    /// Returns the name of the mode for messages.
    pub(crate) fn name(self) -> String {
        match self {
            Mode::Synchronous => "synchronous".into(),
            Mode::Ratio(n) => format!("ratio {n}"),
            Mode::Asynchronous => "asynchronous".into(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "ItemKind"))]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    Input,
    Output,
    DeviceRead,
    DeviceWrite,
    Condition,
    Parameter,
    State,
    Size,
}

/// Item of an interface; its index in [`Interface::items`] equals its index in the descriptor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Item {
    pub name: String,
    pub kind: Kind,
    pub mode: Mode,
    /// C type as declared; empty if the item is a condition without a value.
    pub type_text: String,
    pub unit: String,
    /// Items whose units determine the unit of this item: declared as `=u`, the unit of u, or `=k.u`, the product of both units. `unit`
    /// is then empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unit_of: Vec<String>,
    /// Allowed numbers (for an array, of each element), declared after the unit as in `rad/s (0, 10]`. If absent, any finite number is
    /// allowed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<Range>,
    pub doc: String,
    /// True if the input may be left unbound.
    #[serde(default)]
    pub has_default: bool,
    #[serde(default)]
    pub nonfinite: bool,
    /// True if the number of elements is the block's size.
    #[serde(default)]
    pub sized: bool,
    /// Number of most recent values that a history input reads; they are ordered oldest first. 0 if the input reads only the current
    /// value. `type_text` is the type of a single value.
    #[serde(default)]
    pub history: u32,
    /// Default of a parameter, preset or defaulted input, as bytes of its type (from the descriptor's image); unused for a size.
    #[serde(default)]
    pub default: Vec<u8>,
    /// Minimum and maximum n of a size item.
    #[serde(default)]
    pub least: u32,
    #[serde(default)]
    pub most: u32,
}

impl Item {
    /// Splits a declared unit into the unit itself, or the items whose product it is, and the range that follows it.
    pub fn declared_unit(text: &str) -> (String, Vec<String>, Option<Range>) {
        let (unit, range) = Range::split(text);
        match unit.strip_prefix('=') {
            Some(of) => (String::new(), of.split('.').map(|name| name.trim().to_owned()).collect(), range),
            None => (unit.to_owned(), Vec::new(), range),
        }
    }
}

/// Interface of a block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Interface {
    /// Name of the block, as `module.block`.
    pub name: String,
    pub doc: String,
    pub items: Vec<Item>,
    /// Named struct types used by the items: name → declaration (`struct { double x; double[4] q; }`).
    #[serde(default)]
    pub types: IndexMap<String, String>,
    #[serde(default)]
    pub file: String,
    #[serde(default)]
    pub line: u32,
}
