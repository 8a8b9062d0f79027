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

pub(crate) const LOAD_SEGMENT: u32 = 1;
const DYNAMIC_SEGMENT: u32 = 2;
/// Bits of a segment's flags.
pub(crate) const EXECUTABLE: u32 = 1;
const WRITABLE: u32 = 2;

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
    let mut loaded = Vec::new();
    let mut dynamic = None;
    for index in 0..segment_count {
        let segment = Segment::read(bytes, (segments + index * segment_size) as usize).ok_or_else(short)?;
        if !inside(segment.offset, segment.bytes_in_file) {
            return Err(short());
        }
        match segment.kind {
            LOAD_SEGMENT => loaded.push(segment),
            DYNAMIC_SEGMENT => dynamic = Some(segment),
            _ => {}
        }
    }
    match dynamic {
        Some(dynamic) => check_relocations(bytes, &loaded, &dynamic).unwrap_or_else(|| Err(damaged("its relocations cannot be read"))),
        None => Err(damaged("it has no table for the loader")),
    }
}

/// One entry of the program header.
pub(crate) struct Segment {
    pub(crate) kind: u32,
    pub(crate) flags: u32,
    pub(crate) offset: u64,
    pub(crate) address: u64,
    pub(crate) bytes_in_file: u64,
    bytes: u64,
}

impl Segment {
    fn read(bytes: &[u8], at: usize) -> Option<Segment> {
        let kind_and_flags = word(bytes, at)?;
        Some(Segment {
            kind: kind_and_flags as u32,
            flags: (kind_and_flags >> 32) as u32,
            offset: word(bytes, at + 8)?,
            address: word(bytes, at + 16)?,
            bytes_in_file: word(bytes, at + 32)?,
            bytes: word(bytes, at + 40)?,
        })
    }
    pub(crate) fn holds(&self, address: u64, bytes: u64) -> bool {
        address >= self.address && address.checked_add(bytes).is_some_and(|end| end - self.address <= self.bytes)
    }
}

/// The program header of a file that has been checked.
pub(crate) fn segments(bytes: &[u8]) -> impl Iterator<Item = Segment> {
    let (start, count) = (word(bytes, 0x20).unwrap_or(0), bytes.get(0x38..0x3a).map_or(0, |two| u64::from(two[0]) | u64::from(two[1]) << 8));
    (0..count).filter_map(move |index| Segment::read(bytes, (start + index * 56) as usize))
}

/// Tags and values of the table for the loader. `None`: it leads out of the file.
pub(crate) fn dynamic_entries(bytes: &[u8]) -> Option<Vec<(u64, u64)>> {
    let dynamic = segments(bytes).find(|segment| segment.kind == DYNAMIC_SEGMENT)?;
    entries(bytes, &dynamic)
}

fn entries(bytes: &[u8], dynamic: &Segment) -> Option<Vec<(u64, u64)>> {
    let mut entries = Vec::new();
    for at in (0..dynamic.bytes_in_file).step_by(16) {
        match word(bytes, (dynamic.offset + at) as usize)? {
            0 => break,
            tag => entries.push((tag, word(bytes, (dynamic.offset + at + 8) as usize)?)),
        }
    }
    Some(entries)
}

/// That the loader writes into the module's own writable memory only: a child that is killed by a wild write is one thing, one
/// that happens to survive it says nothing about this process. `None`: the tables lead out of the file.
fn check_relocations(bytes: &[u8], loaded: &[Segment], dynamic: &Segment) -> Option<Result<(), ElfError>> {
    const ENTRY_BYTES: u64 = 24;
    let tags: std::collections::BTreeMap<u64, u64> = entries(bytes, dynamic)?.into_iter().collect();
    for (table, size) in [(7, 8), (23, 2)] {
        let (Some(table), Some(size)) = (tags.get(&table), tags.get(&size)) else { continue };
        let segment = loaded.iter().find(|segment| segment.holds(*table, *size))?;
        let start = segment.offset.checked_add(table - segment.address)?;
        for at in (0..*size).step_by(ENTRY_BYTES as usize) {
            let target = word(bytes, usize::try_from(start.checked_add(at)?).ok()?)?;
            if !loaded.iter().any(|segment| segment.flags & WRITABLE != 0 && segment.holds(target, 8)) {
                return Some(Err(damaged("a relocation points outside of it")));
            }
        }
    }
    Some(Ok(()))
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
