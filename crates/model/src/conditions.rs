// SPDX-License-Identifier: Apache-2.0
//! Termination conditions, τ and ν of a definition.
use crate::definition::{Termination, Verb};
use crate::flatten::{Flat, Port};
use crate::lists::condition_port;
use crate::plan::PlannedCondition;
use crate::refusal::{Class, Where};
use hints::did_you_mean;
use std::collections::HashMap;

/// Conditions reported by the system rather than by a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SystemCondition {
    /// No block of the verb is active.
    Completed,
    /// The verb was halted.
    Halted,
    /// A block faulted.
    Fault,
    /// A processor on which the verb runs was lost.
    ProcessorLost,
    /// A device that the verb uses was lost.
    DeviceLost,
    /// A logical device that the verb uses was disabled.
    DeviceDisabled,
    /// The verb was replaced by a later start or aborted by a person.
    Aborted,
    /// The emergency stop was tripped.
    EmergencyStop,
    /// The verb exceeded its time limit.
    TimeLimit,
    /// More releases were skipped than allowed.
    Overrun,
    /// A ratio input received no value for too long.
    Late,
    /// No value arrived from another source for too long.
    LinkLost,
    /// A joint that the verb uses had a gap in time longer than allowed.
    TimeLost,
}

impl SystemCondition {
    /// Returns the name of the condition in verbs and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::Halted => "halted",
            Self::Fault => "fault",
            Self::ProcessorLost => "processor_lost",
            Self::DeviceLost => "device_lost",
            Self::DeviceDisabled => "device_disabled",
            Self::Aborted => "aborted",
            Self::EmergencyStop => "emergency_stop",
            Self::TimeLimit => "time_limit",
            Self::Overrun => "overrun",
            Self::Late => "late",
            Self::LinkLost => "link_lost",
            Self::TimeLost => "time_lost",
        }
    }
}

/// Conditions that exist in every verb.
pub const SYSTEM: [&str; 8] = [
    SystemCondition::Completed.name(),
    SystemCondition::Halted.name(),
    SystemCondition::Fault.name(),
    SystemCondition::ProcessorLost.name(),
    SystemCondition::DeviceLost.name(),
    SystemCondition::DeviceDisabled.name(),
    SystemCondition::Aborted.name(),
    SystemCondition::EmergencyStop.name(),
];

/// Conditions that request an orderly end. The end report contains them even if they first lead to a decelerating list.
pub const ORDERLY: [&str; 3] = [SystemCondition::Halted.name(), SystemCondition::Aborted.name(), SystemCondition::DeviceDisabled.name()];

/// Conditions that order a verb to end: the lists to which they lead never lead to further work.
pub const ENDS: [&str; 6] = [
    SystemCondition::Halted.name(),
    SystemCondition::Aborted.name(),
    SystemCondition::DeviceDisabled.name(),
    SystemCondition::TimeLimit.name(),
    SystemCondition::DeviceLost.name(),
    SystemCondition::ProcessorLost.name(),
];

/// Conditions that occur only if a start or a joint declares a limit.
pub const LIMITS: [&str; 5] = [
    SystemCondition::TimeLimit.name(),
    SystemCondition::Overrun.name(),
    SystemCondition::Late.name(),
    SystemCondition::LinkLost.name(),
    SystemCondition::TimeLost.name(),
];

/// Returns true for the name of a condition that the system reports, rather than a block.
pub fn is_system(name: &str) -> bool {
    SYSTEM.contains(&name) || LIMITS.contains(&name)
}

/// A termination condition with its transitions.
#[derive(Clone, Debug)]
pub struct CheckedCondition {
    pub planned: PlannedCondition,
    /// τ: (from list, to list).
    pub transitions: Vec<(usize, usize)>,
}

/// Resolves the condition table and τ. System conditions that the verb does not list are appended.
pub fn check_conditions(flat: &mut Flat<'_>, verb: &Verb) -> Vec<CheckedCondition> {
    let mut conditions: Vec<CheckedCondition> = Vec::with_capacity(verb.conditions.len());
    for (name, termination) in &verb.conditions {
        flat.subject = Some(Where::Condition { condition: name.clone() });
        conditions.push(check_one(flat, verb, name, termination));
    }
    for name in SYSTEM.into_iter().chain(LIMITS) {
        if let Some(during) = lists_without(&conditions, name, verb.command_lists.len()) {
            let planned =
                PlannedCondition { name: name.to_owned(), on: Vec::new(), returns: Vec::new(), normal: name == "completed", priority: 0, during, alarm: None };
            conditions.push(CheckedCondition { planned, transitions: Vec::new() });
        }
    }
    check_transitions(flat, verb, &mut conditions);
    check_returns(flat, verb, &conditions);
    flat.subject = None;
    conditions
}

/// Returns the lists to which no table entry with this name applies; an empty result stands for all lists.
fn lists_without(conditions: &[CheckedCondition], name: &str, count: usize) -> Option<Vec<usize>> {
    let held = |list: &usize| conditions.iter().any(|c| c.planned.name == name && c.planned.holds_in(*list));
    let without: Vec<usize> = (0..count).filter(|list| !held(list)).collect();
    match without.len() {
        0 if conditions.iter().any(|c| c.planned.name == name) => None,
        all if all == count => Some(Vec::new()),
        _ => Some(without),
    }
}

