// SPDX-License-Identifier: Apache-2.0
//! Values in the form in which people write them, before a type determines their bytes.
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// A value of a parameter, preset, SVV or output. In JSON, it has the corresponding native representation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(transform = or_null))]
#[serde(untagged)]
pub enum Value {
    Bool(bool),
    Integer(i64),
    /// An integer beyond the range of `Integer`: 2^63 to 2^64 - 1.
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unsigned(u64),
    Number(f64),
    /// A quantity with a unit (`"20 ms"`) in place of a number.
    Text(String),
    List(Vec<Value>),
    Record(IndexMap<String, Value>),
}

impl Value {
    /// Describes the value for messages.
    pub fn described(&self) -> String {
        match self {
            Value::Bool(value) => value.to_string(),
            Value::Integer(value) => value.to_string(),
            Value::Unsigned(value) => value.to_string(),
            Value::Number(value) => value.to_string(),
            Value::Text(text) => format!("'{text}'"),
            Value::List(values) => format!("a list of {}", values.len()),
            Value::Record(_) => "a record".into(),
        }
    }
}

/// Allows null in place of a number that is not finite, which JSON cannot represent.
#[cfg(feature = "schema")]
fn or_null(schema: &mut schemars::Schema) {
    if let Some(choices) = schema.get_mut("anyOf").and_then(serde_json::Value::as_array_mut) {
        choices.push(serde_json::json!({ "type": "null", "description": "In an answer: a number that is not finite." }));
    }
}
