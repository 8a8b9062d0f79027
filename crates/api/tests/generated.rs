// SPDX-License-Identifier: Apache-2.0
//! Checks that the committed texts generated from the declarations of calls are up to date.
use std::path::Path;

/// Compares a generated file with the committed one; rewrites it first if requested.
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
    compare("python/opengpac/system/calls.py", &api::generate::python(api::calls()));
}

/// Crates that handle calls or their results, and words in them that coincide with a call's name: the file and the word.
const CARRIERS: [&str; 10] = ["api", "bindings", "c-package", "control", "daemon", "places", "recorder", "replay", "rtp", "supervisor"];
const OTHER_THINGS: [(&str, &str); 7] = [
    ("api/src/role.rs", "download"),                          // the word of a role
    ("recorder/src/recorder.rs", "configuration"),            // an entry of a recording's metadata
    ("recorder/src/recorder.rs", "names"),                    // another one
    ("supervisor/src/definitions/code.rs", "library"),        // the module of the standard blocks
    ("supervisor/src/definitions/block_trial.rs", "library"), // the same
    ("supervisor/src/alarms/causes.rs", "emergency_stop"),    // a condition
    ("control/src/openapi.rs", "delete"),                     // a method of HTTP
];

/// Returns the code of a file: without comments, and without the tests at its end.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]").next().unwrap_or("");
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// Returns the string literals in code that are compared, matched or looked up: `== "x"`, `"x" =>`, `matches!(…, "x"`, `find("x")`,
/// `["x", "y"]`.
fn compared(code: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(begins) = code[at..].find('"').map(|offset| at + offset) {
        let Some(ends) = code[begins + 1..].find('"').map(|offset| begins + 1 + offset) else { break };
        let (before, after) = (code[..begins].trim_end(), code[ends + 1..].trim_start());
        let line = &code[code[..begins].rfind('\n').map_or(0, |newline| newline + 1)..begins];
        let is_arm = code[ends..].lines().next().is_some_and(|rest| rest.contains("=>")) && !line.contains("=>");
        let is_looked_up = ["::find(", "::known(", "::begin(system,", "::call(system,"].iter().any(|call| before.ends_with(call));
        let is_in_list = (before.ends_with('[') || before.ends_with("\",")) && (after.starts_with(']') || after.starts_with(", \"")) && line.contains("const ");
        let is_matched = line.contains("matches!(") && !line[line.rfind("matches!(").unwrap_or(0)..].contains(')');
        let is_equal = before.ends_with("==") || before.ends_with("!=") || after.starts_with("==") || after.starts_with("!=");
        if is_equal || (is_arm && (before.ends_with(['{', '}', ',', '|', '(']) || line.trim().is_empty())) || is_looked_up || is_in_list || is_matched {
            found.push(&code[begins + 1..ends]);
        }
        at = ends + 1;
    }
    found
}

#[test]
fn no_call_is_matched_by_its_name() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = Vec::new();
    for name in CARRIERS {
        let mut folders = vec![crates.join(name).join("src")];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(&folder).expect("the sources are there").map(|entry| entry.expect("it can be read").path()) {
                let file = entry.strip_prefix(&crates).expect("it is below").display().to_string();
                if entry.is_dir() {
                    // The declarations of the calls contain their names.
                    folders.extend(Some(entry).filter(|_| file != "api/src/calls"));
                } else if file.ends_with(".rs") {
                    let text = std::fs::read_to_string(&entry).expect("a source is text");
                    let names = compared(&code(&text)).into_iter().filter(|word| api::find(word).is_some()).map(str::to_owned).collect::<Vec<_>>();
                    found.extend(names.into_iter().filter(|word| !OTHER_THINGS.contains(&(&file, word))).map(|word| format!("{file}: {word}")));
                }
            }
        }
    }
    assert_eq!(found, Vec::<String>::new(), "give the call a property in its declaration (crates/api/src/effect.rs) and ask for that");
}

#[test]
fn what_matches_a_name_is_found() {
    for line in [
        r#"if call.name == "start" {"#,
        r#"("create" | "start", Some(subject)) => {"#,
        r#"const STOPS: [&str; 2] = ["halt", "pause"];"#,
        r#"matches!(call.name, "wait" | "report")"#,
        r#"let call = api::known("perform");"#,
    ] {
        assert!(!compared(line).is_empty(), "{line}");
    }
    assert_eq!(compared(r#"log.add(now_ns, "start", &name, "");"#), Vec::<&str>::new());
}
