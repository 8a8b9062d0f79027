// SPDX-License-Identifier: Apache-2.0
//! Generates the checked-in texts that depend on the declarations: the list in the C header, the documentation page, and the Python
//! methods. A test of this crate reports outdated ones, and rewrites them if `OPENGPAC_WRITE_SCHEMAS` is set.
mod header;
mod page;
mod python;

pub use header::{header, in_header};
pub use page::page;
pub use python::python;

use crate::call::{Argument, Call};
use schemars::SchemaGenerator;
use serde_json::Value as Json;

/// Describes a schema in a word or two.
fn word(schema: &Json) -> String {
    if let Some(path) = schema["$ref"].as_str() {
        return path.rsplit('/').next().unwrap_or(path).to_owned();
    }
    if let Some(any) = schema["anyOf"].as_array() {
        return any.iter().map(word).collect::<Vec<_>>().join(" or ");
    }
    let one = |name: &str| match name {
        "string" => "text".to_owned(),
        "array" => format!("list of {}", word(&schema["items"])),
        "object" if schema["additionalProperties"].is_object() => format!("map of {}", word(&schema["additionalProperties"])),
        other => other.to_owned(),
    };
    match &schema["type"] {
        Json::String(name) => one(name),
        Json::Array(names) => names.iter().filter_map(Json::as_str).map(one).collect::<Vec<_>>().join(" or "),
        _ => "any".to_owned(),
    }
}

/// Describes the answer of a call in a word or two; `None` if the call has no answer.
fn answer(call: &Call) -> Option<String> {
    Some(word(&Json::from(call.answer_schema(&mut SchemaGenerator::default())))).filter(|word| word != "null")
}

/// Returns the required arguments, then the optional ones.
fn ordered(call: &Call) -> Vec<Argument> {
    let (must, may): (Vec<_>, Vec<_>) = call.arguments().into_iter().partition(|argument| argument.required);
    must.into_iter().chain(may).collect()
}

/// Returns the signature of a call, `name, [core], ...specification`: arguments in brackets are optional; the argument after the dots
/// consists of all remaining members of the object.
fn signature(call: &Call) -> String {
    let named = ordered(call).into_iter().map(|a| if a.required { a.name } else { format!("[{}]", a.name) });
    named.chain(call.whole.map(|(name, _)| format!("...{name}"))).collect::<Vec<_>>().join(", ")
}

/// Groups the calls by subject, in order; each subject occurs only once.
fn by_subject<'a>(calls: impl Iterator<Item = &'a Call>) -> Vec<(&'static str, Vec<&'a Call>)> {
    let mut subjects: Vec<(&'static str, Vec<&Call>)> = Vec::new();
    for call in calls {
        match subjects.iter_mut().find(|(subject, _)| *subject == call.subject) {
            Some((_, of)) => of.push(call),
            None => subjects.push((call.subject, vec![call])),
        }
    }
    subjects
}

/// Wraps text into lines of a given width, each preceded by a margin.
fn wrapped(text: &str, margin: &str, width: usize) -> String {
    let (mut lines, mut line) = (String::new(), String::new());
    for word in text.split_whitespace() {
        if !line.is_empty() && margin.len() + line.len() + 1 + word.len() > width {
            lines += &format!("{margin}{line}\n");
            line.clear();
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line += word;
    }
    lines + margin + &line + "\n"
}
