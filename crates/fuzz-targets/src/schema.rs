// SPDX-License-Identifier: Apache-2.0
//! Validates a value against a JSON Schema; limited to the features used by the schemas of the control interface.
use serde_json::{Map, Value as Json};

/// Returns the first mismatch, with its path; `None` if the value is valid. `root` contains the targets of references.
pub(crate) fn misfit(schema: &Json, value: &Json, root: &Json) -> Option<String> {
    let Json::Object(schema) = schema else {
        return (schema == &Json::Bool(false)).then(|| format!("{value} is not allowed"));
    };
    let of_all = || schema.get("allOf").and_then(Json::as_array).and_then(|all| all.iter().find_map(|one| misfit(one, value, root)));
    let of_one = |word: &str| {
        let choices = schema.get(word)?.as_array()?;
        choices.iter().all(|one| misfit(one, value, root).is_some()).then(|| format!("{value} is none of what {word} names"))
    };
    referred(schema, value, root)
        .or_else(|| of_type(schema, value))
        .or_else(|| of_value(schema, value))
        .or_else(|| of_members(schema, value, root))
        .or_else(|| of_items(schema, value, root))
        .or_else(of_all)
        .or_else(|| of_one("anyOf"))
        .or_else(|| of_one("oneOf"))
}

fn referred(schema: &Map<String, Json>, value: &Json, root: &Json) -> Option<String> {
    let pointer = schema.get("$ref")?.as_str()?.strip_prefix('#')?;
    misfit(root.pointer(pointer).expect("a test of the schemas follows every reference"), value, root)
}

fn of_type(schema: &Map<String, Json>, value: &Json) -> Option<String> {
    let types = schema.get("type")?;
    let is = |name: &str| match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("JSON Schema has no type '{other}'"),
    };
    let one_of = match types {
        Json::Array(names) => names.iter().filter_map(Json::as_str).any(is),
        other => other.as_str().is_some_and(is),
    };
    (!one_of).then(|| format!("{value} is no {types}"))
}

fn of_value(schema: &Map<String, Json>, value: &Json) -> Option<String> {
    let is_other = schema.get("const").is_some_and(|only| only != value) || schema.get("enum").and_then(Json::as_array).is_some_and(|of| !of.contains(value));
    let (least, most) = (schema.get("minimum").and_then(Json::as_f64), schema.get("maximum").and_then(Json::as_f64));
    let is_beyond = value.as_f64().is_some_and(|number| least.is_some_and(|least| number < least) || most.is_some_and(|most| number > most));
    (is_other || is_beyond).then(|| format!("{value} is not one of the values"))
}

fn of_members(schema: &Map<String, Json>, value: &Json, root: &Json) -> Option<String> {
    let members = value.as_object()?;
    let required = schema.get("required").and_then(Json::as_array).into_iter().flatten().filter_map(Json::as_str);
    let missing = required.into_iter().find(|name| !members.contains_key(*name)).map(|name| format!("there is no '{name}' in {value}"));
    let known = schema.get("properties").and_then(Json::as_object);
    let wrong = |(name, member): (&String, &Json)| {
        let of = known.and_then(|known| known.get(name)).or_else(|| schema.get("additionalProperties"))?;
        misfit(of, member, root).map(|why| format!("'{name}': {why}"))
    };
    missing.or_else(|| members.iter().find_map(wrong))
}

fn of_items(schema: &Map<String, Json>, value: &Json, root: &Json) -> Option<String> {
    let items = value.as_array()?;
    let bound = |word: &str| schema.get(word).and_then(Json::as_u64);
    let len = items.len() as u64;
    if bound("minItems").is_some_and(|least| len < least) || bound("maxItems").is_some_and(|most| len > most) {
        return Some(format!("{value} has {len} items"));
    }
    let first = schema.get("prefixItems").and_then(Json::as_array);
    let wrong = |(place, item): (usize, &Json)| {
        let of = first.and_then(|first| first.get(place)).or_else(|| schema.get("items"))?;
        misfit(of, item, root).map(|why| format!("[{place}]: {why}"))
    };
    items.iter().enumerate().find_map(wrong)
}
