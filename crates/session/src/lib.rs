// SPDX-License-Identifier: Apache-2.0
//! A session of a programming system with a real-time system: texts in, texts out.
//!
//! Definitions, applications, values and reports have one JSON form. Whoever speaks it is a programming system: the Python package
//! through its bindings, a C program through the C package. [`open`] makes a system; [`call`] is every call on it by its name,
//! [`begin`] the same for who must not wait long.
mod arguments;
mod call;
mod cell;
mod commanded;
mod open;
mod recordings;
mod values;
mod waits;

pub use call::{begin, call, source_kind};
pub use commanded::commanded;
pub use open::open;
pub use recordings::{end_recording, record, recording};
pub use values::read;
pub use waits::{Answered, WAITS};

pub use model::refusal::Refusals;
pub use supervisor::System;

use model::refusal::{Class, Refusal};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A value of the model from JSON; what is not of its form is refused as a definition error.
pub fn from_json<T: DeserializeOwned>(json: &str) -> Result<T, Refusals> {
    let mut reader = serde_json::Deserializer::from_str(json);
    let read: Result<T, _> = serde_path_to_error::deserialize(&mut reader);
    let value = read.map_err(|why| {
        let at = why.path().to_string();
        let of = if at == "." || at == "?" { "this".to_owned() } else { format!("'{at}'") };
        vec![Refusal::new(Class::DefinitionError, format!("{of} is not of the right form: {}", model::wording::plain(&why.inner().to_string())))]
    })?;
    reader.end().map_err(|why| wrong_form(&why))?;
    Ok(value)
}

/// JSON of a value. Errors: what JSON cannot say, a map whose keys are no texts.
pub fn to_json(value: &impl Serialize) -> Result<String, Refusals> {
    serde_json::to_string(value).map_err(|why| wrong_form(&why))
}

/// A refusal of a call itself: what was asked for cannot be understood.
pub fn refusal(message: &str) -> Refusal {
    Refusal::new(Class::CallError, message)
}

fn wrong_form(why: &serde_json::Error) -> Refusals {
    vec![Refusal::new(Class::DefinitionError, format!("this is not of the right form: {}", model::wording::plain(&why.to_string())))]
}
