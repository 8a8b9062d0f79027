// SPDX-License-Identifier: Apache-2.0
//! Ranges of the members of a logical device: its parameters, and the values that the PS stores in its SVVs.
use crate::definition::{Bound, DeviceType, Within};
use crate::range::{Range, is_plain, number, plausible};
use crate::refusal::{Class, Refusal, Refusals};
use crate::value::Value;
use hints::did_you_mean;
use indexmap::IndexMap;

impl Within {
    /// Returns the range, evaluated with the current values of the parameters that define its bounds, and the names of these parameters.
    pub fn resolve(&self, parameters: &IndexMap<String, Value>) -> (Range, String) {
        let (least, most) = match self {
            Within::Range(range) => return (*range, String::new()),
            Within::Between(least, most) => (least, most),
        };
        let end = |bound: &Bound| match bound {
            Bound::Number(number) => *number,
            Bound::Member(name) => {
                let (sign, name) = signed(name);
                parameters.get(name).and_then(number).map_or(f64::NAN, |value| sign * value)
            }
        };
        let names: Vec<&str> = members(self).collect();
        (Range::closed(end(least), end(most)), names.join(" to "))
    }
}

fn signed(name: &str) -> (f64, &str) {
    name.strip_prefix('-').map_or((1.0, name), |name| (-1.0, name))
}

fn members(within: &Within) -> impl Iterator<Item = &str> {
    let bounds = match within {
        Within::Range(_) => None,
        Within::Between(least, most) => Some([least, most]),
    };
    bounds.into_iter().flatten().filter_map(|bound| match bound {
        Bound::Member(name) => Some(name.as_str()),
        Bound::Number(_) => None,
    })
}

/// Checks a value of a device parameter. `parameters` contains all parameters of the device; `unit` is the unit of the one being checked.
///
/// # Errors
/// `OutOfRange` with the range and its origin.
pub fn check_parameter(of: &DeviceType, device: &str, name: &str, unit: &str, parameters: &IndexMap<String, Value>) -> Result<(), Refusal> {
    let (Some(declared), Some(value)) = (of.parameters.get(name), parameters.get(name)) else { return Ok(()) };
    let (range, whence) = declared.within.as_ref().map_or_else(|| (plausible(unit), String::new()), |within| within.resolve(parameters));
    let what = format!("parameter '{name}' of device '{device}'");
    match number(value).filter(|given| !range.contains(*given)) {
        Some(given) => Err(range.refusal(&what, unit, given, is_plain(value), &whence)),
        None => range.check(&what, unit, value),
    }
}

/// Checks the ranges declared by a device type: they must be well-formed, refer to numeric parameters of the type, and contain its
/// defaults.
///
/// # Errors
/// Returns all mistakes.
pub fn check_ranges(of: &DeviceType) -> Result<(), Refusals> {
    let defaults: IndexMap<String, Value> = of.parameters.iter().map(|(name, parameter)| (name.clone(), parameter.default.clone())).collect();
    let svvs = of.svvs.iter().map(|(name, svv)| ("SVV", name, svv.within.as_ref()));
    let parameters = of.parameters.iter().map(|(name, parameter)| ("parameter", name, parameter.within.as_ref()));
    let mut refusals = Refusals::new();
    for (kind, name, within) in svvs.chain(parameters) {
        let Some(within) = within else { continue };
        let what = format!("the range of {kind} '{name}' of device type '{}'", of.name);
        let unknown = members(within).map(|member| signed(member).1).find(|member| defaults.get(*member).and_then(number).is_none());
        if let Some(member) = unknown {
            let numbers = defaults.iter().filter(|(_, value)| number(value).is_some()).map(|(name, _)| name.as_str());
            let message = format!("{what} names '{member}', which is not one of its numeric parameters");
            refusals.push(Refusal::new(Class::UnknownName, message).remedy(did_you_mean(member, numbers)).at(&of.place));
            continue;
        }
        let (range, _) = within.resolve(&defaults);
        if let Some((least, most)) = range.reversed() {
            let message = format!("{what} is reversed: {least} to {most}");
            refusals.push(Refusal::new(Class::DefinitionError, message).remedy("give the lower end first").at(&of.place));
        }
    }
    if !refusals.is_empty() {
        return Err(refusals);
    }
    for (name, parameter) in &of.parameters {
        if let Err(refusal) = check_parameter(of, &of.name, name, &parameter.unit, &defaults) {
            refusals.push(refusal.at(&of.place));
        }
    }
    if refusals.is_empty() { Ok(()) } else { Err(refusals) }
}
