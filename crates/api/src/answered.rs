// SPDX-License-Identifier: Apache-2.0
//! Result of a call. A lasting call runs in slices, so that the caller can be interrupted, and returns the call that continues it.
use crate::wrong_form;
use model::refusal::Refusals;
use serde::Serialize;
use serde_json::Value as Json;

/// Result of a call: a JSON value, or JSON text.
#[derive(Clone, Debug, PartialEq)]
pub enum CallResult<O = Json> {
    /// The call is complete and has this result.
    Done(O),
    /// The slice has expired; this call, with these arguments, continues it.
    Waiting { call: &'static str, arguments: Json },
}

/// Result of the body of a call.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome<T> {
    /// The call is complete and has this answer.
    Done(T),
    /// The slice has expired; this call, with these arguments, continues it.
    GoesOn { call: &'static str, arguments: Json },
}

impl<T> From<T> for Outcome<T> {
    fn from(answer: T) -> Outcome<T> {
        Outcome::Done(answer)
    }
}

impl<T: Serialize> Outcome<T> {
    /// Returns the answer in the requested representation.
    #[doc(hidden)]
    pub fn answered<O: Form>(self) -> Result<CallResult<O>, Refusals> {
        Ok(match self {
            Outcome::Done(answer) => CallResult::Done(O::of(answer)?),
            Outcome::GoesOn { call, arguments } => CallResult::Waiting { call, arguments },
        })
    }
}

/// Representation of an answer.
#[doc(hidden)]
pub trait Form: Sized {
    fn of(answer: impl Serialize) -> Result<Self, Refusals>;
}

impl Form for Json {
    fn of(answer: impl Serialize) -> Result<Json, Refusals> {
        serde_json::to_value(answer).map_err(|why| wrong_form(&why))
    }
}

impl Form for String {
    fn of(answer: impl Serialize) -> Result<String, Refusals> {
        serde_json::to_string(&answer).map_err(|why| wrong_form(&why))
    }
}
