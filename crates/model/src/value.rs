// SPDX-License-Identifier: Apache-2.0
//! Values as people write them, before a type says how many bytes they are.
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// A value of a parameter, preset, SVV or output. In JSON it is what it looks like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(transform = or_null))]
#[serde(untagged)]
pub enum Value {
    Bool(bool),
    Integer(i64),
    /// One beyond the range of `Integer`: 2^63 to 2^64 - 1.
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unsigned(u64),
    Number(f64),
    /// A quantity with a unit (`"20 ms"`), where a number is wanted.
    Text(String),
    List(Vec<Value>),
    Record(IndexMap<String, Value>),
}

impl Value {
    /// Returns the value in words, as a message has it.
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

/// Replaces a number that is not finite by null in an answer: JSON has no other word for it.
#[cfg(feature = "schema")]
fn or_null(schema: &mut schemars::Schema) {
    if let Some(choices) = schema.get_mut("anyOf").and_then(serde_json::Value::as_array_mut) {
        choices.push(serde_json::json!({ "type": "null", "description": "In an answer: a number that is not finite." }));
    }
}
