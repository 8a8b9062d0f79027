// SPDX-License-Identifier: Apache-2.0
//! Arguments of a call, parsed from JSON text.
use model::refusal::{Class, Refusal, Refusals};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value as Json};

/// Parses arguments directly into their type; returns `None` if they do not match it, in which case [`CallArguments`] reports the
/// mistake.
#[doc(hidden)]
pub fn quick<T: DeserializeOwned>(text: &str) -> Option<T> {
    let text = text.trim_ascii_start();
    // A list would also be accepted for a struct.
    let object = if text.is_empty() { "{}" } else { text };
    if object.starts_with('{') { serde_json::from_str(object).ok() } else { None }
}

/// Arguments of a call, taken one at a time; any that remain are refused.
#[doc(hidden)]
pub struct CallArguments {
    call: &'static str,
    given: Map<String, Json>,
}

impl CallArguments {
    /// Parses the arguments of one call from JSON text; an empty text means that there are none.
    pub fn of(call: &'static str, text: &str) -> Result<CallArguments, Refusals> {
        let given = if text.trim().is_empty() { Map::new() } else { crate::from_json(text)? };
        Ok(CallArguments { call, given })
    }

    /// Takes a required argument.
    pub fn must<T: DeserializeOwned>(&mut self, name: &str) -> Result<T, Refusals> {
        let value = self.given.remove(name).unwrap_or(Json::Null);
        serde_json::from_value(value).map_err(|why| {
            let why = why.to_string();
            vec![Refusal::new(class_of(&why), format!("argument '{name}' of call '{}': {}", self.call, model::wording::plain(&why)))]
        })
    }

    /// Takes an optional argument.
    pub fn may<T: DeserializeOwned + Default>(&mut self, name: &str) -> Result<T, Refusals> {
        if self.given.contains_key(name) { self.must(name) } else { Ok(T::default()) }
    }

    /// Takes all remaining arguments as one value.
    pub fn whole<T: DeserializeOwned>(&mut self) -> Result<T, Refusals> {
        let given = Json::Object(std::mem::take(&mut self.given));
        serde_path_to_error::deserialize(given).map_err(|why| {
            let at = why.path().to_string();
            let of = if at == "." || at == "?" { String::new() } else { format!("'{at}': ") };
            let why = why.inner().to_string();
            vec![Refusal::new(class_of(&why), format!("call '{}': {of}{}", self.call, model::wording::plain(&why)))]
        })
    }

    /// Refuses any arguments that were not taken.
    pub fn none_left(&self) -> Result<(), Refusals> {
        match self.given.keys().next() {
            None => Ok(()),
            Some(name) => Err(vec![Refusal::new(Class::CallError, format!("call '{}' has no argument '{name}'", self.call))]),
        }
    }
}

/// Returns the class of refusal for a value that could not be parsed: an integer that does not fit into its type is well-formed, but out
/// of range.
fn class_of(why: &str) -> Class {
    if why.starts_with("invalid value: integer") { Class::OutOfRange } else { Class::CallError }
}

/// Returns the value of one argument as text: a string unchanged, a number as digits. `None` if it is missing or has another type.
pub(crate) fn peek(text: &str, name: &str) -> Option<String> {
    struct Peeking<'a>(&'a str);

    impl<'de> serde::de::Visitor<'de> for Peeking<'_> {
        type Value = Option<String>;

        fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
            f.write_str("an object")
        }

        fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
            let mut found = None;
            while let Some(key) = map.next_key::<std::borrow::Cow<'de, str>>()? {
                if key == self.0 {
                    found = match map.next_value::<Json>()? {
                        Json::String(text) => Some(text),
                        Json::Number(number) => Some(number.to_string()),
                        _ => None,
                    };
                } else {
                    map.next_value::<serde::de::IgnoredAny>()?;
                }
            }
            Ok(found)
        }
    }

    serde::Deserializer::deserialize_map(&mut serde_json::Deserializer::from_str(text), Peeking(name)).ok().flatten()
}
