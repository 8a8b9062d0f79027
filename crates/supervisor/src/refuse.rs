// SPDX-License-Identifier: Apache-2.0
//! Refusals that only a running system can give: states, claims, names of what exists.
use model::refusal::{Class, End, Place, Refusal, Refusals};

/// One refusal with a remedy.
pub(crate) fn refuse(class: Class, message: impl Into<String>, remedy: impl Into<String>) -> Refusals {
    vec![Refusal { class, message: message.into(), ends: Vec::new(), remedy: remedy.into(), place: None }]
}

/// The same with the place where the thing was defined.
pub(crate) fn refuse_at(class: Class, message: impl Into<String>, remedy: impl Into<String>, place: Option<Place>) -> Refusals {
    vec![Refusal { class, message: message.into(), ends: Vec::new(), remedy: remedy.into(), place }]
}

/// A name that is not there, with the names that are.
pub(crate) fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Refusals {
    let mut known: Vec<&str> = known.collect();
    known.truncate(12);
    let remedy = if known.is_empty() { format!("there is no {what} yet") } else { format!("there are: {}", known.join(", ")) };
    refuse(Class::UnknownName, format!("there is no {what} '{name}'"), remedy)
}

/// A call that the state does not allow.
pub(crate) fn invalid_state(what: &str, state: &str, call: &str, remedy: &str) -> Refusals {
    vec![Refusal {
        class: Class::InvalidState,
        message: format!("cannot {call} {what}: it is {state}"),
        ends: vec![End { what: what.to_owned(), place: None }],
        remedy: remedy.to_owned(),
        place: None,
    }]
}
