// SPDX-License-Identifier: Apache-2.0
//! Conditions for starting a verb: values must be within their ranges, and its devices must meet the requirements. The supervisor checks
//! them before every start.
use crate::configuration::Configuration;
use crate::definition::{Bound, Verb};
use crate::flatten::Flat;
use crate::plan::{Plan, PlannedBound, PlannedInput, PlannedMember, PlannedRange};
use crate::quantity::number_in;
use crate::range::{Range, is_plain, number, plausible, short};
use crate::refusal::{Class, Refusal, Refusals, SourceLocation, Where};
use crate::types::Type;
use crate::value::Value;
use hints::did_you_mean;
use indexmap::IndexMap;

/// Returns the SVVs whose current values are needed by [`settle`] and [`unmet`].
pub fn asked(plan: &Plan) -> Vec<String> {
    let mut names: Vec<String> = plan.inputs.iter().filter_map(|input| input.range.as_ref()).flat_map(|range| range.counted_from.iter().cloned()).collect();
    for requirement in &plan.requirements {
        let members = [Some(&requirement.member), requirement.when.as_ref()];
        names.extend(members.into_iter().flatten().filter_map(|member| match member {
            PlannedMember::Svv(name) => Some(name.clone()),
            PlannedMember::Parameter { .. } => None,
        }));
    }
    names.sort();
    names.dedup();
    names
}

/// Returns the requirements that the devices do not meet; the verb may start if there are none. `present` contains the current values of
/// the SVVs that [`asked`] returns.
pub fn unmet(plan: &Plan, configuration: &Configuration, present: &IndexMap<String, Value>) -> Refusals {
    let is_true = |member: &PlannedMember| {
        let value = match member {
            PlannedMember::Svv(name) => present.get(name),
            PlannedMember::Parameter { device, parameter } => configuration.logical_devices.get(device).and_then(|d| d.parameters.get(parameter)),
        };
        value == Some(&Value::Bool(true))
    };
    let failing = plan.requirements.iter().filter(|r| r.when.as_ref().is_none_or(is_true) && !is_true(&r.member));
    failing
        .map(|requirement| {
            let member = match &requirement.member {
                PlannedMember::Svv(name) => name.clone(),
                PlannedMember::Parameter { device, parameter } => format!("{device}.{parameter}"),
            };
            let message = format!("cannot start '{}': '{member}' is not true", plan.verb);
            Refusal::new(requirement.raises, message).end(format!("device '{}'", requirement.device), &None).remedy(requirement.remedy.clone())
        })
        .collect()
}

/// Returns the value to store for an input parameter with a range: a single number for an array is used for all elements, `"30 %"` is
/// that fraction of the maximum of each, and quantities are converted to the unit of their device. `None` if the input has no range and
/// is stored unchanged.
///
/// # Errors
/// `OutOfRange` if a value is outside its range; names the device and the range. `ValueRefused` or `UnitMismatch` if it is not a number.
pub fn settle(input: &PlannedInput, value: &Value, configuration: &Configuration, present: &IndexMap<String, Value>) -> Option<Result<Value, Refusals>> {
    match settle_in_range(input, value, configuration, present) {
        Some(settled) => Some(settled.and_then(|value| within_items(input, &value).map(|()| value).map_err(|r| vec![r]))),
        None => within_items(input, value).err().map(|refusal| Err(vec![refusal])),
    }
}

/// Checks a value against the ranges of the items in which it is stored.
///
/// # Errors
/// `OutOfRange` with the range, and the unit that was probably intended.
pub fn within_items(input: &PlannedInput, value: &Value) -> Result<(), Refusal> {
    let what = format!("'{}'", input.name);
    match input.item_ranges.as_slice() {
        [] => plausible(&input.unit).check(&what, &input.unit, value),
        ranges => ranges.iter().try_for_each(|range| range.check(&what, &input.unit, value)),
    }
}

