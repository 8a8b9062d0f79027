// SPDX-License-Identifier: Apache-2.0
//! C and C++ sources, which are first built into a shared object.
pub(crate) mod build;
mod c_words;
mod diagnosis;
pub mod fused;
mod languages;
mod names;
mod text;

pub use build::{BuildError, BuildOptions, build, compiler, write_header};
pub(crate) use c_words::is_taken_in_c;
pub use c_words::is_word_of_c;

use crate::backend::{Backend, Description, LoadOptions, LoadedModule};
use crate::error::LoadError;
use crate::folder::Folder;
use crate::native;
use build::build_told;
use std::path::Path;
use std::sync::Arc;
use text::Text;

/// Backend for sources.
pub(crate) struct Sources;

impl Backend for Sources {
    fn describe(&self) -> Description {
        Description { kind: "a C or C++ source", endings: &["c", "cpp", "cc", "cxx"] }
    }

    fn is_source(&self) -> bool {
        true
    }

    /// Returns false, because the language of a text is recognised by its file name.
    fn probe(&self, _bytes: &[u8]) -> bool {
        false
    }

    fn load(&self, path: &Path, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
        let unreadable = |error: std::io::Error| LoadError::Unreadable { path: path.to_path_buf(), what: error.to_string() };
        let folder = Folder::new().map_err(|error| LoadError::Unreadable { path: std::env::temp_dir(), what: error.to_string() })?;
        let build_options = BuildOptions { output: Some(folder.path().join("built.so")), ..options.build.clone() };
        let (built, compiled) = build_told(&[path], &build_options).map_err(|error| match error {
            BuildError::Failed { message, file, line } => LoadError::BuildFailed { first_error: message, file, line },
            other => LoadError::CannotBuild(other),
        })?;
        // The built file stays there until it has been read.
        let bytes = std::fs::read(built).map_err(unreadable)?;
        let loaded = native::load_bytes(path, bytes, options)?;
        for text in compiled.into_iter().map(|compiled| Arc::new(Text::of(compiled, &options.build))) {
            loaded.blocks.iter().for_each(|block| text::keep(block.descriptor.run, &text));
        }
        Ok(loaded)
    }

    fn load_bytes(&self, path: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
        native::load_bytes(path, bytes, options)
    }
}
