// SPDX-License-Identifier: Apache-2.0
//! Checks that the low-pass filter in C and in Rust, as printed, gives the same bits.

mod common;
use common::{examples, options};
use modules::{LoadedModule, load};
use opengpac::trial::{Fault, Trial};
use proptest::prelude::*;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// Builds the module of `examples/rust-module` as its author would.
fn rust_module() -> PathBuf {
    let target = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("rust-module");
    let manifest = examples().join("rust-module/Cargo.toml");
    let output = Command::new(env!("CARGO")).args(["build", "--release", "--manifest-path"]).arg(&manifest).arg("--target-dir").arg(&target).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    target.join("release/librust_module.so")
}

fn both() -> &'static [LoadedModule; 2] {
    static BOTH: OnceLock<[LoadedModule; 2]> = OnceLock::new();
    BOTH.get_or_init(|| [load(&examples().join("blocks/lowpass.c"), &options()).unwrap(), load(&rust_module(), &options()).unwrap()])
}

#[test]
fn the_interfaces_are_equal() {
    let [c, rust] = both().each_ref().map(|module| module.block("lowpass").unwrap());
    assert_eq!((&c.name, &c.doc), (&rust.name, &rust.doc));
    for (c, rust) in c.items.iter().zip(&rust.items) {
        assert_eq!(
            (&c.name, c.kind, c.mode, &c.type_text, &c.unit, &c.doc, &c.initial),
            (&rust.name, rust.kind, rust.mode, &rust.type_text, &rust.unit, &rust.doc, &rust.initial)
        );
    }
    assert_eq!((both()[0].name.as_str(), both()[1].name.as_str()), ("lowpass", "rust_module"));
}

#[test]
fn modules_have_bank_entries() {
    let blocks = || both().iter().flat_map(|module| &module.blocks);
    assert_eq!(blocks().filter(|block| opengpac::bank::of(block.descriptor.run).is_some()).count(), blocks().count());
    assert!(blocks().count() >= 2);
}

proptest! {
    #[test]
    fn the_bits_are_equal(alpha in any::<f64>(), inputs in prop::collection::vec(any::<f64>(), 1..50)) {
        let mut trials = both().each_ref().map(|module| Trial::of(module.block("lowpass").unwrap().clone()));
        for u in inputs {
            let [c, rust] = trials.each_mut().map(|trial| {
                trial.set_number("alpha", alpha).unwrap();
                trial.set_number("u", u).unwrap();
                let result = trial.run();
                (result, trial.number("y").unwrap().to_bits(), trial.next_number())
            });
            prop_assert_eq!(c, rust);
        }
    }

    #[test]
    fn no_output_is_ever_nonfinite(inputs in prop::collection::vec(any::<u64>().prop_map(f64::from_bits), 1..50)) {
        for module in both() {
            let mut trial = Trial::of(module.block("lowpass").unwrap().clone());
            for u in &inputs {
                let before = trial.number("y").unwrap();
                trial.set_number("u", *u).unwrap();
                let expected = before + 0.1 * (u - before);
                match trial.run() {
                    Ok(()) => prop_assert_eq!(trial.number("y").unwrap().to_bits(), expected.to_bits()),
                    Err(fault) => {
                        prop_assert_eq!(fault, Fault::NonFinite { item: "y".into() });
                        prop_assert!(!expected.is_finite());
                        prop_assert_eq!(trial.number("y").unwrap().to_bits(), before.to_bits());
                    }
                }
            }
        }
    }
}

#[test]
fn a_panic_in_a_module_is_a_fault() {
    let mut trial = Trial::of(both()[1].block("divide").unwrap().clone());
    trial.set_number("a", 6.0).unwrap();
    assert_eq!(trial.run(), Err(Fault::Panicked));
    trial.set_number("b", 2.0).unwrap();
    trial.run().unwrap();
    assert_eq!(trial.number("y").unwrap(), 3.0);
}
