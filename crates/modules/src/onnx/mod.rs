// SPDX-License-Identifier: Apache-2.0
//! Learned policies: an ONNX file with fixed shapes is translated into C code, which is built like any other source. Weights are
//! constants, scratch memory is on the stack and limited in size, and no neural-network library is needed at run time.
mod block;
mod items;
mod meaning;
mod metadata;
mod network;
mod operators;
mod program;
mod proto;
mod tensors;
mod value;

use crate::backend::{Backend, Description, LoadOptions, LoadedModule};
use crate::error::LoadError;
use crate::folder::Folder;
use crate::source;
use meaning::Meaning;
use prost::Message;
use std::path::Path;

/// Backend for policies.
pub(crate) struct Policies;

impl Backend for Policies {
    fn describe(&self) -> Description {
        Description { kind: "a policy", endings: &["onnx"] }
    }

    fn is_source(&self) -> bool {
        true
    }

    /// Returns false, because protobuf messages have no magic number; the kind is determined by the file's name.
    fn probe(&self, _bytes: &[u8]) -> bool {
        false
    }

    /// Loads a network, after including weights that are in separate files in its folder.
    fn load(&self, path: &Path, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
        let bytes = std::fs::read(path).map_err(|error| LoadError::Unreadable { path: path.to_path_buf(), what: error.to_string() })?;
        let whole = whole(&bytes, path).map_err(|what| LoadError::Network { path: path.to_path_buf(), what })?;
        self.load_bytes(path, whole.unwrap_or(bytes), options)
    }

    fn load_bytes(&self, path: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
        let text = translate(path, &bytes).map_err(|what| LoadError::Network { path: path.to_path_buf(), what })?;
        let unwritable = |error: std::io::Error| LoadError::Unreadable { path: std::env::temp_dir(), what: error.to_string() };
        let folder = Folder::new().map_err(unwritable)?;
        let written = folder.path().join("policy.c");
        std::fs::write(&written, text).map_err(unwritable)?;
        let mut module = source::Sources.load(&written, options)?;
        module.path = path.to_path_buf();
        module.name = stem(path);
        Ok(module)
    }
}

/// Returns the file of a network with its weights included, if some are in separate files in the folder of `path`; `None` if it is
/// already complete.
///
/// # Errors
/// Fails if the bytes are not an ONNX model, or a weight file is missing or too short.
pub fn whole(bytes: &[u8], path: &Path) -> Result<Option<Vec<u8>>, String> {
    let (mut model, _) = network::decode(bytes)?;
    let taken = tensors::take_in(&mut model, path.parent().unwrap_or(Path::new(".")))?;
    Ok(taken.then(|| model.encode_to_vec()))
}

/// Returns the C source of a policy's block.
///
/// # Errors
/// Fails if the file or its declaration has a fault; the message contains the node's name and the remedy.
fn translate(path: &Path, bytes: &[u8]) -> Result<String, String> {
    let (model, file) = network::decode(bytes)?;
    let mut meaning = Meaning::read(&file)?;
    let network = network::read(&model, &meaning.shapes)?;
    meaning.complete(&network)?;
    metadata::compare(&mut meaning, &file)?;
    let name = if meaning.name.is_empty() { meaning::port_name(&stem(path), "policy") } else { meaning.name.clone() };
    block::source(&meaning, &network, &name)
}

fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}
