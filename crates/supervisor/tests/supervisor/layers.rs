// SPDX-License-Identifier: Apache-2.0
//! Checks that dependencies point down only: each crate of this workspace uses those below it and none above.
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Crates of this workspace that each crate may use.
const HOUSE: &[(&str, &[&str])] = &[
    ("opengpac-derive", &[]),
    ("opengpac", &["opengpac-derive"]),
    ("model", &["hints"]),
    ("mcap", &[]),
    ("forks", &[]),
    ("scheduling", &[]),
    ("interconnect", &[]),
    ("hints", &[]),
    ("device", &["hints"]),
    ("process-kit", &["interconnect", "shared-memory"]),
    ("hosts", &["interconnect", "scheduling"]),
    ("kernel", &["opengpac", "device", "forks", "interconnect"]),
    ("runtime", &["opengpac", "device", "forks", "process-kit", "interconnect", "kernel", "modules", "scheduling"]),
    ("guard", &["device", "interconnect", "process-kit", "scheduling"]),
    ("driver-kit", &["opengpac", "device", "forks", "process-kit", "hints", "interconnect"]),
    ("cia402", &["device"]),
    ("canopen", &["cia402", "device", "forks"]),
    ("ethercat", &["cia402", "device", "forks", "hints", "scheduling"]),
    ("drivers", &["canopen", "ethercat", "device", "forks", "driver-kit", "process-kit", "interconnect", "hints", "scheduling"]),
    ("shared-memory", &["forks", "interconnect", "scheduling"]),
    ("modules", &["opengpac"]),
    ("library", &["opengpac"]),
    ("rtp", &["opengpac", "device", "process-kit", "interconnect", "kernel", "runtime", "drivers", "modules", "library"]),
    ("replay", &["opengpac", "device", "process-kit", "interconnect", "kernel", "runtime", "modules", "rtp", "mcap"]),
    ("supervisor", &["opengpac", "model", "device", "process-kit", "interconnect", "kernel", "runtime", "drivers", "guard", "modules", "library", "rtp"]),
    ("places", &["opengpac", "device", "process-kit", "interconnect", "kernel", "guard", "shared-memory", "rtp", "modules", "hosts"]),
    ("recorder", &["model", "hints", "supervisor", "mcap", "replay"]),
    ("taught", &["model", "supervisor"]),
    ("api", &["model", "interconnect", "kernel", "runtime", "supervisor", "places", "recorder", "taught"]),
    ("daemon", &["opengpac", "model", "supervisor", "api"]),
    ("control", &["opengpac", "model", "supervisor", "api", "daemon"]),
    (
        "bindings",
        &[
            "opengpac",
            "canopen",
            "ethercat",
            "device",
            "model",
            "modules",
            "library",
            "guard",
            "drivers",
            "supervisor",
            "api",
            "places",
            "daemon",
            "control",
            "recorder",
            "replay",
        ],
    ),
    ("c-package", &["api"]),
    ("simulator", &["opengpac", "device", "model", "interconnect", "kernel", "runtime", "guard", "drivers", "api", "supervisor", "daemon", "control"]),
    (
        "fuzz-targets",
        &[
            "drivers",
            "canopen",
            "cia402",
            "ethercat",
            "opengpac",
            "model",
            "mcap",
            "interconnect",
            "kernel",
            "runtime",
            "modules",
            "library",
            "rtp",
            "daemon",
            "control",
            "api",
            "supervisor",
        ],
    ),
];

/// External crates that some crates must not use.
const ABSENT: &[(&str, &[&str])] = &[
    ("opengpac", &["serde", "serde_json", "libc", "libloading", "pyo3"]),
    ("model", &["libc", "libloading", "pyo3", "rtrb", "tokio"]),
    ("shared-memory", &["serde", "serde_json", "pyo3", "kernel"]),
    ("interconnect", &["serde", "serde_json", "pyo3", "zenoh"]),
    ("guard", &["kernel", "drivers", "rtp", "pyo3"]),
    ("process-kit", &["serde_json", "device", "kernel", "pyo3"]),
    ("device", &["kernel", "interconnect", "libc", "libloading", "pyo3"]),
    ("hosts", &["serde_json", "pyo3", "kernel"]),
    ("kernel", &["runtime", "process-kit", "serde_json", "pyo3", "libloading", "zenoh"]),
    ("runtime", &["serde_json", "pyo3", "libloading", "zenoh"]),
    ("rtp", &["pyo3", "supervisor", "model"]),
    ("supervisor", &["pyo3", "tokio", "axum"]),
    ("recorder", &["pyo3", "tokio", "axum", "kernel"]),
    ("api", &["pyo3", "tokio", "axum"]),
    ("daemon", &["pyo3", "kernel", "libc", "axum", "hyper", "tower", "rustls", "tokio-rustls"]),
    ("control", &["pyo3", "kernel", "libc"]),
    ("supervisor", &["pyo3", "zenoh"]),
];