fn settle_in_range(input: &PlannedInput, value: &Value, configuration: &Configuration, present: &IndexMap<String, Value>) -> Option<Result<Value, Refusals>> {
    let range = input.range.as_ref()?;
    let Ok(Type::Array(_, count)) = Type::parse(&input.type_text, &IndexMap::new()) else {
        return Some(Limits::tightest(range, input, configuration).settle(input, value, None).map_err(|r| vec![r]));
    };
    let elements: Vec<&Value> = match value {
        Value::List(list) if list.len() == count => list.iter().collect(),
        // The type itself refuses it with a better message.
        Value::List(_) => return None,
        one => vec![one; count],
    };
    let (mut settled, mut refusals) = (Vec::with_capacity(count), Refusals::new());
    for (at, element) in elements.into_iter().enumerate() {
        let from = range.counted_from.get(at).and_then(|svv| number(present.get(svv)?));
        match Limits::of(range, input, configuration, at).settle(input, element, from) {
            Ok(value) => settled.push(value),
            Err(refusal) => refusals.push(refusal),
        }
    }
    Some(if refusals.is_empty() { Ok(Value::List(settled)) } else { Err(refusals) })
}

/// Range of one element.
struct Limits {
    least: f64,
    most: f64,
    unit: String,
    /// Device and parameter from which the range was taken.
    device: Option<String>,
    parameters: Vec<String>,
}

impl Limits {
    fn of(range: &PlannedRange, input: &PlannedInput, configuration: &Configuration, at: usize) -> Limits {
        let mut limits = Limits { least: 0.0, most: 0.0, unit: input.unit.clone(), device: None, parameters: Vec::new() };
        limits.least = limits.bound(&range.least, configuration, at);
        limits.most = limits.bound(&range.most, configuration, at);
        limits
    }

    /// Returns the limits of a number that applies to several devices: the intersection of their ranges.
    fn tightest(range: &PlannedRange, input: &PlannedInput, configuration: &Configuration) -> Limits {
        let count = [&range.least, &range.most].map(|bound| if let PlannedBound::Parameter { devices, .. } = bound { devices.len() } else { 1 });
        let mut all = (0..count[0].max(count[1])).map(|at| Limits::of(range, input, configuration, at));
        let first = all.next().unwrap_or_else(|| Limits::of(range, input, configuration, 0));
        all.fold(first, |tight, limits| {
            let (least, most) = (tight.least.max(limits.least), tight.most.min(limits.most));
            if most < tight.most || least > tight.least { Limits { least, most, ..limits } } else { tight }
        })
    }

    fn bound(&mut self, bound: &PlannedBound, configuration: &Configuration, at: usize) -> f64 {
        let (sign, devices, parameter) = match bound {
            PlannedBound::Number(number) => return *number,
            PlannedBound::Parameter { sign, devices, parameter } => (sign, devices, parameter),
        };
        let found = devices.get(at).or(devices.first()).and_then(|name| Some((name, configuration.logical_devices.get(name)?)));
        let Some((name, device)) = found else { return f64::NAN };
        let declared = configuration.device_types.get(&device.device_type).and_then(|of| of.parameters.get(parameter));
        if let Some(declared) = declared.filter(|declared| !declared.unit.is_empty()) {
            self.unit = device.unit(&declared.unit);
        }
        self.device = Some(name.clone());
        if !self.parameters.contains(parameter) {
            self.parameters.push(parameter.clone());
        }
        device.parameters.get(parameter).and_then(number).map_or(f64::NAN, |value| sign * value)
    }

