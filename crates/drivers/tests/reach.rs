// SPDX-License-Identifier: Apache-2.0
//! Checks that every option that is a file or code is declared as one.
use device::{OptionWord, Reach, ServiceWord};
use serde_json::json;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Returns the names of options and arguments that reach beyond their device.
fn reaching() -> BTreeSet<&'static str> {
    let of_word = |word: &OptionWord| -> Vec<&'static str> {
        match word.reach {
            Reach::Device => Vec::new(),
            Reach::Entries(words) => words.iter().map(|(name, _)| *name).collect(),
            _ => vec![word.name],
        }
    };
    let declared = drivers::declarations();
    let arguments = declared.iter().flat_map(|of| of.services).flat_map(|service: &ServiceWord| service.arguments.iter().flat_map(of_word));
    let options = declared.iter().flat_map(|of| device::options_of(of)).flat_map(of_word);
    arguments.chain(options).collect()
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of sources").map(|entry| entry.expect("an entry").path()) {
        if entry.is_dir() {
            sources(&entry, found);
        } else if entry.extension().is_some_and(|ending| ending == "rs") {
            found.push(entry);
        }
    }
}

#[test]
fn an_option_whose_words_speak_of_a_file_or_a_program_reaches_beyond_its_device() {
    let speaks = |doc: &str| ["file", "module that", "library", "command line", "modules"].iter().any(|word| doc.contains(word));
    // None of these names a file of this machine.
    let others = [("canopen", "axes"), ("canopen", "modules"), ("canopen", "object")];
    let mut seen = 0;
    for of in drivers::declarations() {
        let arguments = of.services.iter().flat_map(|service| service.arguments);
        for word in device::options_of(of).into_iter().chain(arguments).filter(|word| speaks(word.doc)) {
            seen += 1;
            let is_declared = word.reach != Reach::Device || others.contains(&(of.kind, word.name));
            assert!(is_declared, "driver '{}': '{}' ({}) declares nothing of what it reaches", of.kind, word.name, word.doc);
        }
    }
    assert!(seen > 5, "the rule looks at something");
}

#[test]
fn a_path_within_options_is_declared_by_its_name() {
    let reaching = reaching();
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the folder of crates");
    let mut found = Vec::new();
    for name in ["drivers", "canopen", "ethercat", "cia402"] {
        sources(&crates.join(name).join("src"), &mut found);
    }
    let mut seen = 0;
    for file in found {
        let text = fs::read_to_string(&file).expect("a source");
        if !text.contains("Deserialize") {
            continue;
        }
        for line in text.lines().map(|line| line.trim().trim_start_matches("pub ").trim_start_matches("pub(super) ").trim_end_matches(',')) {
            let Some((name, kind)) = line.split_once(": ") else { continue };
            if matches!(kind, "PathBuf" | "Option<PathBuf>" | "Vec<PathBuf>" | "Option<Vec<PathBuf>>") {
                seen += 1;
                assert!(reaching.contains(name), "{}: '{name}' is a path, and no option of that name is declared to reach a file", file.display());
            }
        }
    }
    assert!(seen >= 3, "the rule looks at something: {seen}");
}

#[test]
fn arguments_of_services_are_visited_within_other_drivers_too() {
    let visited = |kind: &str, options: serde_json::Value| {
        let mut seen = Vec::new();
        let done: Result<(), ()> = drivers::each_reach_of_service((kind, &options), "save_calibration", &mut json!({ "path": "/etc/x" }), &mut |reached| {
            seen.push((reached.option.to_owned(), reached.reach));
            Ok(())
        });
        assert_eq!(done, Ok(()));
        seen
    };
    let path = [("path".to_owned(), Reach::File)];
    assert_eq!(visited("feetech", json!({})), path);
    assert_eq!(visited("plant_process", json!({ "driver": { "kind": "dynamixel" } })), path);
    assert_eq!(visited("loopback", json!({})), []);
}
