// SPDX-License-Identifier: Apache-2.0
//! A code backend: what turns a file of one kind into function blocks. Whatever the kind, the descriptors are of one form, so that nobody
//! above can tell which it was.
use crate::LoadError;
use crate::native::probe::Probe;
use crate::source::build::BuildOptions;
use opengpac::read::{BlockFace, TypeFace};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files that a backend takes.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// For a sentence that lists what can be given: `a shared object`.
    pub kind: &'static str,
    /// The endings of its files, without the dot.
    pub endings: &'static [&'static str],
}

/// A kind of file that blocks come from. It is a constant of its folder; [`register`](crate::register) makes that of another crate known.
pub trait Backend: Sync {
    /// Returns a description of the files that it takes.
    fn describe(&self) -> Description;

    /// Returns true if its files are sources, which are built where they are loaded.
    fn is_source(&self) -> bool {
        false
    }

    /// Returns true if these bytes are a file of its kind: asked if the name of a file does not say so, and of bytes that came from another process.
    fn probe(&self, bytes: &[u8]) -> bool;

    /// Turns a file into blocks. What may end a process is tried in a child first. It is never called on the real-time path.
    ///
    /// # Errors
    /// Whatever is wrong with the file; this process goes on as it was.
    fn load(&self, path: &Path, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
        let bytes = std::fs::read(path).map_err(|error| LoadError::Unreadable { path: path.to_path_buf(), what: error.to_string() })?;
        self.load_bytes(path, bytes, options)
    }

    /// The same from [`LoadedModule::bytes`], which another process sent or a record keeps. `path` is its name in messages, and gives that of
    /// the module; nothing has to be there.
    ///
    /// # Errors
    /// As for [`Backend::load`].
    fn load_bytes(&self, path: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<LoadedModule, LoadError>;
}

/// Options of loading.
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
    /// Its initialisation changed the floating-point control words of the thread that loaded it; they have been restored.
    pub changed_floats: bool,
    /// Bytes from which other processes load it: of C, C++ and Rust the shared object itself.
    pub bytes: Arc<[u8]>,
}

impl LoadedModule {
    /// The block of this name.
    pub fn block(&self, name: &str) -> Option<&BlockFace> {
        self.blocks.iter().find(|block| block.name == name)
    }
}
