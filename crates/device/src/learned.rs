// SPDX-License-Identifier: Apache-2.0
//! Services and counters that a driver declares when it is created. A declaration exists before the program runs; a driver that
//! represents others, such as a class in Python, obtains its services and counters from them.
use crate::counters::CounterWord;
use crate::declaration::Declaration;
use crate::manual::{CounterAbout, OptionAbout, ServiceAbout};
use crate::option_word::{Kind, OptionWord};
use crate::services::ServiceWord;
use serde::Deserialize;
use serde_json::Value;
use std::sync::{Mutex, PoisonError};

/// Services and counters of one device, in the format of a [`Declaration`].
#[derive(Clone, Copy, Debug, Default)]
pub struct DeclaredServices {
    pub services: &'static [ServiceWord],
    pub counters: &'static [CounterWord],
}

#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
struct Texts {
    #[serde(default)]
    services: Vec<ServiceAbout>,
    #[serde(default)]
    counters: Vec<CounterAbout>,
}

/// Declarations read so far. Words live as long as the process, so equal ones are stored only once.
static KEPT: Mutex<Vec<(Texts, DeclaredServices)>> = Mutex::new(Vec::new());

impl DeclaredServices {
    /// Reads `services` and `counters` from a driver's description of its device, in the format of a [`Manual`](crate::Manual).
    ///
    /// # Errors
    /// Fails if they do not have that format.
    pub fn read(about: &Value) -> Result<DeclaredServices, String> {
        let texts: Texts = Texts::deserialize(about).map_err(|why| format!("its services and counters: {why}"))?;
        let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, told)) = kept.iter().find(|(of, _)| *of == texts) {
            return Ok(*told);
        }
        let services = texts.services.iter().map(service).collect::<Result<Vec<_>, _>>()?.leak();
        let counters = texts.counters.iter().map(|of| CounterWord { name: stays(&of.name), unit: stays(&of.unit), doc: stays(&of.doc) });
        let told = DeclaredServices { services, counters: counters.collect::<Vec<_>>().leak() };
        kept.push((texts, told));
        Ok(told)
    }

    /// Returns the declaration of a driver with these services and counters instead of its own.
    pub fn declare(self, of: &'static Declaration) -> &'static Declaration {
        Box::leak(Box::new(Declaration { services: self.services, counters: self.counters, ..*of }))
    }
}

fn service(of: &ServiceAbout) -> Result<ServiceWord, String> {
    let arguments = of.arguments.iter().map(argument).collect::<Result<Vec<_>, _>>()?.leak();
    Ok(ServiceWord { name: stays(&of.name), doc: stays(&of.doc), arguments, answer: of.answer.as_deref().map(kind).transpose()?, moves: of.moves })
}

fn argument(of: &OptionAbout) -> Result<OptionWord, String> {
    let default = of.default.as_deref().map(stays);
    let range = of.range.as_deref().map(str::parse).transpose()?;
    Ok(OptionWord { unit: stays(&of.unit), default, range, ..OptionWord::needed(stays(&of.name), kind(&of.kind)?, stays(&of.doc)) })
}

fn kind(name: &str) -> Result<Kind, String> {
    Kind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| format!("'{name}' is not a kind of value"))
}

fn stays(text: &str) -> &'static str {
    String::from(text).leak()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn words_are_read_once() {
        let argument = json!({ "name": "level", "kind": "number", "unit": "W", "default": "1.0", "doc": "how warm" });
        let services = json!([{ "name": "warm", "doc": "warms it", "arguments": [argument], "answer": "bool", "moves": true }]);
        let about = json!({ "parts": [], "services": services, "counters": [{ "name": "late", "unit": "", "doc": "late answers" }] });
        let told = DeclaredServices::read(&about).expect("words");
        assert_eq!(
            (told.services[0].name, told.services[0].arguments[0].unit, told.services[0].answer, told.services[0].moves),
            ("warm", "W", Some(Kind::Bool), true)
        );
        assert_eq!(told.counters[0].name, "late");
        assert!(std::ptr::eq(told.services, DeclaredServices::read(&about).expect("the same").services));
        assert!(DeclaredServices::read(&json!({})).expect("nothing").services.is_empty());
        let wrong = json!({ "services": [{ "name": "warm", "doc": "", "arguments": [], "answer": "heat" }] });
        assert_eq!(DeclaredServices::read(&wrong).expect_err("a kind that is none"), "'heat' is not a kind of value");
    }
}
