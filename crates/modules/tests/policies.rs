// SPDX-License-Identifier: Apache-2.0
//! Checks that a policy's module needs nothing at run time that could allocate, lock or wait: only memory copies and math functions.

mod common;
use common::{examples, options};
use std::path::PathBuf;
use std::process::Command;

/// Functions of the C library that a policy may call.
const ALLOWED: [&str; 13] = ["memcpy", "memmove", "memset", "ceilf", "cosf", "erff", "floorf", "log1pf", "logf", "powf", "sinf", "sqrtf", "exp"];

#[test]
fn a_policy_calls_nothing_that_could_allocate_or_wait() {
    let module = modules::load(&examples().join("policies/reach.onnx"), &options()).expect("the policy of the examples loads");
    let block = module.block("reach").expect("its block has the name of the file");
    assert!(["obs", "actions"].iter().all(|port| block.items.iter().any(|item| item.name == *port)));
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("reach.so");
    std::fs::write(&file, &module.bytes).expect("the scratch folder can be written");
    let told = Command::new("nm").args(["-D", "--undefined-only", "--format=posix"]).arg(&file).output().expect("nm runs");
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    let needed = String::from_utf8_lossy(&told.stdout).into_owned();
    // Names with a leading underscore belong to the compiler: module start, processor detection, stack protection.
    let names = needed.lines().filter_map(|line| line.split([' ', '@']).next()).filter(|name| !name.starts_with('_'));
    let strangers: Vec<&str> = names.filter(|name| !ALLOWED.contains(name)).collect();
    assert_eq!(strangers, Vec::<&str>::new());
}
