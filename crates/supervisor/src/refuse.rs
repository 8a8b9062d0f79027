// SPDX-License-Identifier: Apache-2.0
//! Refusals that depend on a running system: states, claims, names of existing items.
use model::refusal::{Class, Refusal, Refusals, SourceLocation};

/// Creates a single refusal with a remedy.
pub(crate) fn refuse(class: Class, message: impl Into<String>, remedy: impl Into<String>) -> Refusals {
    refuse_at(class, message, remedy, None)
}

/// Creates a single refusal with a remedy and the location of the definition.
pub(crate) fn refuse_at(class: Class, message: impl Into<String>, remedy: impl Into<String>, place: Option<SourceLocation>) -> Refusals {
    vec![Refusal::new(class, message).remedy(remedy).at(&place)]
}

/// Refuses an unknown name, and suggests the one that was probably intended, or lists the existing ones.
pub(crate) fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Refusals {
    let known: Vec<&str> = known.collect();
    let remedy = match model::hints::nearest(name, known.iter().copied()) {
        Some(meant) => format!("did you mean '{meant}'?"),
        None if known.is_empty() => format!("there is no {what} yet"),
        None => format!("choose one of: {}", known[..known.len().min(12)].join(", ")),
    };
    refuse(Class::UnknownName, format!("there is no {what} '{name}'"), remedy)
}

/// Refuses a call that the state does not permit.
pub(crate) fn invalid_state(what: &str, state: &str, call: &str, remedy: &str) -> Refusals {
    vec![Refusal::new(Class::InvalidState, format!("cannot {call} {what}: it is {state}")).end(what, &None).remedy(remedy)]
}

/// Refuses an unknown unit.
pub(crate) fn known_unit(unit: &str, what: &str, place: &Option<SourceLocation>) -> Result<(), Refusals> {
    model::quantity::check_unit(unit).map_err(|refusal| vec![refusal.for_what(what).at(place)])
}
