// SPDX-License-Identifier: Apache-2.0
//! One program for all targets: `FUZZ_TARGET` names the one that libFuzzer drives.
#![no_main]
use std::sync::OnceLock;

static TARGET: OnceLock<fuzz_targets::Target> = OnceLock::new();

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let target = TARGET.get_or_init(|| {
        let name = std::env::var("FUZZ_TARGET").unwrap_or_default();
        fuzz_targets::TARGETS.iter().find(|(known, _)| *known == name).expect("FUZZ_TARGET is one of fuzz_targets::TARGETS").1
    });
    target(bytes);
});
