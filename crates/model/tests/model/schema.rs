// SPDX-License-Identifier: Apache-2.0
//! Checks that the committed schema of definition files matches the types.
#![cfg(feature = "schema")]

#[test]
fn the_committed_schema_is_that_of_the_code() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../python/opengpac/schemas/definitions-v1.json");
    let now = serde_json::to_string_pretty(&model::file::schema()).expect("JSON") + "\n";
    if std::env::var_os("OPENGPAC_WRITE_SCHEMAS").is_some() {
        std::fs::write(path, &now).expect("the folder is there");
    }
    let kept = std::fs::read_to_string(path).unwrap_or_default();
    assert!(kept == now, "it has changed: run this test with OPENGPAC_WRITE_SCHEMAS=1, and count the version up where old files cannot be read");
}
