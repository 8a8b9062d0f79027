// SPDX-License-Identifier: Apache-2.0
//! Schema definitions of types that have two forms: the request form, in which members with defaults may be omitted, and the answer form,
//! in which all members are present. If the two forms of a type differ, its request form is called `NAMERequest`.
use serde_json::{Map, Value};
use std::collections::BTreeSet;

/// Path of the definitions in the schema document.
pub(crate) const DEFINITIONS: &str = "#/$defs/";

/// Merges the definitions of requests and of answers, and updates the references in `sent` to match.
pub(crate) fn unite(sent: &mut Value, mut definitions: Map<String, Value>, answered: Map<String, Value>) -> Map<String, Value> {
    let two_forms = two_forms(&definitions, &answered);
    let renamed = |name: &str| if two_forms.contains(name) { format!("{name}Request") } else { name.to_owned() };
    definitions.values_mut().chain([sent]).for_each(|of| {
        refer(of, &|path| match path.strip_prefix(DEFINITIONS) {
            Some(name) => format!("{DEFINITIONS}{}", renamed(name)),
            None => path.to_owned(),
        })
    });
    let sent = definitions.into_iter().map(|(name, of)| (renamed(&name), of));
    answered.into_iter().chain(sent).collect()
}

/// Returns the types whose two forms differ, and the types that refer to them.
fn two_forms(sent: &Map<String, Value>, answered: &Map<String, Value>) -> BTreeSet<String> {
    let both = || sent.iter().filter_map(|(name, of)| Some((name, of, answered.get(name)?)));
    let mut found: BTreeSet<String> = both().filter(|(_, of, answer)| of != answer).map(|(name, ..)| name.clone()).collect();
    loop {
        let refers = |of: &Value| references(of).iter().any(|name| found.contains(name));
        let more: Vec<String> = both().filter(|(name, of, _)| !found.contains(*name) && refers(of)).map(|(name, ..)| name.clone()).collect();
        if more.is_empty() {
            return found;
        }
        found.extend(more);
    }
}

/// Returns the definitions that a schema refers to.
fn references(of: &Value) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut look = vec![of];
    while let Some(of) = look.pop() {
        match of {
            Value::Object(members) => {
                found.extend(members.get("$ref").and_then(Value::as_str).and_then(|path| path.strip_prefix(DEFINITIONS)).map(str::to_owned));
                look.extend(members.values());
            }
            Value::Array(values) => look.extend(values),
            _ => {}
        }
    }
    found
}

/// Applies `to` to every reference in a schema.
pub(crate) fn refer(of: &mut Value, to: &impl Fn(&str) -> String) {
    match of {
        Value::Object(members) => members.iter_mut().for_each(|(name, value)| match value {
            Value::String(path) if name == "$ref" => *path = to(path),
            _ => refer(value, to),
        }),
        Value::Array(values) => values.iter_mut().for_each(|value| refer(value, to)),
        _ => {}
    }
}
