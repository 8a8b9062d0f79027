// SPDX-License-Identifier: Apache-2.0
//! Whether a module can change floating-point control words: it imports a function that does, needs a library that nobody has looked at, or
//! has an instruction for it. What is suspected wrongly runs a little slower; what is not found here is found at the end of a firing.
use super::elf::{EXECUTABLE, LOAD_SEGMENT, dynamic_entries, segments};

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

/// True where the shared object, which `elf::check` has found in order, is one to be watched.
pub fn can_change(bytes: &[u8]) -> bool {
    names_a_function(bytes) || needs_another_library(bytes).unwrap_or(true) || executable(bytes).any(changes)
}

/// Names of imports lie in the file as they are, each between two zeros.
fn names_a_function(bytes: &[u8]) -> bool {
    bytes.split(|&byte| byte == 0).any(|text| text.len() < 16 && FUNCTIONS.iter().any(|name| name.as_bytes() == text))
}

/// None where the tables lead out of the file.
fn needs_another_library(bytes: &[u8]) -> Option<bool> {
    const NEEDED: u64 = 1;
    const STRINGS: u64 = 5;
    let entries: Vec<(u64, u64)> = dynamic_entries(bytes)?;
    let (_, strings) = *entries.iter().find(|(tag, _)| *tag == STRINGS)?;
    let segment = segments(bytes).find(|segment| segment.kind == LOAD_SEGMENT && segment.holds(strings, 1))?;
    for (_, name) in entries.iter().filter(|(tag, _)| *tag == NEEDED) {
        let at = usize::try_from(segment.offset.checked_add(strings - segment.address)?.checked_add(*name)?).ok()?;
        let text = bytes.get(at..)?.split(|&byte| byte == 0).next()?;
        if !LIBRARIES.iter().any(|known| text.starts_with(known.as_bytes())) {
            return Some(true);
        }
    }
    Some(false)
}

/// The bytes that can be executed.
fn executable(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let code = segments(bytes).filter(|segment| segment.kind == LOAD_SEGMENT && segment.flags & EXECUTABLE != 0);
    code.filter_map(|segment| bytes.get(segment.offset as usize..(segment.offset + segment.bytes_in_file) as usize))
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
