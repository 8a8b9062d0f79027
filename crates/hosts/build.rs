// SPDX-License-Identifier: Apache-2.0
//! Passes the build target to the crate: hosts exchange it.
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=OPENGPAC_TARGET={}", std::env::var("TARGET").expect("cargo sets the target"));
}
