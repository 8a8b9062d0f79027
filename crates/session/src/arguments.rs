// SPDX-License-Identifier: Apache-2.0
//! What every call does with texts: takes its arguments, answers.
use model::refusal::{Class, Refusal, Refusals};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value as Json};

/// The arguments of a call, taken one by one; what is left over is refused.
pub(crate) struct Arguments<'a> {
    call: &'a str,
    given: Map<String, Json>,
}

impl<'a> Arguments<'a> {
    /// Those of one call from their JSON text; empty: none.
    pub(crate) fn of(call: &'a str, text: &str) -> Result<Arguments<'a>, Refusals> {
        let given = if text.trim().is_empty() { Map::new() } else { crate::from_json(text)? };
        Ok(Arguments { call, given })
    }

    pub(crate) fn take<T: DeserializeOwned>(&mut self, name: &str) -> Result<T, Refusals> {
        let value = self.given.remove(name).unwrap_or(Json::Null);
        serde_json::from_value(value).map_err(|why| {
            vec![Refusal::new(Class::CallError, format!("argument '{name}' of call '{}': {}", self.call, model::wording::plain(&why.to_string())))]
        })
    }

    pub(crate) fn or<T: DeserializeOwned + Default>(&mut self, name: &str) -> Result<T, Refusals> {
        if self.given.contains_key(name) { self.take(name) } else { Ok(T::default()) }
    }

    /// The whole object as one value.
    pub(crate) fn whole<T: DeserializeOwned>(&mut self) -> Result<T, Refusals> {
        let given = std::mem::take(&mut self.given);
        serde_json::from_value(given.into())
            .map_err(|why| vec![Refusal::new(Class::CallError, format!("call '{}': {}", self.call, model::wording::plain(&why.to_string())))])
    }

    pub(crate) fn none_left(&self) -> Result<(), Refusals> {
        match self.given.keys().next() {
            None => Ok(()),
            Some(name) => Err(vec![Refusal::new(Class::CallError, format!("call '{}' has no argument '{name}'", self.call))]),
        }
    }
}

/// What a group of calls answers: nothing where the call is not one of its own.
pub(crate) type Answer = Result<Option<Json>, Refusals>;

pub(crate) fn done(of: Result<(), Refusals>) -> Answer {
    of.map(|()| Some(Json::Null))
}

pub(crate) fn told(of: impl serde::Serialize) -> Answer {
    serde_json::to_value(of).map(Some).map_err(|why| crate::wrong_form(&why))
}
