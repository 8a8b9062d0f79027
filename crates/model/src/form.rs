// SPDX-License-Identifier: Apache-2.0
//! Form for starting a verb manually: its objects and instantiation parameters, then its input parameters with their types, units and
//! ranges.
use crate::checked::CheckedVerb;
use crate::definition::Bound;
use crate::flatten::Port;
use crate::interface::Kind;
use crate::parameters::{CheckedInput, Whose};
use crate::value::Value;
use serde::Serialize;

/// Kind of argument of a verb.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ArgumentKind {
    /// A logical device.
    Device,
    /// Several logical devices of the same type.
    Group,
    /// An SVV; for an array port, one SVV per element or one array.
    Svv,
    /// A channel or part of a physical device.
    Channel,
}

/// Argument needed to create an instance.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FormArgument {
    pub name: String,
    pub kind: ArgumentKind,
    /// Type of a device or a group.
    pub of: Option<String>,
    /// Type of an SVV or channel; empty if the argument may have several types.
    pub type_text: String,
    pub unit: String,
    pub doc: String,
    /// Channels that are used, if the argument is a part.
    pub members: Vec<String>,
}

/// Value passed to a start.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FormInput {
    pub name: String,
    pub type_text: String,
    pub unit: String,
    pub doc: String,
    pub default: Option<Value>,
    /// Number, or parameter of an object, such as `arm.max_speed`, optionally preceded by a minus sign.
    pub minimum: Option<Bound>,
    pub maximum: Option<Bound>,
    /// SVV of an object to which the range is relative.
    pub counted_from: Option<String>,
    /// True if the input has no default.
    pub required: bool,
    /// True if the value may be changed while the verb is running.
    pub tunable: bool,
}

impl CheckedVerb {
    /// Returns the objects, followed by the other arguments in the order of the definition.
    pub fn form_arguments(&self) -> Vec<FormArgument> {
        let mut arguments: Vec<FormArgument> = self.objects.iter().map(|(name, object)| of_object(name, &object.device_type, object.each)).collect();
        for (group, whose) in &self.parameters {
            let group = &self.groups[*group];
            let port = group.ports.first().copied();
            match whose {
                Whose::Object { .. } => {}
                Whose::Own => {
                    let (type_text, unit, doc) = port.map(|port| self.described(port)).unwrap_or_default();
                    let reaches = |port: &Port| matches!(self.blocks[port.0].kind.item(port.1).kind, Kind::DeviceRead | Kind::DeviceWrite);
                    let kind = if group.ports.iter().any(reaches) { ArgumentKind::Channel } else { ArgumentKind::Svv };
                    arguments.push(FormArgument { name: group.name.clone(), kind, of: None, type_text, unit, doc, members: Vec::new() });
                }
                Whose::Part { argument, channel } => match arguments.iter_mut().find(|known| known.name == *argument) {
                    Some(known) => known.members.push(channel.clone()),
                    None => arguments.push(FormArgument { members: vec![channel.clone()], ..of_part(argument) }),
                },
            }
        }
        arguments
    }

    /// Returns the values that may be passed to a start, excluding presets and values taken from a device.
    pub fn form_inputs(&self) -> Vec<FormInput> {
        let own = |input: &&CheckedInput| !input.preset && !matches!(input.whose, Whose::Object { .. });
        self.inputs.iter().filter(own).map(|input| self.form_input(input)).collect()
    }

    fn form_input(&self, input: &CheckedInput) -> FormInput {
        let (type_text, unit, doc) = input.ports.first().map(|port| self.described(*port)).unwrap_or_default();
        let of_item = || input.ports.first().and_then(|&(block, item)| self.blocks[block].kind.item(item).range?.ends());
        let (minimum, maximum) = input.within.clone().or_else(|| of_item().map(|(least, most)| (Bound::Number(least), Bound::Number(most)))).unzip();
        FormInput {
            name: input.name.clone(),
            type_text,
            unit: if input.unit.is_empty() { unit } else { input.unit.clone() },
            doc,
            default: input.default.clone(),
            minimum,
            maximum,
            counted_from: input.counted_from.clone(),
            required: input.default.is_none(),
            tunable: input.tunable,
        }
    }

    /// Returns the type, unit and meaning of a port. A type whose size depends on the arguments is returned as declared.
    fn described(&self, (block, item): Port) -> (String, String, String) {
        let kind = &self.blocks[block].kind;
        let declared = kind.item(item);
        let text = kind.layout(item, None).map_or_else(|| declared.type_text.clone(), |layout| layout.text.clone());
        (text, declared.unit.clone(), declared.doc.clone())
    }
}

fn of_object(name: &str, device_type: &str, each: bool) -> FormArgument {
    let kind = if each { ArgumentKind::Group } else { ArgumentKind::Device };
    FormArgument { kind, of: Some(device_type.to_owned()), ..of_part(name) }
}

fn of_part(name: &str) -> FormArgument {
    FormArgument {
        name: name.to_owned(),
        kind: ArgumentKind::Channel,
        of: None,
        type_text: String::new(),
        unit: String::new(),
        doc: String::new(),
        members: Vec::new(),
    }
}
