// SPDX-License-Identifier: Apache-2.0
//! Test whether a module can change floating-point control words: it imports a function that changes them, needs an unknown library, or
//! contains an instruction that changes them. In case of a false positive, the module runs a little slower; a false negative is found at
//! the end of a firing.
use super::elf::Elf;
use object::elf::{DT_NEEDED, DT_STRTAB};

/// Functions of the C library that change control words, or may do so.
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

/// Libraries that change the words only for the duration of a call, except through the functions above.
const LIBRARIES: [&str; 9] = ["libc.so", "libm.so", "libgcc_s.so", "libstdc++.so", "libpthread.so", "libdl.so", "librt.so", "ld-linux-", "libatomic.so"];

/// Returns true if the shared object must be watched.
pub(crate) fn can_change(file: &Elf<'_>) -> bool {
    names_a_function(file.bytes) || needs_another_library(file).unwrap_or(true) || file.executable().any(changes)
}

/// Returns true if the file imports one of the functions; names of imports are stored verbatim, each between two NUL bytes.
fn names_a_function(bytes: &[u8]) -> bool {
    bytes.split(|&byte| byte == 0).any(|text| text.len() < 16 && FUNCTIONS.iter().any(|name| name.as_bytes() == text))
}

/// Returns true if the file needs a library that is not listed above; `None` if the tables point outside the file.
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

/// Returns true if an instruction changes control words, or leaves MMX registers in use.
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

/// Returns true if the code contains `msr fpcr, x`.
#[cfg(target_arch = "aarch64")]
fn changes(code: &[u8]) -> bool {
    code.chunks_exact(4).any(|four| u32::from_le_bytes([four[0], four[1], four[2], four[3]]) & !0x1f == 0xd51b_4400)
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn changes(_: &[u8]) -> bool {
    false
}
