// SPDX-License-Identifier: Apache-2.0
//! Tells the crate what it is built for: hosts say it to each other.
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=OPENGPAC_TARGET={}", std::env::var("TARGET").expect("cargo sets the target"));
}