/// Returns the crates of the workspace, each with its build dependencies (without those of its tests only).
fn crates() -> BTreeMap<String, Vec<String>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let cargo =
        Command::new(env!("CARGO")).args(["metadata", "--no-deps", "--offline", "--format-version", "1"]).current_dir(root).output().expect("cargo runs");
    assert!(cargo.status.success(), "{}", String::from_utf8_lossy(&cargo.stderr));
    let metadata: Json = serde_json::from_slice(&cargo.stdout).expect("metadata is JSON");
    let built_with = |package: &Json| {
        let dependencies = package["dependencies"].as_array().expect("a list").iter().filter(|d| d["kind"] != "dev");
        dependencies.map(|d| d["name"].as_str().expect("a name").to_owned()).collect()
    };
    let packages = metadata["packages"].as_array().expect("a list");
    packages.iter().map(|p| (p["name"].as_str().expect("a name").to_owned(), built_with(p))).collect()
}

#[test]
fn arrows_point_down_only() {
    let crates = crates();
    let mut wrong = Vec::new();
    for (name, dependencies) in &crates {
        let Some((_, below)) = HOUSE.iter().find(|(of, _)| of == name) else {
            wrong.push(format!("'{name}' has no place in the house: give it one here and in ARCHITECTURE.md"));
            continue;
        };
        let up = dependencies.iter().filter(|d| crates.contains_key(*d) && !below.contains(&d.as_str()));
        wrong.extend(up.map(|d| format!("'{name}' knows '{d}', which is not below it")));
    }
    assert_eq!(wrong, Vec::<String>::new());
    assert!(HOUSE.iter().all(|(name, _)| crates.contains_key(*name)), "a crate of the house is gone: {:?}", crates.keys());
}

#[test]
fn what_a_layer_must_not_know_is_absent() {
    let crates = crates();
    for (name, absent) in ABSENT {
        let found: Vec<&String> = crates[*name].iter().filter(|d| absent.contains(&d.as_str())).collect();
        assert!(found.is_empty(), "'{name}' is built with {found:?}");
    }
}

#[test]
fn only_what_takes_minutes_to_build_is_left_out_by_default() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let cargo =
        Command::new(env!("CARGO")).args(["metadata", "--no-deps", "--offline", "--format-version", "1"]).current_dir(root).output().expect("cargo runs");
    let metadata: Json = serde_json::from_slice(&cargo.stdout).expect("metadata is JSON");
    let built = metadata["workspace_default_members"].as_array().expect("a list");
    let packages = metadata["packages"].as_array().expect("a list").iter();
    let left_out: Vec<_> = packages.filter(|p| !built.contains(&p["id"])).map(|p| p["name"].as_str().expect("a name")).collect();
    assert_eq!(left_out, ["hosts"], "name every other crate in `default-members` of the workspace's Cargo.toml");
}

/// Returns the code lines of a crate that contain one of these words.
fn lines_with(name: &str, words: &[&str]) -> Vec<String> {
    fn scan(folder: &Path, words: &[&str], found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).expect("the sources are there") {
            let path = entry.expect("a folder can be read").path();
            if path.is_dir() {
                scan(&path, words, found);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = std::fs::read_to_string(&path).expect("a source is text");
                let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
                found.extend(code.filter(|line| words.iter().any(|word| line.contains(word))).map(|line| format!("{}: {line}", path.display())));
            }
        }
    }
    let mut found = Vec::new();
    scan(&Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name).join("src"), words, &mut found);
    found
}

#[test]
fn the_kernel_knows_no_verb_file_or_text_format() {
    assert_eq!(lines_with("kernel", &["std::fs", "std::net", "std::env", "Verb", "json", "python"]), Vec::<String>::new());
}

#[test]
fn the_interconnect_has_no_clock_thread_or_file() {
    assert_eq!(
        lines_with("interconnect", &["std::fs", "std::net", "std::env", "Instant::", "SystemTime", "thread::spawn", "thread::sleep"]),
        Vec::<String>::new()
    );
}

#[test]
fn what_asks_changes_nothing() {
    let asks = ["fn is_", "fn has_", "fn can_"];
    let names: Vec<String> = crates().into_keys().map(|name| if name.starts_with("opengpac") { name.replace("opengpac", "block") } else { name }).collect();
    let asking = names.iter().flat_map(|name| lines_with(name, &asks));
    let changing: Vec<String> =
        asking.filter(|line| asks.iter().any(|ask| line.split_once(ask).is_some_and(|(_, rest)| rest.contains("(&mut self")))).collect();
    assert_eq!(changing, Vec::<String>::new(), "a name that begins with is_, has_ or can_ asks: take a verb");
}

#[test]
fn no_two_folders_of_the_supervisor_have_one_file_name() {
    let mut folders_of: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for folder in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).expect("the sources are there").map(|entry| entry.expect("read").path())
    {
        for file in std::fs::read_dir(&folder).into_iter().flatten().map(|entry| entry.expect("read").path()) {
            let text = |path: &Path| path.file_name().expect("it has a name").to_string_lossy().into_owned();
            folders_of.entry(text(&file)).or_default().push(text(&folder));
        }
    }
    folders_of.retain(|name, folders| name != "mod.rs" && folders.len() > 1);
    assert_eq!(folders_of, BTreeMap::new(), "a file is named by what is in it");
}
