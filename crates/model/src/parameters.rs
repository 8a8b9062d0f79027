// SPDX-License-Identifier: Apache-2.0
//! Parameters of a verb and their targets: instantiation parameters (χ) and input parameters (ψ).
use crate::definition::{Bound, Verb};
use crate::flatten::{Flat, Group, ItemTarget, Origin, Port};
use crate::interface::Kind;
use crate::quantity::check_unit;
use crate::refusal::{Class, SourceLocation, Where};
use crate::value::Value;
use hints::did_you_mean;

/// A parsed parameter of a verb, by its owner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Whose {
    /// A parameter of the verb itself: `sensed`.
    Own,
    /// `arm.commanded`: a member of an object.
    Object { object: String, member: String },
    /// `drive.position`: a channel of the part that is passed as `drive`.
    Part { argument: String, channel: String },
}

/// An input parameter: ψ with its targets resolved.
#[derive(Clone, Debug)]
pub struct CheckedInput {
    pub name: String,
    pub whose: Whose,
    pub ports: Vec<Port>,
    pub default: Option<Value>,
    pub tunable: bool,
    pub preset: bool,
    pub unit: String,
    pub within: Option<(Bound, Bound)>,
    pub counted_from: Option<String>,
    pub place: Option<SourceLocation>,
}

fn whose(flat: &mut Flat<'_>, verb: &Verb, name: &str, is_svv: bool, place: &Option<SourceLocation>) -> Whose {
    let Some((first, member)) = name.split_once('.') else { return Whose::Own };
    let Some(object) = verb.objects.get(first) else {
        return Whose::Part { argument: first.to_owned(), channel: member.to_owned() };
    };
    if let Some(device_type) = flat.configuration.device_types.get(&object.device_type) {
        let (there, what) = if is_svv { (device_type.svvs.contains_key(member), "SVV") } else { (device_type.parameters.contains_key(member), "parameter") };
        if !there {
            let names: Vec<&str> =
                if is_svv { device_type.svvs.keys().map(String::as_str).collect() } else { device_type.parameters.keys().map(String::as_str).collect() };
            let remedy = did_you_mean(member, names);
            flat.refuse(Class::UnknownName, format!("'{name}': the device type '{}' has no {what} '{member}'", device_type.name), place, &remedy);
        }
    }
    Whose::Object { object: first.to_owned(), member: member.to_owned() }
}

pub(crate) fn instantiation_parameters(flat: &mut Flat<'_>, verb: &Verb) -> Vec<(usize, Whose)> {
    for (name, object) in &verb.objects {
        flat.subject = Some(Where::Object { object: name.clone() });
        if !flat.configuration.device_types.contains_key(&object.device_type) {
            let remedy = did_you_mean(&object.device_type, flat.configuration.device_types.keys().map(String::as_str));
            flat.refuse(
                Class::UnknownName,
                format!("the object '{name}' has the device type '{}', which does not exist", object.device_type),
                &verb.place,
                &remedy,
            );
        }
    }
    for name in verb.objects.keys().chain(verb.instantiation_parameters.keys()).filter(|name| OPTIONS.contains(&name.as_str())) {
        let message = format!("an argument of verb '{}' cannot be named '{name}': calls use that name themselves", verb.name);
        flat.refuse(Class::DefinitionError, message, &verb.place, &format!("choose another name, for example '{name}_value'"));
    }
    let mut parameters = Vec::with_capacity(verb.instantiation_parameters.len());
    for (name, nodes) in &verb.instantiation_parameters {
        flat.subject = Some(Where::Cell { cell: name.clone() });
        let whose = whose(flat, verb, name, true, &verb.place);
        let ports = flat.cover("", name, nodes, &verb.place);
        parameters.push((flat.groups.len(), whose));
        flat.groups.push(Group { name: name.clone(), origin: Origin::Parameter, ports, place: verb.place.clone() });
    }
    parameters
}

/// Options that every call accepts in addition to the arguments of its verb, and that `set` accepts in addition to its values.
const OPTIONS: [&str; 5] = ["time_limit", "overruns", "age_max", "every", "self"];

/// Returns true if a name is reserved in calls: an option of the calls, or a Python keyword.
pub(crate) fn is_reserved(name: &str) -> bool {
    const PYTHON: [&str; 35] = [
        "False", "None", "True", "and", "as", "assert", "async", "await", "break", "class", "continue", "def", "del", "elif", "else", "except", "finally",
        "for", "from", "global", "if", "import", "in", "is", "lambda", "nonlocal", "not", "or", "pass", "raise", "return", "try", "while", "with", "yield",
    ];
    OPTIONS.contains(&name) || PYTHON.contains(&name)
}

pub(crate) fn input_parameters(flat: &mut Flat<'_>, verb: &Verb) -> Vec<CheckedInput> {
    let mut inputs = Vec::with_capacity(verb.input_parameters.len());
    for (name, input) in &verb.input_parameters {
        flat.subject = Some(Where::Parameter { parameter: name.clone() });
        let place = if input.place.is_some() { &input.place } else { &verb.place };
        if verb.instantiation_parameters.contains_key(name) || verb.objects.contains_key(name) {
            flat.refuse(
                Class::DefinitionError,
                format!("'{name}' is both an input parameter and an instantiation parameter or object"),
                place,
                "give them different names",
            );
        }
        if is_reserved(name) {
            let message = format!("an input parameter of verb '{}' cannot be named '{name}': calls use that name themselves", verb.name);
            flat.refuse(Class::DefinitionError, message, place, &format!("choose another name, for example '{name}_value'"));
        }
        if let Err(refusal) = check_unit(&input.unit) {
            flat.push(refusal.for_what(&format!("the input parameter '{name}'")).at(place));
        }
        let whose = match if input.preset { Whose::Own } else { whose(flat, verb, name, false, place) } {
            Whose::Part { argument, .. } => {
                let remedy = did_you_mean(&argument, verb.objects.keys().map(String::as_str));
                flat.refuse(Class::UnknownName, format!("the input parameter '{name}' names the object '{argument}', which does not exist"), place, &remedy);
                continue;
            }
            whose => whose,
        };
        let mut ports = Vec::new();
        for target in &input.targets {
            match flat.resolve("", target, place) {
                Some(ItemTarget::Ports(inner)) => ports.extend(inner),
                Some(ItemTarget::Item(port)) => ports.push(port),
                None => {}
            }
        }
        for port in &ports {
            let item = flat.blocks[port.0].kind.item(port.1);
            let takes = match item.kind {
                Kind::Input | Kind::Output | Kind::Parameter => true,
                Kind::Condition => !item.type_text.is_empty(),
                _ => false,
            };
            if !takes {
                let described = flat.described(*port);
                flat.refuse(
                    Class::DefinitionError,
                    format!("the input parameter '{name}' cannot store into {described}"),
                    place,
                    "bind input parameters to ports, presets of conditions and parameters",
                );
            }
        }
        inputs.push(CheckedInput {
            name: name.clone(),
            whose,
            ports,
            default: input.default.clone(),
            tunable: input.tunable,
            preset: input.preset,
            unit: input.unit.clone(),
            within: input.within.clone(),
            counted_from: input.counted_from.clone(),
            place: place.clone(),
        });
    }
    flat.subject = None;
    inputs
}
