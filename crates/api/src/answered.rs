// SPDX-License-Identifier: Apache-2.0
//! Result of a call. A lasting call runs slice by slice, so that the caller can be interrupted, and names the call that continues it.
use crate::wrong_form;
use model::refusal::Refusals;
use serde::Serialize;
use serde_json::Value as Json;

/// Result of a call; a value as JSON, or as JSON text.
#[derive(Clone, Debug, PartialEq)]
pub enum CallResult<O = Json> {
    /// The call is complete, with this result.
    Done(O),
    /// The slice has expired: the call continues with this call and these arguments.
    Waiting { call: &'static str, arguments: Json },
}

/// Result of the body of a call.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome<T> {
    /// The call is complete, with this answer.
    Done(T),
    /// The slice has expired: the call continues with this call and these arguments.
    GoesOn { call: &'static str, arguments: Json },
}

impl<T> From<T> for Outcome<T> {
    fn from(answer: T) -> Outcome<T> {
        Outcome::Done(answer)
    }
}

impl<T: Serialize> Outcome<T> {
    /// Returns the answer in the requested form.
    #[doc(hidden)]
    pub fn answered<O: Form>(self) -> Result<CallResult<O>, Refusals> {
        Ok(match self {
            Outcome::Done(answer) => CallResult::Done(O::of(answer)?),
            Outcome::GoesOn { call, arguments } => CallResult::Waiting { call, arguments },
        })
    }
}

/// A form of an answer.
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
