// SPDX-License-Identifier: Apache-2.0
//! ψ: values of input parameters as bytes, with their targets.
use crate::refuse::refuse;
use indexmap::IndexMap;
use model::configuration::{Configuration, SvvId};
use model::plan::{CellKind, InputOrigin, Plan, Target};
use model::refusal::{Class, Refusal, Refusals};
use model::types::Type;
use model::value::Value;
use std::collections::BTreeMap;

/// Encoded values of ψ, by target and by input parameter, either passed or default.
#[derive(Default)]
pub(crate) struct Psi {
    pub stores: Vec<(Target, Vec<u8>)>,
    pub inputs: InputValues,
}

/// Encoded values of input parameters, by their index in the plan.
pub(crate) type InputValues = BTreeMap<usize, Vec<u8>>;

/// Returns the values of ψ: those passed, or else the defaults; for device parameters, their current values.
pub(crate) fn psi(plan: &Plan, values: &IndexMap<String, Value>, configuration: &Configuration) -> Result<Psi, Refusals> {
    let mut refusals: Refusals = Vec::new();
    let mut found = Psi::default();
    let given = |name: &str| plan.inputs.iter().any(|i| i.name == name && i.origin == InputOrigin::Given);
    for name in values.keys().filter(|n| !given(n)) {
        let known = plan.inputs.iter().filter(|i| i.origin == InputOrigin::Given).map(|i| i.name.as_str());
        refusals.extend(
            crate::refuse::unknown(&format!("input parameter of '{}' named", plan.verb), name, known)
                .into_iter()
                .map(|r| Refusal { class: Class::CallError, ..r }),
        );
    }
    for (index, input) in plan.inputs.iter().enumerate() {
        let value = match &input.origin {
            InputOrigin::Given => values.get(&input.name).cloned().or_else(|| input.default.clone()),
            InputOrigin::Preset => match crate::starting::ranges::preset(input, configuration) {
                Ok(value) => value,
                Err(wrong) => {
                    refusals.extend(wrong);
                    continue;
                }
            },
            InputOrigin::DeviceParameter { devices, parameter } => device_values(configuration, devices, parameter, &input.type_text),
        };
        let Some(value) = value else {
            refusals.extend(refuse(Class::CallError, format!("'{}' needs its input parameter '{}'", plan.verb, input.name), "give it, or declare a default"));
            continue;
        };
        // Values that were passed have been checked already: they may have been shares of a range.
        let is_declared = input.origin != InputOrigin::Given;
        if let Some(refusal) = is_declared.then(|| model::conformity::within_items(input, &value).err()).flatten() {
            refusals.push(refusal);
            continue;
        }
        match encode(&input.type_text, &input.unit, &value) {
            Ok(bytes) => {
                found.stores.extend(input.targets.iter().map(|t| (t.clone(), bytes.clone())));
                if input.origin == InputOrigin::Given {
                    found.inputs.insert(index, bytes);
                }
            }
            Err(refusal) => refusals.push(named(refusal, &input.name)),
        }
    }
    if refusals.is_empty() { Ok(found) } else { Err(refusals) }
}

/// Returns the SVVs in which ψ stores values, with these values.
pub(crate) fn stored_svvs<'a>(plan: &'a Plan, stores: &'a [(Target, Vec<u8>)]) -> impl Iterator<Item = (&'a SvvId, &'a str, &'a [u8])> {
    let parts = stores.iter().flat_map(|(target, bytes)| {
        let cells = match target {
            Target::Cell(cell) => std::slice::from_ref(cell),
            Target::Cells(cells) => cells,
            Target::Item { .. } | Target::Report { .. } => &[],
        };
        let len = bytes.len() / cells.len().max(1);
        cells.iter().zip(bytes.chunks(len.max(1)))
    });
    parts.filter_map(|(cell, bytes)| match &plan.cells[*cell].kind {
        CellKind::Svv { id, name } => Some((id, name.as_str(), bytes)),
        _ => None,
    })
}

/// Returns the current value of a parameter of a logical device, or a list with one value per device if there are several.
pub(crate) fn device_values(configuration: &Configuration, devices: &[String], parameter: &str, type_text: &str) -> Option<Value> {
    let values: Vec<Value> = devices.iter().map(|d| configuration.logical_devices.get(d)?.parameters.get(parameter).cloned()).collect::<Option<_>>()?;
    let is_array = type_text.ends_with(']');
    if values.len() == 1 && !is_array { values.into_iter().next() } else { Some(Value::List(values)) }
}

pub(crate) fn encode(type_text: &str, unit: &str, value: &Value) -> Result<Vec<u8>, Refusal> {
    Type::parse(type_text, &IndexMap::new())?.encode(value, unit)
}

/// Returns the refusal with the parameter's name as a prefix.
pub(crate) fn named(refusal: Refusal, name: &str) -> Refusal {
    Refusal { message: format!("'{name}': {}", refusal.message), ..refusal }
}
