// SPDX-License-Identifier: Apache-2.0
//! Ranges of values, and values that are shares of a range.
use crate::refuse::refuse;
use indexmap::IndexMap;
use model::configuration::Configuration;
use model::conformity;
use model::plan::PlannedInput;
use model::refusal::{Class, Refusals};
use model::value::Value;

/// Whether a value that the PS stores into an SVV is within its range.
pub(crate) fn within(name: &str, value: &Value, least: f64, most: f64) -> Result<(), Refusals> {
    let outside = |number: f64| !(least..=most).contains(&number);
    let is_outside = match value {
        Value::Number(number) => outside(*number),
        Value::Integer(integer) => outside(*integer as f64),
        Value::Unsigned(integer) => outside(*integer as f64),
        Value::List(elements) => return elements.iter().try_for_each(|element| within(name, element, least, most)),
        _ => false,
    };
    if !is_outside {
        return Ok(());
    }
    let given = match value {
        Value::Number(number) => number.to_string(),
        Value::Integer(integer) => integer.to_string(),
        other => format!("{other:?}"),
    };
    Err(refuse(Class::OutOfRange, format!("SVV '{name}' cannot be {given}: its range is {least} to {most}"), "give a value within the range"))
}

/// The value of an input that a composition has fixed; a share of a range is made a number.
pub(crate) fn preset(input: &PlannedInput, configuration: &Configuration) -> Result<Option<Value>, Refusals> {
    let Some(value) = &input.default else { return Ok(None) };
    conformity::settle(input, value, configuration, &IndexMap::new()).transpose().map(|settled| settled.or_else(|| input.default.clone()))
}
