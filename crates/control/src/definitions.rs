// SPDX-License-Identifier: Apache-2.0
//! Definitions of types in two forms: as they are sent, where what has a default may be left out, and as they are answered, where all is
//! there. A type whose forms differ is called `NAMERequest` as it is sent.
use serde_json::{Map, Value};
use std::collections::BTreeSet;

/// Path of definitions in the schema document.
pub(crate) const DEFINITIONS: &str = "#/$defs/";

/// Unites the definitions of what is sent and of what is answered; references in `sent` follow.
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

/// Types whose forms differ, or refer to such.
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

/// Rewrites every reference in a schema.
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
