// SPDX-License-Identifier: Apache-2.0
//! Values specified as a fraction of a range.
use indexmap::IndexMap;
use model::configuration::Configuration;
use model::conformity;
use model::plan::PlannedInput;
use model::refusal::Refusals;
use model::value::Value;

/// Returns the preset value of an input of a composed verb; a fraction of a range is converted to a number.
pub(crate) fn preset(input: &PlannedInput, configuration: &Configuration) -> Result<Option<Value>, Refusals> {
    let Some(value) = &input.default else { return Ok(None) };
    conformity::settle(input, value, configuration, &IndexMap::new()).transpose().map(|settled| settled.or_else(|| input.default.clone()))
}
