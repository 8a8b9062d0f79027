// SPDX-License-Identifier: Apache-2.0
//! Checks that the committed schemas match the code, and that the results of calls conform to them.
use serde_json::Value as Json;

/// Checks that a committed document matches the code; rewrites it first if requested.
fn is_kept(name: &str, document: &Json, remedy: &str) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas").join(name);
    let now = serde_json::to_string_pretty(document).expect("JSON") + "\n";
    if std::env::var_os("OPENGPAC_WRITE_SCHEMAS").is_some() {
        std::fs::write(&path, &now).expect("the folder is there");
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == now, "{name} has changed: run this test with OPENGPAC_WRITE_SCHEMAS=1, {remedy}");
}

#[test]
fn the_committed_schemas_are_those_of_the_code() {
    is_kept("control-v1.json", &control::schemas(), "read what it changed, and run `npm run shapes` in the studio");
}

#[test]
fn the_committed_openapi_document_is_that_of_the_code() {
    is_kept("openapi-v1.json", &control::openapi(), "and read what it changed");
}

#[test]
fn the_committed_schema_of_the_journal_is_that_of_the_code() {
    is_kept("journal-v1.json", &daemon::journal::lines::schema(), "and count the version up where old files cannot be read");
}

#[test]
fn no_answer_is_anything() {
    let all = control::schemas();
    let anything: Vec<&String> =
        all["calls"].as_object().into_iter().flatten().filter(|(_, call)| is_anything(&call["result"])).map(|(name, _)| name).collect();
    assert!(anything.is_empty(), "{anything:?}");
}

fn is_anything(schema: &Json) -> bool {
    *schema == Json::Bool(true) || schema.as_object().is_some_and(serde_json::Map::is_empty)
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
    let (all, openapi) = (control::schemas(), control::openapi());
    look(&all, &all);
    look(&openapi, &openapi);
    assert_eq!(all["calls"].as_object().map(serde_json::Map::len), Some(daemon::calls::all().count()));
}