fn check_one(flat: &mut Flat<'_>, verb: &Verb, key: &str, termination: &Termination) -> CheckedCondition {
    let name = verb.reported(key);
    let place = if termination.place.is_some() { &termination.place } else { &verb.place };
    if termination.on.is_empty() && !is_system(name) {
        let remedy = format!("write on('label.condition'), or name one of {}, {}", SYSTEM.join(", "), LIMITS.join(", "));
        flat.refuse(Class::UnknownName, format!("the condition '{name}' is neither bound to a block condition nor a system condition"), place, &remedy);
    }
    let on: Vec<Port> = termination.on.iter().filter_map(|on| condition_port(flat, on, place, true)).collect();
    let mut returns = Vec::new();
    for output in termination.returns.iter().flatten() {
        match verb.output_values.get_index_of(output) {
            Some(index) => returns.push(index),
            None => {
                let remedy = did_you_mean(output, verb.output_values.keys().map(String::as_str));
                flat.refuse(Class::UnknownName, format!("the condition '{name}' returns '{output}', which is not an output value"), place, &remedy);
            }
        }
    }
    let during = termination.during.iter().filter_map(|list| {
        let found = verb.command_lists.get_index_of(list);
        if found.is_none() {
            let remedy = did_you_mean(list, verb.command_lists.keys().map(String::as_str));
            flat.refuse(Class::UnknownName, format!("the condition '{name}' applies during '{list}', which is not a command list"), place, &remedy);
        }
        found
    });
    let during = during.collect();
    let normal = !termination.raises && (name == "completed" || termination.returns.is_some());
    let planned = PlannedCondition { name: name.to_owned(), on, returns, normal, priority: termination.priority, during, alarm: termination.alarm.clone() };
    CheckedCondition { planned, transitions: Vec::new() }
}

/// Checks that only conditions that end the verb have ν. A condition that has a transition in every list in which it holds returns no
/// values, unless it starts an orderly end, because the end report then contains it. A part of a composed verb returns the same values as
/// on its own.
fn check_returns(flat: &mut Flat<'_>, verb: &Verb, conditions: &[CheckedCondition]) {
    if flat.is_composed {
        return;
    }
    let returns = |name: &str, termination: &Termination| termination.returns.is_some() && !ORDERLY.contains(&name);
    let returning = verb.conditions.iter().zip(conditions).filter(|((name, termination), _)| returns(name, termination));
    for ((key, termination), condition) in returning {
        let lists = verb.command_lists.keys().enumerate().filter(|(at, name)| condition.planned.holds_in(*at) && verb.ending.as_ref() != Some(name));
        let mut lists = lists.map(|(at, _)| at).peekable();
        if lists.peek().is_none() || !lists.all(|list| condition.transitions.iter().any(|(from, _)| *from == list)) {
            continue;
        }
        let place = if termination.place.is_some() { &termination.place } else { &verb.place };
        flat.subject = Some(Where::Condition { condition: key.clone() });
        let message = format!("the condition '{key}' has returns= but never ends the verb: every command list in which it holds has a transition for it");
        flat.refuse(Class::DefinitionError, message, place, "leave returns= out, or give it to the condition that ends the verb");
    }
}

fn check_transitions(flat: &mut Flat<'_>, verb: &Verb, conditions: &mut [CheckedCondition]) {
    let mut seen: HashMap<(&str, &str), &str> = HashMap::new();
    for transition in &verb.transitions {
        let place = if transition.place.is_some() { &transition.place } else { &verb.place };
        flat.subject = Some(Where::Transition { transition: (transition.from.clone(), transition.condition.clone()) });
        let text = format!("the transition ('{}', '{}') → '{}'", transition.from, transition.condition, transition.to);
        if let Some(other) = seen.insert((&transition.from, &transition.condition), &transition.to) {
            flat.refuse(
                Class::DefinitionError,
                format!("{text} conflicts with the one to '{other}'"),
                place,
                "let a condition lead from a list to only one list",
            );
            continue;
        }
        let mut list = |name: &str| {
            let found = verb.command_lists.get_index_of(name);
            if found.is_none() {
                let remedy = did_you_mean(name, verb.command_lists.keys().map(String::as_str));
                flat.refuse(Class::UnknownName, format!("{text} names the command list '{name}', which does not exist"), place, &remedy);
            }
            found
        };
        let (from, to) = (list(&transition.from), list(&transition.to));
        let named = |c: &&mut CheckedCondition| c.planned.name == transition.condition;
        if !conditions.iter_mut().any(|c| named(&c)) {
            let names = verb.conditions.keys().map(|key| verb.reported(key)).chain(SYSTEM).chain(LIMITS);
            let remedy = did_you_mean(&transition.condition, names);
            flat.refuse(Class::UnknownName, format!("{text} names the condition '{}', which is not in the verb's table", transition.condition), place, &remedy);
            continue;
        }
        if transition.condition == "emergency_stop" {
            let message = format!("{text} can never be taken: an emergency stop ends every verb at once and leaves no output to act on");
            flat.refuse(Class::DefinitionError, message, place, "leave it out, and start what is to follow after reset()");
            continue;
        }
        let (Some(from), Some(to)) = (from, to) else { continue };
        match conditions.iter_mut().find(|c| named(c) && c.planned.holds_in(from)) {
            Some(condition) => condition.transitions.push((from, to)),
            None => {
                let during = conditions.iter().filter(|c| c.planned.name == transition.condition).flat_map(|c| &c.planned.during);
                let during: Vec<String> = during.filter_map(|list| Some(format!("'{}'", verb.command_lists.get_index(*list)?.0))).collect();
                let message = format!("{text} can never be taken: '{}' holds only during {}", transition.condition, during.join(", "));
                flat.refuse(Class::DefinitionError, message, place, "leave one of them out");
            }
        }
    }
}
