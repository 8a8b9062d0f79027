// SPDX-License-Identifier: Apache-2.0
//! Code backends: each converts files of one kind into function blocks. Descriptors have the same structure for all kinds, so that the
//! layers above cannot tell them apart.
use crate::LoadError;
use crate::native::probe::Probe;
use crate::source::build::BuildOptions;
use opengpac::read::{BlockFace, TypeFace};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Description of the files that a backend accepts.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Noun phrase for a list of accepted kinds, such as `a shared object`.
    pub kind: &'static str,
    /// File name extensions, without the dot.
    pub endings: &'static [&'static str],
}

/// A kind of file that contains blocks. Each kind is a constant of its folder; [`register`](crate::register) adds kinds from other
/// crates.
pub trait Backend: Sync {
    /// Returns a description of the files that the backend accepts.
    fn describe(&self) -> Description;

    /// Returns true if the backend's files are sources, which are built before they are loaded.
    fn is_source(&self) -> bool {
        false
    }

    /// Returns true if these bytes are a file of this kind. Called if the kind cannot be determined from the file's name, and for bytes
    /// received from another process.
    fn probe(&self, bytes: &[u8]) -> bool;

    /// Converts a file into blocks. Anything that may crash a process is tried in a child process first. Never called on the real-time
    /// path.
    ///
    /// # Errors
    /// Fails if the file has any fault; this process is not affected.
    fn load(&self, path: &Path, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
        let bytes = std::fs::read(path).map_err(|error| LoadError::Unreadable { path: path.to_path_buf(), what: error.to_string() })?;
        self.load_bytes(path, bytes, options)
    }

    /// Loads a module from [`LoadedModule::bytes`] that were sent by another process or kept in a record. `path` is used in messages and
    /// for the module's name; the file need not exist.
    ///
    /// # Errors
    /// Same as for [`Backend::load`].
    fn load_bytes(&self, path: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<LoadedModule, LoadError>;
}

/// Options for loading a module.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    pub probe: Probe,
    /// Options for building a source file.
    pub build: BuildOptions,
}

/// A code module in this process. It is never unloaded, so everything obtained from it stays valid.
#[derive(Clone, Debug)]
pub struct LoadedModule {
    /// File name without its extension and without the prefix `lib`.
    pub name: String,
    /// Requested file.
    pub path: PathBuf,
    pub blocks: Vec<BlockFace>,
    pub types: Vec<TypeFace>,
    pub target: String,
    pub compiler: String,
    /// True if the module's initialisation changed the floating-point control words of the loading thread; they have been restored.
    pub changed_floats: bool,
    /// Bytes from which other processes load the module; for C, C++ and Rust, the shared object itself.
    pub bytes: Arc<[u8]>,
}

impl LoadedModule {
    /// Returns the block with this name.
    pub fn block(&self, name: &str) -> Option<&BlockFace> {
        self.blocks.iter().find(|block| block.name == name)
    }
}
