// SPDX-License-Identifier: Apache-2.0
//! Properties of a shared object, read without loading it.
use object::elf::{
    DT_JMPREL, DT_PLTRELSZ, DT_RELA, DT_RELASZ, Dyn64, EM_386, EM_AARCH64, EM_ARM, EM_PPC, EM_PPC64, EM_RISCV, EM_S390, EM_X86_64, ET_DYN, FileHeader32,
    FileHeader64, PF_W, PF_X, PT_LOAD, ProgramHeader64, Rela64,
};
use object::read::elf::{Dyn as _, FileHeader, ProgramHeader as _, Rela as _};
use object::{Endianness, LittleEndian as Little};

/// Reason why a file cannot be loaded here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ElfError {
    Damaged(String),
    Foreign { have: String, want: String },
}

/// Returns the target whose files this process can load.
pub fn target_here() -> &'static str {
    opengpac::generated::target()
}

/// Checks that the file is a complete shared object for this machine. Returns its parsed form.
pub fn check(bytes: &[u8]) -> Result<Elf<'_>, ElfError> {
    let foreign = |have: &str| Err(ElfError::Foreign { have: have.to_string(), want: target_here().to_string() });
    match bytes {
        [0x7f, b'E', b'L', b'F', ..] => {}
        [b'M', b'Z', ..] => return foreign("a Windows module"),
        [0xcf, 0xfa, 0xed, 0xfe, ..] | [0xca, 0xfe, 0xba, 0xbe, ..] => return foreign("a macOS module"),
        _ => return Err(damaged("it is not a shared object")),
    }
    let (machine, little) = machine::<FileHeader64<Endianness>>(bytes).or_else(|_| machine::<FileHeader32<Endianness>>(bytes))?;
    let have = format!("{machine}-linux");
    if have != target_here() || !little {
        return foreign(&have);
    }
    let file = Elf::read(bytes)?;
    if file.kind != ET_DYN {
        return Err(damaged("it is not a shared object: link it with -shared"));
    }
    file.check_relocations()?;
    Ok(file)
}

/// Returns the architecture of an ELF file, named as in a target triple, and true if the file is little-endian.
fn machine<H: FileHeader<Endian = Endianness>>(bytes: &[u8]) -> Result<(String, bool), ElfError> {
    let header = H::parse(bytes).map_err(|_| damaged("its header is damaged"))?;
    let order = header.endian().map_err(|_| damaged("its header is damaged"))?;
    let bits = if header.is_class_64() { 64 } else { 32 };
    let name = match (header.e_machine(order), bits) {
        (EM_386, _) => "i386".to_string(),
        (EM_PPC, _) => "powerpc".to_string(),
        (EM_PPC64, _) => "powerpc64".to_string(),
        (EM_S390, _) => "s390x".to_string(),
        (EM_ARM, _) => "arm".to_string(),
        (EM_X86_64, 64) => "x86_64".to_string(),
        (EM_AARCH64, _) => "aarch64".to_string(),
        (EM_RISCV, _) => format!("riscv{bits}"),
        (other, _) => format!("machine {other} ({bits} bits)"),
    };
    Ok((name, order == Endianness::Little))
}

/// Parts of a 64-bit, little-endian file that the loader reads; all of them are within the file.
pub struct Elf<'a> {
    pub(crate) bytes: &'a [u8],
    kind: u16,
    segments: &'a [ProgramHeader64<Little>],
    dynamic: &'a [Dyn64<Little>],
}

impl<'a> Elf<'a> {
    /// Parses a file. Fails if a table, or an offset in it, points outside the file.
    fn read(bytes: &'a [u8]) -> Result<Elf<'a>, ElfError> {
        let short = |_| damaged("it is truncated");
        let header = FileHeader64::<Little>::parse(bytes).map_err(short)?;
        let segments = header.program_headers(Little, bytes).map_err(short)?;
        header.section_headers(Little, bytes).map_err(short)?;
        let mut dynamic = None;
        for segment in segments {
            segment.data(Little, bytes).map_err(|()| damaged("it is truncated"))?;
            dynamic = segment.dynamic(Little, bytes).map_err(short)?.or(dynamic);
        }
        let dynamic = dynamic.ok_or_else(|| damaged("it has no dynamic section"))?;
        Ok(Elf { bytes, kind: header.e_type(Little), segments, dynamic })
    }

    /// Returns the entries of the dynamic table: tag and value.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (i64, u64)> {
        self.dynamic.iter().map(|entry| (entry.tag(Little), entry.val(Little))).take_while(|(tag, _)| *tag != 0)
    }

    /// Returns the value of the last entry with this tag, which is the one used by the loader.
    pub(crate) fn entry(&self, wanted: i64) -> Option<u64> {
        self.entries().filter(|(tag, _)| *tag == wanted).last().map(|(_, value)| value)
    }

    /// Returns the loadable segments of the file.
    fn loaded(&self) -> impl Iterator<Item = &'a ProgramHeader64<Little>> {
        self.segments.iter().filter(|segment| segment.p_type(Little) == PT_LOAD)
    }

    /// Returns the loadable segments with this permission.
    fn loaded_with(&self, right: u32) -> impl Iterator<Item = &'a ProgramHeader64<Little>> {
        self.loaded().filter(move |segment| segment.p_flags(Little) & right != 0)
    }

    /// Returns the executable bytes of the file.
    pub(crate) fn executable(&self) -> impl Iterator<Item = &'a [u8]> {
        self.loaded_with(PF_X).filter_map(|segment| segment.data(Little, self.bytes).ok())
    }

    /// Returns the bytes of the file that are loaded at an address, up to the end of their segment.
    pub(crate) fn at(&self, address: u64) -> Option<&'a [u8]> {
        self.loaded().find_map(|segment| {
            let offset = address.checked_sub(segment.p_vaddr(Little))?;
            segment.data(Little, self.bytes).ok()?.get(usize::try_from(offset).ok()?..)
        })
    }

    /// Checks that the loader writes only into the module's own writable memory. A child may survive a wild write, so trying the module
    /// there proves nothing about this process.
    fn check_relocations(&self) -> Result<(), ElfError> {
        let unread = || damaged("its relocations cannot be read");
        for (table, size) in [(DT_RELA, DT_RELASZ), (DT_JMPREL, DT_PLTRELSZ)] {
            let (Some(table), Some(size)) = (self.entry(table), self.entry(size)) else { continue };
            let bytes = usize::try_from(size).ok().and_then(|size| self.at(table)?.get(..size)).ok_or_else(unread)?;
            let relocations: &[Rela64<Little>] = object::slice_from_all_bytes(bytes).map_err(|_| unread())?;
            if relocations.iter().any(|relocation| !self.is_written(relocation.r_offset(Little))) {
                return Err(damaged("a relocation points outside it"));
            }
        }
        Ok(())
    }

    /// Returns true if a word at this address is in writable memory of the module.
    fn is_written(&self, address: u64) -> bool {
        self.loaded_with(PF_W).any(|segment| {
            let start = segment.p_vaddr(Little);
            address >= start && address.checked_add(8).is_some_and(|end| end - start <= segment.p_memsz(Little))
        })
    }
}

fn damaged(what: &str) -> ElfError {
    ElfError::Damaged(what.to_string())
}
