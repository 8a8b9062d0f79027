// SPDX-License-Identifier: Apache-2.0
//! Compiles the containment, the only part of the kernel in C: `sigsetjmp` must not be called from Rust. Exceptions are enabled, so that
//! it notices when a thread is unwound.
fn main() {
    let sources = ["src/containment.c", "src/foreign.c"];
    sources.iter().chain(&["src/foreign.h"]).for_each(|source| println!("cargo::rerun-if-changed={source}"));
    cc::Build::new().files(sources).flag("-ffp-contract=off").flag("-fexceptions").warnings(true).opt_level(2).compile("opengpac_containment");
}
