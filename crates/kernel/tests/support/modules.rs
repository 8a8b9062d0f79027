// SPDX-License-Identifier: Apache-2.0
//! Blocks in C, compiled and loaded by hand.
use opengpac::abi::{Descriptor, Module, Run};
use opengpac::bank::Bank;
use std::ffi::CString;
use std::process::Command;

/// Options with which user modules are built.
#[allow(dead_code, reason = "each test file uses its part")]
pub const AS_A_USER: [&str; 3] = ["-std=c11", "-O2", "-ffp-contract=off"];

/// Returns the blocks of `tests/blocks/NAME.c`, compiled with these options.
#[allow(dead_code, reason = "each test file uses its part")]
pub fn blocks_of(name: &str, options: &[&str]) -> Vec<&'static Descriptor> {
    with_banks_of(name, options).into_iter().map(|(block, _)| block).collect()
}

/// Returns the same, each with its bank entry in the module.
pub fn with_banks_of(name: &str, options: &[&str]) -> Vec<(&'static Descriptor, Option<Bank>)> {
    let root = env!("CARGO_MANIFEST_DIR");
    let object = std::env::temp_dir().join(format!("opengpac-{name}-{}.so", std::process::id()));
    let (include, source) = (format!("-I{root}/../block/include"), format!("{root}/tests/blocks/{name}.c"));
    let done = Command::new("cc").args(options).args(["-shared", "-fPIC", &include, &source, "-o"]).arg(&object).status().unwrap();
    assert!(done.success());
    let path = CString::new(object.to_str().unwrap()).unwrap();
    unsafe {
        let library = libc::dlopen(path.as_ptr(), libc::RTLD_NOW);
        std::fs::remove_file(&object).unwrap();
        assert!(!library.is_null());
        let entry: extern "C" fn() -> *const Module = std::mem::transmute(libc::dlsym(library, c"opengpac_module".as_ptr()));
        let bank: unsafe extern "C" fn(Run) -> Option<Bank> = std::mem::transmute(libc::dlsym(library, c"opengpac_bank_1".as_ptr()));
        let module = &*entry();
        std::slice::from_raw_parts(module.blocks, module.block_count as usize).iter().map(|block| (&**block, bank((**block).run))).collect()
    }
}
