// SPDX-License-Identifier: Apache-2.0
//! Shared objects compiled from C, C++ or Rust. A file is never trusted: its header is read here, a sacrificial child process loads a
//! private copy and walks its tables, and only then is the same copy loaded here. A module is never unloaded, so descriptors are
//! `'static`.
#[doc(hidden)]
pub mod elf;
mod floats;
mod load;
pub(crate) mod probe;
pub(crate) mod seal;
#[cfg(any(target_arch = "x86_64", test))]
mod x86;

pub(crate) use load::load_bytes;
pub use probe::{PYTHON_PROBE, Probe};

use crate::backend::{Backend, Description, LoadOptions, LoadedModule};
use crate::error::LoadError;
use std::path::Path;

/// Backend for shared objects.
pub(crate) struct SharedObjects;

/// Magic numbers of the known file formats.
const ELF: &[u8] = b"\x7fELF";

impl Backend for SharedObjects {
    fn describe(&self) -> Description {
        Description { kind: "a shared object", endings: &["so"] }
    }

    fn probe(&self, bytes: &[u8]) -> bool {
        bytes.starts_with(ELF)
    }

    fn load_bytes(&self, path: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
        load_bytes(path, bytes, options)
    }
}
