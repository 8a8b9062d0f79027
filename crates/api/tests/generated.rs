// SPDX-License-Identifier: Apache-2.0
//! Checks that the texts made of the declarations of calls and checked in are up to date.
use std::path::Path;

/// Writes the file again if that is asked for, and compares.
fn compare(path: &str, now: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path);
    if std::env::var_os("OPENGPAC_WRITE_SCHEMAS").is_some() {
        std::fs::write(&path, now).expect("the folder is there");
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == now, "{} is stale: run this test with OPENGPAC_WRITE_SCHEMAS=1, and read what it changed", path.display());
}

#[test]
fn the_list_in_the_c_header_is_that_of_the_declarations() {
    let path = "crates/c-package/include/opengpac_ps.h";
    let kept = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)).expect("the header is there");
    compare(path, &api::generate::in_header(&kept, &api::generate::header(api::calls())).expect("it has a place for the list"));
}

#[test]
fn the_page_of_the_calls_is_that_of_the_declarations() {
    compare("docs/calls.md", &api::generate::page(api::calls()));
}

#[test]
fn the_calls_in_python_are_those_of_the_declarations() {
    compare("python/opengpac/calls.py", &api::generate::python(api::calls()));
}
