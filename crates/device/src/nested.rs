// SPDX-License-Identifier: Apache-2.0
//! Finds the value in nested options that a type rejects, and its path: `servos.elbow.id`.
//!
//! Errors of `serde` do not include the location. Each value is left out in turn: if the error then disappears, that value is the cause.
use serde_json::Value;

/// Maximum number of values for which options are searched, because each value costs one deserialisation of all of them.
const SEARCHED_MAX: usize = 1_000;

/// A step from a value to one nested in it.
#[derive(Clone, Debug, PartialEq)]
enum Step {
    Name(String),
    Index(usize),
}

/// Returns the path of the value that `error_of` rejects, or of the missing value; empty if it is not found.
pub(crate) fn path(options: &Value, error_of: impl Fn(&Value) -> Option<String>) -> String {
    let Some(error) = error_of(options) else { return String::new() };
    let named = error.split('`').nth(1).unwrap_or("");
    let mut all = Vec::new();
    paths(options, &mut Vec::new(), &mut all);
    if all.len() > SEARCHED_MAX {
        return named.to_owned();
    }
    // The deepest value whose removal changes the error. If its removal only makes it a missing field, it is the cause only if the error quotes it.
    let explains = |path: &&Vec<Step>| {
        let mut without = options.clone();
        remove(&mut without, path);
        let missing = matches!(path.last(), Some(Step::Name(name)) if error_of(&without).is_some_and(|left| left.contains(&format!("missing field `{name}`"))));
        (!missing || quotes(&error, options, path)) && error_of(&without).as_ref() != Some(&error)
    };
    let found = all.iter().filter(explains).max_by_key(|path| path.len());
    let mut text = found.map_or_else(String::new, |path| written(options, path));
    if error.starts_with("missing field") {
        if !text.is_empty() {
            text.push('.');
        }
        text.push_str(named);
    }
    text
}

/// Returns true if an error message quotes the value at a path.
fn quotes(error: &str, options: &Value, path: &[Step]) -> bool {
    match at(options, path) {
        Some(Value::String(text)) => error.contains(&format!("{text:?}")) || error.contains(&format!("`{text}`")),
        Some(value @ (Value::Number(_) | Value::Bool(_))) => error.contains(&format!("`{value}`")),
        Some(Value::Object(_)) => error.contains("invalid type: map"),
        Some(Value::Array(_)) => error.contains("invalid type: sequence"),
        _ => false,
    }
}

/// Collects the paths of all values nested in `value`.
fn paths(value: &Value, here: &mut Vec<Step>, all: &mut Vec<Vec<Step>>) {
    let inside: Vec<(Step, &Value)> = match value {
        Value::Object(table) => table.iter().map(|(name, value)| (Step::Name(name.clone()), value)).collect(),
        Value::Array(list) => list.iter().enumerate().map(|(index, value)| (Step::Index(index), value)).collect(),
        _ => Vec::new(),
    };
    for (step, value) in inside {
        here.push(step);
        all.push(here.clone());
        paths(value, here, all);
        here.pop();
    }
}

fn at<'a>(value: &'a Value, path: &[Step]) -> Option<&'a Value> {
    path.iter().try_fold(value, |value, step| match step {
        Step::Name(name) => value.get(name),
        Step::Index(index) => value.get(index),
    })
}

fn remove(value: &mut Value, path: &[Step]) {
    match (path, value) {
        ([Step::Name(name)], Value::Object(table)) => drop(table.remove(name)),
        ([Step::Index(index)], Value::Array(list)) if *index < list.len() => drop(list.remove(*index)),
        ([Step::Name(name), rest @ ..], Value::Object(table)) => {
            if let Some(inside) = table.get_mut(name) {
                remove(inside, rest);
            }
        }
        ([Step::Index(index), rest @ ..], Value::Array(list)) => {
            if let Some(inside) = list.get_mut(*index) {
                remove(inside, rest);
            }
        }
        _ => {}
    }
}

/// Formats a path for messages; an element of a list is identified by its `name`, if it has one.
fn written(options: &Value, path: &[Step]) -> String {
    let mut text = String::new();
    for (depth, step) in path.iter().enumerate() {
        let called = at(options, &path[..=depth]).and_then(|value| value.get("name")).and_then(Value::as_str);
        match (step, called) {
            (Step::Index(index), None) => text.push_str(&format!("[{index}]")),
            (Step::Index(_), Some(name)) => text.push_str(&format!(".{name}")),
            (Step::Name(name), _) if text.is_empty() => text.push_str(name),
            (Step::Name(name), _) => text.push_str(&format!(".{name}")),
        }
    }
    text
}
