// SPDX-License-Identifier: Apache-2.0
//! Loading a code module.

use crate::build::{BuildError, BuildOptions, build, is_source};
use crate::elf::{self, ElfError};
use crate::folder::Folder;
use crate::probe::{Finding, Probe};
use crate::seal::{self, Seal};
use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use opengpac::abi::{MODULE_SYMBOL, Module};
use opengpac::read::{BlockFace, ModuleFace, Refusal, TypeFace};
use std::path::{Path, PathBuf};

/// Why a module was refused. Nothing of it stays in the process.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    #[error("there is no file '{}'", path.display())]
    NotFound { path: PathBuf },
    #[error("'{}' cannot be read: {what}", path.display())]
    Unreadable { path: PathBuf, what: String },
    #[error("module '{}' is damaged: {what}; build it again", path.display())]
    Damaged { path: PathBuf, what: String },
    #[error("module '{}' is for {have}, this system is {want}: build it for this system", path.display())]
    ForeignTarget { path: PathBuf, have: String, want: String },
    #[error("'{}' is a shared object but no code module: it has no function opengpac_module; include opengpac.h and declare a FUNCTION_BLOCK, or use opengpac::module! in Rust", path.display())]
    NotAModule { path: PathBuf },
    #[error("module '{}' is of ABI version {module}, this system of {here}: build it again with this system's opengpac.h", path.display())]
    AbiVersion { path: PathBuf, module: u32, here: u32 },
    #[error("module '{}' has no function block: declare one with FUNCTION_BLOCK", path.display())]
    NoBlocks { path: PathBuf },
    #[error("module '{}' is refused: {}{what}", path.display(), subject(block, item))]
    Invalid { path: PathBuf, block: String, item: String, what: String },
    #[error("module '{}' killed the process that tried it with signal {signal}: it is damaged, or its initialisation faults; build it again", path.display())]
    Crashed { path: PathBuf, signal: i32 },
    #[error("module '{}' did not load within {seconds} s: its initialisation does not end, or the machine is overloaded", path.display())]
    TimedOut { path: PathBuf, seconds: u64 },
    #[error("no process can be started to try modules in: {what}")]
    NoProbe { what: String },
    #[error("{first_error}, at {}:{line}", file.display())]
    BuildFailed { first_error: String, file: PathBuf, line: u32 },
    #[error(transparent)]
    CannotBuild(BuildError),
}

fn subject(block: &str, item: &str) -> String {
    match (block, item) {
        ("", "") => String::new(),
        (block, "") => format!("block '{block}': "),
        ("", item) => format!("type '{item}': "),
        (block, item) => format!("item '{block}.{item}': "),
    }
}

/// How to load.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    pub probe: Probe,
    /// For a source file.
    pub build: BuildOptions,
}

/// A code module in this process. It is never unloaded: what it gives stays good.
#[derive(Clone, Debug)]
pub struct LoadedModule {
    /// File name without its ending and without `lib`.
    pub name: String,
    /// The file that was asked for.
    pub path: PathBuf,
    pub blocks: Vec<BlockFace>,
    pub types: Vec<TypeFace>,
    pub target: String,
    pub compiler: String,
    /// The shared object itself.
    pub bytes: std::sync::Arc<[u8]>,
}

impl LoadedModule {
    /// The block of this name.
    pub fn block(&self, name: &str) -> Option<&BlockFace> {
        self.blocks.iter().find(|block| block.name == name)
    }
}

/// Loads a code module: a shared object made of C or Rust, or a C or C++ source, which is built first. The file is tried in a
/// child process. A file that was rebuilt under its name can be loaded again while the old module is in use.
///
/// Not for the real-time path: it starts processes and takes from 10 ms to some seconds.
///
/// # Errors
/// Whatever is wrong with the file, as a [`LoadError`]; this process goes on as it was.
pub fn load(path: &Path, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
    let here = || path.to_path_buf();
    if !path.is_file() {
        return Err(LoadError::NotFound { path: here() });
    }
    // What is built lies there until it has been read.
    let folder;
    let file = match is_source(path) {
        false => here(),
        true => {
            folder = private_folder()?;
            let build_options = BuildOptions { output: Some(folder.path().join("built.so")), ..options.build.clone() };
            build(&[path], &build_options).map_err(|error| match error {
                BuildError::Failed { message, file, line } => LoadError::BuildFailed { first_error: message, file, line },
                other => LoadError::CannotBuild(other),
            })?
        }
    };
    let bytes = std::fs::read(&file).map_err(|error| LoadError::Unreadable { path: here(), what: error.to_string() })?;
    load_bytes(path, bytes, options)
}

/// The same from the bytes of a shared object, for one that came from another process. `path` is its name in messages, and gives that of the
/// module; nothing has to be there.
///
/// # Errors
/// As for [`load`].
pub fn load_bytes(path: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
    let here = || path.to_path_buf();
    if seal::check(&bytes) == Seal::Broken {
        return Err(LoadError::Damaged { path: here(), what: "its bytes are not those that were built".to_string() });
    }
    elf::check(&bytes).map_err(|error| match error {
        ElfError::Damaged(what) => LoadError::Damaged { path: here(), what },
        ElfError::Foreign { have, want } => LoadError::ForeignTarget { path: here(), have, want },
    })?;
    let folder = private_folder()?;
    let name = module_name(path);
    let copy = folder.path().join(format!("{name}.so"));
    std::fs::write(&copy, &bytes).map_err(|error| LoadError::Unreadable { path: copy.clone(), what: error.to_string() })?;
    judge(path, options.probe.run(&copy), options)?;
    let face = open(path, &copy)?;
    Ok(LoadedModule { name, path: here(), blocks: face.blocks, types: face.types, target: face.target, compiler: face.compiler, bytes: bytes.into() })
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

/// Loads the copy that a child has survived.
fn open(path: &Path, copy: &Path) -> Result<ModuleFace, LoadError> {
    let here = || path.to_path_buf();
    // SAFETY: a child process has just loaded these bytes, run their initialisation and walked their tables.
    let library = unsafe { Library::open(Some(copy), RTLD_NOW | RTLD_LOCAL) }.map_err(|error| LoadError::Damaged { path: here(), what: error.to_string() })?;
    // SAFETY: the symbol has this type in every version of the ABI.
    let entry = unsafe { library.get::<unsafe extern "C" fn() -> *const Module>(MODULE_SYMBOL.as_bytes()) }.map(|symbol| *symbol);
    let Ok(entry) = entry else { return Err(LoadError::NotAModule { path: here() }) };
    // Descriptors are `'static` from here on: the module stays.
    core::mem::forget(library);
    // SAFETY: the entry of a module that stays.
    unsafe { ModuleFace::read(entry()) }.map_err(|refusal| match refusal {
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
