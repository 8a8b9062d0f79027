// SPDX-License-Identifier: Apache-2.0
//! Code backends of this process, and the selection of one for a file.
use crate::backend::{Backend, Description, LoadOptions, LoadedModule};
use crate::error::LoadError;
use crate::{native, onnx, source};
use std::path::Path;
use std::sync::{PoisonError, RwLock};

/// Backends of this crate.
static ALL: [&dyn Backend; 3] = [&source::Sources, &onnx::Policies, &native::SharedObjects];
/// Backends of other crates.
static REGISTERED: RwLock<Vec<&'static dyn Backend>> = RwLock::new(Vec::new());

/// Registers this backend for [`load`], in this process. If several backends accept a file, the first one takes it. Idempotent.
pub fn register(backend: &'static dyn Backend) {
    let mut registered = REGISTERED.write().unwrap_or_else(PoisonError::into_inner);
    let kind = backend.describe().kind;
    if registered.iter().all(|known| known.describe().kind != kind) {
        registered.push(backend);
    }
}

/// Returns descriptions of the files that the backends of this process accept.
pub fn backends() -> Vec<Description> {
    all().iter().map(|backend| backend.describe()).collect()
}

/// Returns the extensions of files that are built before they are loaded, without the dot.
pub fn source_endings() -> Vec<&'static str> {
    all().iter().filter(|backend| backend.is_source()).flat_map(|backend| backend.describe().endings).copied().collect()
}

/// Loads a code module from a file of any kind that a backend accepts. A file that was rebuilt under the same name can be loaded again
/// while the old module is in use.
///
/// Not for the real-time path: it starts processes and takes between 10 ms and several seconds.
///
/// # Errors
/// Fails with a [`LoadError`] if the file has any fault; this process is not affected.
pub fn load(path: &Path, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
    if !path.is_file() {
        return Err(LoadError::NotFound { path: path.to_path_buf() });
    }
    if let Some(backend) = by_ending(path) {
        return backend.load(path, options);
    }
    let bytes = std::fs::read(path).map_err(|error| LoadError::Unreadable { path: path.to_path_buf(), what: error.to_string() })?;
    by_bytes(&bytes).ok_or_else(|| unknown(path))?.load(path, options)
}

/// Loads a module from its bytes, received from another process. `path` is used in messages and for the module's name; the file need not
/// exist.
///
/// # Errors
/// Same as for [`load`].
pub fn load_bytes(path: &Path, bytes: Vec<u8>, options: &LoadOptions) -> Result<LoadedModule, LoadError> {
    let backend = by_bytes(&bytes).or_else(|| by_ending(path)).ok_or_else(|| unknown(path))?;
    backend.load_bytes(path, bytes, options)
}

fn all() -> Vec<&'static dyn Backend> {
    let registered = REGISTERED.read().unwrap_or_else(PoisonError::into_inner);
    ALL.iter().chain(registered.iter()).copied().collect()
}

fn by_ending(path: &Path) -> Option<&'static dyn Backend> {
    let ending = path.extension()?.to_str()?;
    all().into_iter().find(|backend| backend.describe().endings.contains(&ending))
}

fn by_bytes(bytes: &[u8]) -> Option<&'static dyn Backend> {
    all().into_iter().find(|backend| backend.probe(bytes))
}

fn unknown(path: &Path) -> LoadError {
    let kinds: Vec<String> = backends().iter().map(|of| format!("{} (.{})", of.kind, of.endings.join(", ."))).collect();
    let known =
        kinds.split_last().map_or_else(String::new, |(last, rest)| if rest.is_empty() { last.clone() } else { format!("{} or {last}", rest.join(", ")) });
    LoadError::Unknown { path: path.to_path_buf(), known }
}
