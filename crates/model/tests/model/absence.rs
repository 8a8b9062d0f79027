// SPDX-License-Identifier: Apache-2.0
//! Checks that the model has no clock, thread, file, network or `unsafe`.
use std::path::Path;

fn scan(folder: &Path, found: &mut Vec<String>, files: &mut usize) {
    for entry in std::fs::read_dir(folder).expect("the sources are there") {
        let path = entry.expect("a folder can be read").path();
        if path.is_dir() {
            scan(&path, found, files);
            continue;
        }
        *files += 1;
        let text = std::fs::read_to_string(&path).expect("a source is text");
        for word in
            ["std::time", "std::thread", "std::fs", "std::net", "std::process", "std::env", "unsafe {", "unsafe fn", "unsafe impl", "Instant", "SystemTime"]
        {
            if text.contains(word) {
                found.push(format!("{}: {word}", path.display()));
            }
        }
    }
}

#[test]
fn the_model_touches_nothing_outside() {
    let (mut found, mut files) = (Vec::new(), 0);
    scan(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut found, &mut files);
    assert!(files > 20, "only {files} sources were scanned");
    assert_eq!(found, Vec::<String>::new());
}
