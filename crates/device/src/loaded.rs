// SPDX-License-Identifier: Apache-2.0
//! Drivers that come in a file while the program runs: `name@/path/of/file.so`. What loads such a file is lent by the program that opens drivers, as
//! nothing here knows a linker; any process that is asked for such a kind loads the file by itself.
use crate::declaration::Declaration;
use crate::error::DriverError;
use std::path::Path;
use std::sync::{PoisonError, RwLock};

/// Reads the drivers of a file: it gives the declaration of each. A driver stays known for the life of its process.
pub type Loader = fn(&Path) -> Result<Vec<&'static Declaration>, DriverError>;

/// Loaders, each with the ending of its files.
static LOADERS: RwLock<Vec<(&'static str, Loader)>> = RwLock::new(Vec::new());

/// Sets the loader of files that end in `.ending` in this process. The first one of an ending stays.
pub fn lend_loader(ending: &'static str, loader: Loader) {
    let mut loaders = LOADERS.write().unwrap_or_else(PoisonError::into_inner);
    if loaders.iter().all(|(known, _)| *known != ending) {
        loaders.push((ending, loader));
    }
}

/// Returns the drivers in a file.
///
/// # Errors
/// Nothing here loads such a file, or what is wrong with it.
pub fn load(file: &Path) -> Result<Vec<&'static Declaration>, DriverError> {
    let loaders = LOADERS.read().unwrap_or_else(PoisonError::into_inner).clone();
    let ending = file.extension().map(|ending| ending.to_string_lossy().into_owned()).unwrap_or_default();
    let Some((_, loader)) = loaders.iter().find(|(known, _)| *known == ending) else {
        let known: Vec<String> = loaders.iter().map(|(ending, _)| format!(".{ending}")).collect();
        return Err(DriverError::Failed(format!("drivers cannot be loaded from '{}': they are in files that end in {}", file.display(), known.join(", "))));
    };
    loader(file)
}

/// Returns the driver that `name@file` asks for; none: the kind names no file.
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
