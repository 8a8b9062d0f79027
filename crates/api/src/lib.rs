// SPDX-License-Identifier: Apache-2.0
//! The programming system's interface to a real-time system, with JSON texts in both directions.
//!
//! Definitions, applications, values and reports have the same JSON format for all programming systems: the Python package through its
//! bindings, a C program through the C package, and a remote program through the control interface. [`open`] creates a system. [`call()`]
//! executes a call by name, and [`begin`] does the same for a caller that must not wait long.
//!
//! Each call is declared once, in [`calls`](mod@calls), using [`calls!`]. Its implementation, its role, the schemas of its arguments and
//! its answer, its treatment by the journal and the log of commands, and its entries in the C header, the docs and the Python package
//! ([`generate`]) are all derived from that declaration.
mod answered;
mod arguments;
mod call;
mod calls;
mod declare;
mod effect;
pub mod generate;
mod journal;
mod open;
mod performing;
mod role;
mod values;
mod waits;

pub use answered::{CallResult, Outcome};
#[doc(hidden)]
pub use arguments::{CallArguments, quick};
pub use call::{Argument, Call, begin, call, commanded, known};
pub use calls::{add, calls, find, is_recording, prepare, with_effect};
pub use effect::{DriverArgument, Effect, RecordArguments};
pub use journal::{JournalEntry, JournalRule};
pub use open::open;
pub use performing::{PreparedVerb, StartedVerb};
pub use role::Role;
pub use values::{Reading, Snapshot, snapshot};

pub use model::refusal::Refusals;
pub use supervisor::System;

use model::refusal::{Class, Refusal};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Parses a value of the model from JSON; malformed values are refused as definition errors.
pub fn from_json<T: DeserializeOwned>(json: &str) -> Result<T, Refusals> {
    let mut reader = serde_json::Deserializer::from_str(json);
    let read: Result<T, _> = serde_path_to_error::deserialize(&mut reader);
    let value = read.map_err(|why| {
        let at = why.path().to_string();
        let of = if at == "." || at == "?" { "this".to_owned() } else { format!("'{at}'") };
        vec![Refusal::new(Class::DefinitionError, format!("{of} does not have the right form: {}", model::wording::plain(&why.inner().to_string())))]
    })?;
    reader.end().map_err(|why| wrong_form(&why))?;
    Ok(value)
}

/// Serialises a value to JSON. Fails if JSON cannot represent it, for example a map whose keys are not strings.
pub fn to_json(value: &impl Serialize) -> Result<String, Refusals> {
    serde_json::to_string(value).map_err(|why| wrong_form(&why))
}

/// Creates the refusal of a call that cannot be understood.
pub fn refusal(message: &str) -> Refusal {
    Refusal::new(Class::CallError, message)
}

/// Wraps the answer of a call that cannot be refused.
fn sure<T>(answer: T) -> Result<T, Refusals> {
    Ok(answer)
}

fn wrong_form(why: &serde_json::Error) -> Refusals {
    vec![Refusal::new(Class::DefinitionError, format!("this does not have the right form: {}", model::wording::plain(&why.to_string())))]
}
