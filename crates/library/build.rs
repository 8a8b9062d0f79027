// SPDX-License-Identifier: Apache-2.0
//! Registers every file of `src/blocks`: presence in the folder is all that a block needs.
use std::path::Path;
use std::{env, fs};

fn main() {
    let folder = Path::new(&env::var("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("src/blocks");
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut names: Vec<String> = fs::read_dir(&folder)
        .expect("src/blocks is part of this crate")
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.strip_suffix(".rs").map(str::to_string))
        .collect();
    names.sort();
    let mut modules = String::new();
    for name in &names {
        let path = folder.join(format!("{name}.rs"));
        modules += &format!("#[path = {:?}]\npub mod {name};\n", path.display().to_string());
    }
    let list = |what: &str| names.iter().map(|name| format!("        <{name}::{} as opengpac::FunctionBlock>::{what}(),\n", camel(name))).collect::<String>();
    let text = format!(
        "{modules}\n/// The descriptors of all blocks of the library, by name.\npub fn blocks() -> Vec<&'static opengpac::abi::Descriptor> {{\n    vec![\n{}    ]\n}}\n\n\
         /// The struct types of their items.\npub fn types() -> Vec<&'static opengpac::abi::TypeDescriptor> {{\n    vec![\n{}    ].into_iter().flatten().collect()\n}}\n",
        list("descriptor"),
        list("types"),
    );
    let out = env::var("OUT_DIR").expect("cargo sets it");
    fs::write(Path::new(&out).join("blocks.rs"), text).expect("the output folder can be written");
}

/// `signal_generator` is the block `SignalGenerator`.
fn camel(name: &str) -> String {
    name.split('_').map(|word| word[..1].to_uppercase() + &word[1..]).collect()
}
