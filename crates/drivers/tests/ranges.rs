// SPDX-License-Identifier: Apache-2.0
//! Every number in the options and services of every driver has a range, and a value outside it is refused with its path before anything
//! opens.
use device::{Inside, Kind, OptionWord, Reach};
use serde_json::{Value, json};

/// A path in options: the names that lead to a number, with a name of its own for each entry.
type OptionPath = (Vec<String>, OptionWord);

/// Collects all numbers at this path and below.
fn numbers(word: &OptionWord, way: &[String], found: &mut Vec<OptionPath>) {
    let way = [way, &[word.name.to_owned()]].concat();
    if word.is_numeric() {
        found.push((way.clone(), *word));
    }
    match word.inside {
        Inside::Nothing => {}
        Inside::Fields(words) => words.iter().copied().flatten().for_each(|word| numbers(word, &way, found)),
        Inside::Entries(words) => {
            let way = [way, vec!["one".to_owned()]].concat();
            words.iter().copied().flatten().for_each(|word| numbers(word, &way, found));
        }
    }
}

fn numbers_of(kind: &str) -> Vec<OptionPath> {
    let mut found = Vec::new();
    let of = device::find(kind).expect("a driver of ours");
    device::options_of(of).into_iter().for_each(|word| numbers(word, &[], &mut found));
    found
}

/// Returns options with all required entries, and this value at the path `way`.
fn options(kind: &str, way: &[String], value: Value) -> Value {
    let of = device::find(kind).expect("a driver of ours");
    let needed = device::options_of(of).into_iter().filter(|word| word.default.is_none() && word.name != way[0]);
    let sample = |word: &OptionWord| match (word.kind, word.reach) {
        (_, Reach::Driver) => json!({ "kind": "loopback", "options": { "parts": ["a"] } }),
        (Kind::Text, _) => json!("nowhere"),
        (Kind::Number | Kind::Whole, _) => json!(word.interval().least.max(1.0) as i64),
        (Kind::List, _) => json!([]),
        (Kind::Table, _) => json!({}),
        (Kind::Bool, _) => json!(false),
    };
    let mut all: serde_json::Map<String, Value> = needed.map(|word| (word.name.to_owned(), sample(word))).collect();
    let inside = way[1..].iter().rev().fold(value, |inside, name| json!({ name: inside }));
    let of_list = device::options_of(of).into_iter().any(|word| word.name == way[0] && word.kind == Kind::List && way.len() > 1);
    all.insert(way[0].clone(), if of_list { named(inside) } else { inside });
    Value::Object(all)
}

/// Converts a table of tables to a list of tables, each with its name as `name`.
fn named(of: Value) -> Value {
    let entries = of.as_object().into_iter().flatten().map(|(name, entry)| {
        let mut entry = entry.clone();
        entry["name"] = json!(name);
        entry
    });
    entries.collect()
}

#[test]
fn each_number_of_each_driver_and_service_declares_a_range() {
    let mut count = 0;
    for of in drivers::declarations() {
        let mut found = numbers_of(of.kind);
        let arguments = of.services.iter().flat_map(|service| service.arguments);
        arguments.for_each(|word| numbers(word, &["a service".to_owned()], &mut found));
        for (way, word) in found {
            count += 1;
            assert!(word.range.is_some(), "driver '{}': {} declares no range: .within(least, most), or .above(least, most)", of.kind, way.join("."));
        }
    }
    assert!(count > 150, "{count}");
}

#[test]
fn a_number_beyond_its_range_is_refused_by_its_path_before_anything_opens() {
    let mut count = 0;
    for of in drivers::declarations() {
        for (way, word) in numbers_of(of.kind) {
            let range = word.interval();
            let beyond = |end: f64, by: f64| if word.kind == Kind::Whole { json!((end + by) as i64) } else { json!(end + by) };
            let ends = [(range.least, if range.is_above { 0.0 } else { -1.0 }), (range.most, 1.0)];
            for (end, by) in ends.into_iter().filter(|(end, _)| end.is_finite() && end.abs() < 1e15) {
                let value = beyond(end, by);
                let value = if word.kind == Kind::List { json!([0, value]) } else { value };
                let refused = device::check(of.kind, &options(of.kind, &way, value.clone())).err();
                let refused = refused.unwrap_or_else(|| panic!("driver '{}' takes {} = {value}", of.kind, way.join("."))).to_string();
                let said = format!("driver '{}': option '{}': it cannot be ", of.kind, way.join("."));
                assert!(refused.starts_with(&said) && refused.contains(": its range is "), "{refused}");
                count += 1;
            }
        }
    }
    assert!(count > 200, "{count}");
}

#[test]
fn numbers_of_a_driver_within_another_have_their_path() {
    let inner = json!({ "kind": "loopback", "options": { "parts": ["a"], "slew": -1 } });
    let refused = device::check("plant_process", &json!({ "driver": inner })).expect_err("its slew is negative").to_string();
    assert_eq!(refused, "driver 'plant_process': option 'driver.options.slew': it cannot be -1 N.m/s: its range is above 0 N.m/s to 1e9 N.m/s");
}
