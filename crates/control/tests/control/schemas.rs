// SPDX-License-Identifier: Apache-2.0
//! The committed schemas are those of the code, and what calls answer fits them.
use serde_json::Value as Json;

const KEPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/schemas/control-v1.json");

#[test]
fn the_committed_schemas_are_those_of_the_code() {
    let now = serde_json::to_string_pretty(&control::schemas()).expect("JSON") + "\n";
    if std::env::var_os("OPENGPAC_WRITE_SCHEMAS").is_some() {
        std::fs::write(KEPT, &now).expect("the folder is there");
    }
    let kept = std::fs::read_to_string(KEPT).unwrap_or_default();
    assert!(kept == now, "they have changed: run this test with OPENGPAC_WRITE_SCHEMAS=1, and read what it changed");
}

#[test]
fn the_committed_schema_of_the_journal_is_that_of_the_code() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/schemas/journal-v1.json");
    let now = serde_json::to_string_pretty(&control::journal::lines::schema()).expect("JSON") + "\n";
    if std::env::var_os("OPENGPAC_WRITE_SCHEMAS").is_some() {
        std::fs::write(path, &now).expect("the folder is there");
    }
    let kept = std::fs::read_to_string(path).unwrap_or_default();
    assert!(kept == now, "it has changed: run this test with OPENGPAC_WRITE_SCHEMAS=1, and count the version up where old files cannot be read");
}

#[test]
fn every_reference_in_the_schemas_leads_somewhere() {
    fn look(of: &Json, all: &Json) {
        match of {
            Json::Object(map) => map.iter().for_each(|(name, value)| match value.as_str().filter(|_| name == "$ref") {
                Some(path) => assert!(path.strip_prefix('#').is_some_and(|pointer| all.pointer(pointer).is_some()), "{path}"),
                None => look(value, all),
            }),
            Json::Array(list) => list.iter().for_each(|value| look(value, all)),
            _ => {}
        }
    }
    let all = control::schemas();
    look(&all, &all);
    assert_eq!(all["calls"].as_object().map(serde_json::Map::len), Some(control::calls::CALLS.len()));
}
