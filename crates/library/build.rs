// SPDX-License-Identifier: Apache-2.0
//! Registers every file of `src/blocks` and its folders: a block needs no other registration, and the folder is its category.
use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() {
    let folder = Path::new(&env::var("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("src/blocks");
    let mut files = files_in(&folder);
    files.sort_by_key(|file| name(file));
    let mut modules = String::new();
    for file in &files {
        modules += &format!("#[path = {:?}]\npub mod {};\n", file.display().to_string(), name(file));
    }
    let list = |what: &str| {
        files.iter().map(|file| format!("        <{}::{} as opengpac::FunctionBlock>::{what}(),\n", name(file), camel(&name(file)))).collect::<String>()
    };
    let text = format!(
        "{modules}\n/// The descriptors of all blocks of the library, by name.\npub fn blocks() -> Vec<&'static opengpac::abi::Descriptor> {{\n    vec![\n{}    ]\n}}\n\n\
         /// The struct types of their items.\npub fn types() -> Vec<&'static opengpac::abi::TypeDescriptor> {{\n    vec![\n{}    ].into_iter().flatten().collect()\n}}\n",
        list("descriptor"),
        list("types"),
    );
    let out = env::var("OUT_DIR").expect("cargo sets it");
    fs::write(Path::new(&out).join("blocks.rs"), text).expect("the output folder can be written");
}

/// Returns the Rust files of a folder and its subfolders.
fn files_in(folder: &Path) -> Vec<PathBuf> {
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("src/blocks is part of this crate").flatten() {
        let path = entry.path();
        if path.is_dir() {
            files.extend(files_in(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

fn name(file: &Path) -> String {
    file.file_stem().expect("a file has a name").to_string_lossy().into_owned()
}

/// Converts to camel case: `signal_generator` is the block `SignalGenerator`.
fn camel(name: &str) -> String {
    name.split('_').map(|word| word[..1].to_uppercase() + &word[1..]).collect()
}
