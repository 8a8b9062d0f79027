// SPDX-License-Identifier: Apache-2.0
//! Compiles the guard, the one part of the kernel in C: `sigsetjmp` may not be called from Rust.
fn main() {
    println!("cargo::rerun-if-changed=src/guard.c");
    cc::Build::new().file("src/guard.c").flag("-ffp-contract=off").warnings(true).opt_level(2).compile("opengpac_guard");
}
