// SPDX-License-Identifier: Apache-2.0
//! Loads shared objects.
use super::elf::{self, ElfError};
use super::floats;
use super::probe::Finding;
use super::seal::{self, Seal};
use crate::backend::{LoadOptions, LoadedModule};
use crate::error::LoadError;
use crate::folder::Folder;
use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use opengpac::abi::{Descriptor, MODULE_SYMBOL, Module, Run, mark};
use opengpac::bank::{self, BANK_SYMBOL, Bank};
use opengpac::floats::Words;
use opengpac::read::{ModuleFace, Refusal};
use std::path::Path;

/// Tries the bytes of a shared object in a child process, unless they are known to be sound, then loads them here.
pub(crate) fn load_bytes(path: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
    let here = || path.to_path_buf();
    if seal::check(&bytes) == Seal::Broken {
        return Err(LoadError::Damaged { path: here(), what: "it differs from the file that was built".to_string() });
    }
    let file = elf::check(&bytes).map_err(|error| match error {
        ElfError::Damaged(what) => LoadError::Damaged { path: here(), what },
        ElfError::Foreign { have, want } => LoadError::ForeignTarget { path: here(), have, want },
    })?;
    let folder = private_folder()?;
    let name = module_name(path);
    let copy = folder.path().join(format!("{name}.so"));
    std::fs::write(&copy, &bytes).map_err(|error| LoadError::Unreadable { path: copy.clone(), what: error.to_string() })?;
    if !options.probe.knows(&bytes) {
        judge(path, options.probe.run(&copy), options)?;
    }
    let words = Words::present();
    let opened = open(path, &copy);
    let changed_floats = Words::present() != words;
    if changed_floats {
        words.set();
    }
    let mut face = opened?;
    options.probe.remember(&bytes);
    let marks = if floats::can_change(&file) { mark::LOADED | mark::FLOATS } else { mark::LOADED };
    face.blocks.iter_mut().for_each(|block| block.descriptor = marked(block.descriptor, marks));
    let ModuleFace { blocks, types, target, compiler } = face;
    Ok(LoadedModule { name, path: here(), blocks, types, target, compiler, changed_floats, bytes: bytes.into() })
}

/// Returns a permanent copy of a descriptor with the loader's flags.
fn marked(descriptor: &'static Descriptor, marks: u32) -> &'static Descriptor {
    Box::leak(Box::new(Descriptor { reserved: marks, ..*descriptor }))
}

fn private_folder() -> Result<Folder, LoadError> {
    Folder::new().map_err(|error| LoadError::Unreadable { path: std::env::temp_dir(), what: error.to_string() })
}

fn judge(path: &Path, finding: Finding, options: &LoadOptions) -> Result<(), LoadError> {
    let path = path.to_path_buf();
    Err(match finding {
        Finding::Sound => return Ok(()),
        Finding::OtherAbi(module) => LoadError::AbiVersion { path, module, here: opengpac::abi::ABI },
        Finding::NoSymbol => LoadError::NotAModule { path },
        Finding::Refused(what) => LoadError::Damaged { path, what },
        Finding::Crashed(signal) => LoadError::Crashed { path, signal },
        Finding::TimedOut => LoadError::TimedOut { path, seconds: options.probe.limit.as_secs() },
        Finding::Unusable(what) => LoadError::NoProbe { what },
    })
}

/// Loads the copy that a child process has loaded without crashing.
fn open(path: &Path, copy: &Path) -> Result<ModuleFace, LoadError> {
    let here = || path.to_path_buf();
    // SAFETY: a child process has loaded these bytes, run their initialisation and walked their tables.
    let library = unsafe { Library::open(Some(copy), RTLD_NOW | RTLD_LOCAL) }.map_err(|error| LoadError::Damaged { path: here(), what: error.to_string() })?;
    // SAFETY: the symbol has this type in every version of the ABI.
    let entry = unsafe { library.get::<unsafe extern "C" fn() -> *const Module>(MODULE_SYMBOL.as_bytes()) }.map(|symbol| *symbol);
    let Ok(entry) = entry else { return Err(LoadError::NotAModule { path: here() }) };
    // SAFETY: the symbol's name has the version of its type; a module need not have it.
    let bank = unsafe { library.get::<unsafe extern "C" fn(Run) -> Option<Bank>>(BANK_SYMBOL.as_bytes()) }.map(|symbol| *symbol).ok();
    // Descriptors are `'static` from here, because the module is never unloaded.
    core::mem::forget(library);
    // SAFETY: the entry of a module that stays.
    let face = unsafe { ModuleFace::read(entry()) };
    if let (Ok(face), Some(bank)) = (&face, bank) {
        // SAFETY: as for `entry`; it is asked for blocks of its own.
        let banks = face.blocks.iter().filter_map(|block| Some((block.descriptor.run, unsafe { bank(block.descriptor.run) }?)));
        banks.for_each(|(run, bank)| bank::add(run, bank));
    }
    face.map_err(|refusal| match refusal {
        Refusal::AbiVersion { module, here: version } => LoadError::AbiVersion { path: here(), module, here: version },
        Refusal::NoBlocks => LoadError::NoBlocks { path: here() },
        Refusal::Invalid { block, item, what } => LoadError::Invalid { path: here(), block, item, what },
    })
}

fn module_name(path: &Path) -> String {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    match stem.strip_prefix("lib") {
        Some(rest) if !rest.is_empty() && path.extension().is_some_and(|ending| ending == "so") => rest.to_string(),
        _ => stem,
    }
}
