// SPDX-License-Identifier: Apache-2.0
//! Test whether a module can change floating-point control words: it imports a function that does, needs an unknown library, or has an
//! instruction for it. What is suspected wrongly runs a little slower; what is not found here is found at the end of a firing.
use super::elf::Elf;
use object::elf::{DT_NEEDED, DT_STRTAB};

/// Functions of the C library that change control words, or may.
const FUNCTIONS: [&str; 14] = [
    "fesetround",
    "fesetenv",
    "feupdateenv",
    "feholdexcept",
    "feenableexcept",
    "fedisableexcept",
    "fesetmode",
    "__setfpucw",
    "setcontext",
    "swapcontext",
    "dlopen",
    "dlmopen",
    "dlsym",
    "dlvsym",
];

/// Libraries that change them only for as long as a call takes, but for the functions above.
const LIBRARIES: [&str; 9] = ["libc.so", "libm.so", "libgcc_s.so", "libstdc++.so", "libpthread.so", "libdl.so", "librt.so", "ld-linux-", "libatomic.so"];

/// True where the shared object is one to be watched.
pub(crate) fn can_change(file: &Elf<'_>) -> bool {
    names_a_function(file.bytes) || needs_another_library(file).unwrap_or(true) || file.executable().any(changes)
}

/// Names of imports lie in the file as they are, each between two zeros.
fn names_a_function(bytes: &[u8]) -> bool {
    bytes.split(|&byte| byte == 0).any(|text| text.len() < 16 && FUNCTIONS.iter().any(|name| name.as_bytes() == text))
}

/// None where the tables lead out of the file.
fn needs_another_library(file: &Elf<'_>) -> Option<bool> {
    let strings = file.at(file.entry(DT_STRTAB)?)?;
    for (_, name) in file.entries().filter(|(tag, _)| *tag == DT_NEEDED) {
        let text = strings.get(usize::try_from(name).ok()?..)?.split(|&byte| byte == 0).next()?;
        if !LIBRARIES.iter().any(|known| text.starts_with(known.as_bytes())) {
            return Some(true);
        }
    }
    Some(false)
}

/// True where one of the instructions changes control words, or leaves registers of MMX behind.
#[cfg(target_arch = "x86_64")]
fn changes(code: &[u8]) -> bool {
    let mut at = 0;
    while at < code.len() {
        let instruction = super::x86::read(&code[at..]);
        if instruction.changes_floats {
            return true;
        }
        at += instruction.len;
    }
    false
}

/// `msr fpcr, x`.
#[cfg(target_arch = "aarch64")]
fn changes(code: &[u8]) -> bool {
    code.chunks_exact(4).any(|four| u32::from_le_bytes([four[0], four[1], four[2], four[3]]) & !0x1f == 0xd51b_4400)
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn changes(_: &[u8]) -> bool {
    false
}
