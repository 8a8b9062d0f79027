// SPDX-License-Identifier: Apache-2.0
//! Drivers loaded from a file at run time: `name@/path/of/file.so`. The program that opens drivers provides the loader, because this
//! crate does not use a linker; a process that receives a request for such a kind loads the file itself.
use crate::declaration::Declaration;
use crate::error::DriverError;
use std::path::Path;
use std::sync::{PoisonError, RwLock};

/// Function that loads the drivers in a file and returns their declarations. A driver stays registered for the lifetime of its process.
pub type Loader = fn(&Path) -> Result<Vec<&'static Declaration>, DriverError>;

/// Loaders, each with the extension of its files.
static LOADERS: RwLock<Vec<(&'static str, Loader)>> = RwLock::new(Vec::new());

/// Registers the loader of files with the extension `ending` in this process. A later loader for the same extension is ignored.
pub fn lend_loader(ending: &'static str, loader: Loader) {
    let mut loaders = LOADERS.write().unwrap_or_else(PoisonError::into_inner);
    if loaders.iter().all(|(known, _)| *known != ending) {
        loaders.push((ending, loader));
    }
}

/// Returns the drivers in a file.
///
/// # Errors
/// Fails if no loader is registered for such a file, or with the loader's error.
pub fn load(file: &Path) -> Result<Vec<&'static Declaration>, DriverError> {
    let loaders = LOADERS.read().unwrap_or_else(PoisonError::into_inner).clone();
    let ending = file.extension().map(|ending| ending.to_string_lossy().into_owned()).unwrap_or_default();
    let Some((_, loader)) = loaders.iter().find(|(known, _)| *known == ending) else {
        let known: Vec<String> = loaders.iter().map(|(ending, _)| format!(".{ending}")).collect();
        return Err(DriverError::Failed(format!("drivers cannot be loaded from '{}': they are in files that end in {}", file.display(), known.join(", "))));
    };
    loader(file)
}

/// Returns the driver to which `name@file` refers; `None` if the kind does not include a file.
pub(crate) fn in_file(kind: &str) -> Option<Result<&'static Declaration, DriverError>> {
    let (name, file) = kind.split_once('@')?;
    let found = load(Path::new(file)).and_then(|drivers| {
        drivers.iter().find(|driver| driver.kind == name).copied().ok_or_else(|| {
            let known: Vec<&str> = drivers.iter().map(|driver| driver.kind).collect();
            DriverError::Failed(format!("there is no driver '{name}' in '{file}', which has {}", known.join(", ")))
        })
    });
    Some(found)
}