    fn settle(&self, input: &PlannedInput, value: &Value, from: Option<f64>) -> Result<Value, Refusal> {
        let what = || self.device.as_ref().map_or(format!("'{}'", input.name), |device| format!("'{}' for '{device}'", input.name));
        let given = match value {
            Value::Text(text) if text.trim_end().ends_with('%') => number_in(text, "").map(|share| share * self.most),
            Value::Text(text) => number_in(text, &self.unit),
            Value::Integer(integer) => Ok(*integer as f64),
            Value::Unsigned(integer) => Ok(*integer as f64),
            Value::Number(number) => Ok(*number),
            _ => {
                let refusal = Refusal::new(Class::ValueRefused, format!("it takes a number, not {}", value.described()));
                Err(refusal.remedy("give a number, or a string with a unit, for example '90 deg'"))
            }
        };
        let given = given.map_err(|refusal| refusal.for_what(&what()))?;
        let reached = from.unwrap_or(0.0) + given;
        // A NaN is outside every range.
        if (self.least..=self.most).contains(&reached) {
            return Ok(Value::Number(given));
        }
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        let whence = if self.parameters.is_empty() { String::new() } else { format!(" ({})", self.parameters.join(" to ")) };
        let counted = from.map_or(String::new(), |from| format!(" from {}, that is {}{unit}", short(from), short(reached)));
        let message = format!("{} is {}{unit}{counted}, but its range is {} to {}{unit}{whence}", what(), short(given), short(self.least), short(self.most));
        let mut refusal = Refusal::new(Class::OutOfRange, message).remedy(self.remedy(value, given, from));
        if let Some(device) = &self.device {
            refusal = refusal.end(format!("device '{device}'"), &None);
        }
        Err(refusal)
    }

    /// Returns the remedy for a plain number far outside the range: if it would be within the range in a smaller unit, that unit was
    /// probably intended.
    fn remedy(&self, value: &Value, given: f64, from: Option<f64>) -> String {
        let range = Range::closed(self.least, self.most);
        let meant = range.meant(given, from.unwrap_or(0.0), &self.unit).filter(|_| is_plain(value));
        meant.unwrap_or_else(|| "give a value within the range".to_owned())
    }
}

/// Checks that ranges and requirements refer to existing members of objects.
pub(crate) fn check(flat: &mut Flat<'_>, verb: &Verb) {
    for (name, input) in &verb.input_parameters {
        flat.subject = Some(Where::Parameter { parameter: name.clone() });
        let place = if input.place.is_some() { &input.place } else { &verb.place };
        let bounds = input.within.iter().flat_map(|(least, most)| [least, most]);
        for bound in bounds {
            if let Bound::Member(member) = bound {
                let what = format!("the range of the input parameter '{name}'");
                check_member(flat, verb, member.strip_prefix('-').unwrap_or(member), &what, &["parameter"], place);
            }
        }
        if let Some(member) = &input.counted_from {
            check_member(flat, verb, member, &format!("the input parameter '{name}', counted from"), &["SVV"], place);
        }
    }
    for (name, requirement) in &verb.requires {
        flat.subject = Some(Where::Object { object: name.split('.').next().unwrap_or(name).to_owned() });
        let place = if requirement.place.is_some() { &requirement.place } else { &verb.place };
        for member in [Some(name), requirement.when.as_ref()].into_iter().flatten() {
            check_member(flat, verb, member, "a requirement", &["SVV", "parameter"], place);
        }
    }
    flat.subject = None;
}

fn check_member(flat: &mut Flat<'_>, verb: &Verb, name: &str, what: &str, kinds: &[&str], place: &Option<SourceLocation>) {
    let found = name.split_once('.').and_then(|(object, member)| Some((verb.objects.get(object)?, member)));
    let Some((object, member)) = found else {
        let remedy = "name a member of an object, for example 'arm.max_speed'";
        return flat.refuse(Class::UnknownName, format!("{what} names '{name}', which is not a member of an object"), place, remedy);
    };
    // The existence of the type was checked with the objects.
    let Some(of) = flat.configuration.device_types.get(&object.device_type) else { return };
    let mut known: Vec<&str> = Vec::new();
    if kinds.contains(&"SVV") {
        known.extend(of.svvs.keys().map(String::as_str));
    }
    if kinds.contains(&"parameter") {
        known.extend(of.parameters.keys().map(String::as_str));
    }
    if !known.contains(&member) {
        let message = format!("{what} names '{name}': the device type '{}' has no {} '{member}'", of.name, kinds.join(" or "));
        flat.refuse(Class::UnknownName, message, place, &did_you_mean(member, known));
    }
}
