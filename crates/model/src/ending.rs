// SPDX-License-Identifier: Apache-2.0
//! Checks the ending list and the suspension of a verb.
use crate::conditions::CheckedCondition;
use crate::definition::{ENDING_LIMIT_NS, Holding, Suspend, Verb};
use crate::flatten::{Flat, ItemTarget, Port};
use crate::interface::Kind;
use crate::lists::condition_port;
use crate::plan::PlannedEnding;
use crate::refusal::{Class, Where};
use hints::did_you_mean;

/// Suspension of a verb, with its ports resolved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CheckedSuspend {
    Idle,
    Hold,
    HoldLast,
    Safe,
    /// Pairs of the port to set and the condition to wait for.
    Holding(Vec<(Port, Port)>),
}

impl CheckedSuspend {
    /// Returns the ports into which the supervisor stores values; they need no other cover.
    pub fn given(&self) -> Vec<Port> {
        match self {
            CheckedSuspend::Holding(ways) => ways.iter().map(|(set, _)| *set).collect(),
            _ => Vec::new(),
        }
    }
}

/// Checks that the ending list exists, that it is not the initial list, and that no transition enters or leaves it.
pub fn check_ending(flat: &mut Flat<'_>, verb: &Verb, initial: usize) -> PlannedEnding {
    let limit_ns = verb.ending_limit_ns.unwrap_or(ENDING_LIMIT_NS);
    if limit_ns <= 0 {
        let message = format!("verb '{}' has an ending limit of {limit_ns} ns", verb.name);
        flat.refuse(Class::DefinitionError, message, &verb.place, "give a positive time, for example ending_limit='2 s'");
    }
    let Some(name) = &verb.ending else { return PlannedEnding { list: None, limit_ns } };
    flat.subject = Some(Where::List { list: name.clone() });
    let list = verb.command_lists.get_index_of(name);
    match list {
        None => {
            let remedy = did_you_mean(name, verb.command_lists.keys().map(String::as_str));
            flat.refuse(Class::UnknownName, format!("the ending list '{name}' of verb '{}' does not exist", verb.name), &verb.place, &remedy);
        }
        Some(list) if list == initial => {
            let message = format!("the ending list '{name}' of verb '{}' is also its initial one", verb.name);
            flat.refuse(Class::DefinitionError, message, &verb.place, "use a separate command list for the end");
        }
        Some(_) => {}
    }
    for transition in verb.transitions.iter().filter(|t| t.from == *name || t.to == *name) {
        let place = if transition.place.is_some() { &transition.place } else { &verb.place };
        flat.subject = Some(Where::Transition { transition: (transition.from.clone(), transition.condition.clone()) });
        let way = if transition.from == *name { "leaves" } else { "enters" };
        let message = format!("the transition ('{}', '{}') → '{}' {way} the ending list", transition.from, transition.condition, transition.to);
        flat.refuse(Class::DefinitionError, message, place, "leave it out: the ending list runs when the verb ends, and nothing leads into it or out of it");
    }
    flat.subject = None;
    PlannedEnding { list, limit_ns }
}

/// Checks a verb's suspension: the port that is set must be a Boolean, and the condition must not end the verb in lists in which it may
/// be suspended.
pub fn check_suspend(flat: &mut Flat<'_>, verb: &Verb, conditions: &[CheckedCondition]) -> CheckedSuspend {
    match &verb.suspend {
        Suspend::Idle => CheckedSuspend::Idle,
        Suspend::Hold => CheckedSuspend::Hold,
        Suspend::HoldLast => CheckedSuspend::HoldLast,
        Suspend::Safe => CheckedSuspend::Safe,
        Suspend::Holding(ways) => CheckedSuspend::Holding(ways.iter().filter_map(|way| check_holding(flat, verb, way, conditions)).collect()),
    }
}

fn check_holding(flat: &mut Flat<'_>, verb: &Verb, Holding { set, until }: &Holding, conditions: &[CheckedCondition]) -> Option<(Port, Port)> {
    let port = match flat.resolve("", set, &verb.place) {
        Some(ItemTarget::Item(port)) => Some(port),
        Some(ItemTarget::Ports(ports)) => ports.first().copied(),
        None => None,
    };
    if let Some(port) = port {
        let item = flat.blocks[port.0].kind.item(port.1);
        if !matches!(item.kind, Kind::Input | Kind::Parameter) || !matches!(item.type_text.as_str(), "bool" | "_Bool") {
            let described = flat.described(port);
            let message = format!("suspending verb '{}' sets {described}, which is not an input or parameter of type bool", verb.name);
            flat.refuse(Class::TypeMismatch, message, &verb.place, "name a bool that makes the block come to rest");
        }
    }
    let condition = condition_port(flat, until, &verb.place, true);
    // A condition limited to certain lists may end the verb: there the verb is already coming to rest for good.
    let mut everywhere = conditions.iter().filter(|c| c.planned.during.is_empty());
    if let Some(ends) = everywhere.find(|c| condition.is_some_and(|until| c.planned.on.contains(&until))) {
        let message = format!("'{until}' reports that verb '{}' may be suspended, but the condition '{}' stands for it too", verb.name, ends.planned.name);
        flat.refuse(Class::DefinitionError, message, &verb.place, "use a condition that ends nothing, or limit that one with during=");
    }
    Some((port?, condition?))
}
