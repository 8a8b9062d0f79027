// SPDX-License-Identifier: Apache-2.0
//! What the header of a shared object says, read without loading it.

/// Why a file cannot be loaded here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ElfError {
    Damaged(String),
    Foreign { have: String, want: String },
}

/// What this process can load.
pub fn target_here() -> &'static str {
    opengpac::generated::target()
}

const LOAD_SEGMENT: u32 = 1;

/// Checks that the file is a whole shared object for this machine.
pub fn check(bytes: &[u8]) -> Result<(), ElfError> {
    let foreign = |have: &str| Err(ElfError::Foreign { have: have.to_string(), want: target_here().to_string() });
    match bytes {
        [0x7f, b'E', b'L', b'F', ..] => {}
        [b'M', b'Z', ..] => return foreign("a Windows module"),
        [0xcf, 0xfa, 0xed, 0xfe, ..] | [0xca, 0xfe, 0xba, 0xbe, ..] => return foreign("a macOS module"),
        _ => return Err(damaged("it is no shared object")),
    }
    let (Some(class), Some(order)) = (bytes.get(4), bytes.get(5)) else { return Err(damaged("it ends within its header")) };
    let bits = match class {
        1 => 32,
        2 => 64,
        _ => return Err(damaged("its header is damaged")),
    };
    let little = match order {
        1 => true,
        2 => false,
        _ => return Err(damaged("its header is damaged")),
    };
    let half = |offset: usize| -> Option<u16> {
        let pair: [u8; 2] = bytes.get(offset..offset + 2)?.try_into().ok()?;
        Some(if little { u16::from_le_bytes(pair) } else { u16::from_be_bytes(pair) })
    };
    let (Some(kind), Some(machine)) = (half(16), half(18)) else { return Err(damaged("it ends within its header")) };
    let have = format!("{}-linux", machine_name(machine, bits));
    if have != target_here() || !little {
        return foreign(&have);
    }
    if kind != 3 {
        return Err(damaged("it is no shared object: link it with -shared"));
    }
    check_extent(bytes)
}

/// That what the tables speak of lies inside the file. 64 bits, little-endian.
fn check_extent(bytes: &[u8]) -> Result<(), ElfError> {
    let short = || damaged("it is truncated");
    let (segments, sections) = (word(bytes, 0x20).ok_or_else(short)?, word(bytes, 0x28).ok_or_else(short)?);
    let size = |offset: usize| bytes.get(offset..offset + 2).and_then(|b| b.try_into().ok()).map(u16::from_le_bytes).map(u64::from).ok_or_else(short);
    let (segment_size, segment_count) = (size(0x36)?, size(0x38)?);
    let (section_size, section_count) = (size(0x3a)?, size(0x3c)?);
    let length = bytes.len() as u64;
    let inside = |start: u64, bytes: u64| start.checked_add(bytes).is_some_and(|end| end <= length);
    if segment_size != 56 || !inside(segments, segment_size * segment_count) || !inside(sections, section_size * section_count) {
        return Err(short());
    }
    for index in 0..segment_count {
        let start = (segments + index * segment_size) as usize;
        let kind = bytes.get(start..start + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes).ok_or_else(short)?;
        if kind == LOAD_SEGMENT {
            let (offset, in_file) = (word(bytes, start + 8).ok_or_else(short)?, word(bytes, start + 32).ok_or_else(short)?);
            if !inside(offset, in_file) {
                return Err(short());
            }
        }
    }
    Ok(())
}

fn word(bytes: &[u8], offset: usize) -> Option<u64> {
    bytes.get(offset..offset.checked_add(8)?)?.try_into().ok().map(u64::from_le_bytes)
}

fn damaged(what: &str) -> ElfError {
    ElfError::Damaged(what.to_string())
}

fn machine_name(machine: u16, bits: u32) -> String {
    match (machine, bits) {
        (3, _) => "i386".to_string(),
        (20, _) => "powerpc".to_string(),
        (21, _) => "powerpc64".to_string(),
        (22, _) => "s390x".to_string(),
        (40, _) => "arm".to_string(),
        (62, 64) => "x86_64".to_string(),
        (183, _) => "aarch64".to_string(),
        (243, _) => format!("riscv{bits}"),
        (other, _) => format!("machine {other} ({bits} bits)"),
    }
}
