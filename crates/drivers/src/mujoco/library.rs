// SPDX-License-Identifier: Apache-2.0
//! Location and version check of MuJoCo's library.
use super::functions::{MuJoCo, resolve};
use super::{log, refusals};
use device::DriverError;
use libloading::Library;
use std::ffi::{CStr, c_char, c_int};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Loaded libraries, by file. None is ever unloaded, because it holds a reference to this driver's log receiver, and there may be other
/// references to it.
static LOADED: Mutex<Vec<(PathBuf, &'static MuJoCo)>> = Mutex::new(Vec::new());

/// Loads the library at `place`: the folder of the Python package `mujoco`, or the file itself. It is loaded only once, with this
/// driver's log receiver.
///
/// The default is the path in `OPENGPAC_MUJOCO`. Fails if the library is not found, not MuJoCo 4, or incomplete.
pub fn load(place: Option<&Path>) -> Result<&'static MuJoCo, DriverError> {
    let path = find(place)?;
    let mut loaded = LOADED.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some((_, mujoco)) = loaded.iter().find(|(known, _)| *known == path) {
        return Ok(mujoco);
    }
    let mujoco: &'static MuJoCo = Box::leak(Box::new(load_file(path.clone())?));
    log::install(mujoco);
    loaded.push((path, mujoco));
    Ok(mujoco)
}

fn load_file(path: PathBuf) -> Result<MuJoCo, DriverError> {
    // SAFETY: loading runs the initialisers of a library that the user has named; MuJoCo's have no preconditions.
    let library = unsafe { Library::new(&path) }.map_err(|e| refusals::no_library(format!("and '{}' does not load: {e}", path.display())))?;
    let missing = |_| refusals::no_symbol(&path, "mj_version");
    // SAFETY: `mj_version` has had this type in every version.
    let version = unsafe { library.get::<unsafe extern "C" fn() -> c_int>(b"mj_version\0").map_err(missing)?() };
    if !(4_000_000..5_000_000).contains(&version) {
        return Err(refusals::other_version(&path, &version_text(&library).unwrap_or_else(|| version.to_string())));
    }
    resolve(library, &path)
}

fn version_text(library: &Library) -> Option<String> {
    // SAFETY: `mj_versionString` has had this type in every version, and returns a constant string.
    unsafe {
        let text = library.get::<unsafe extern "C" fn() -> *const c_char>(b"mj_versionString\0").ok()?();
        Some(CStr::from_ptr(text).to_string_lossy().into_owned())
    }
}

pub(super) fn find(place: Option<&Path>) -> Result<PathBuf, DriverError> {
    let place = match place {
        Some(place) => place.to_path_buf(),
        None => std::env::var_os("OPENGPAC_MUJOCO").map(PathBuf::from).ok_or_else(|| refusals::no_library("and its location is not known".to_owned()))?,
    };
    if place.is_file() {
        return Ok(place);
    }
    let mut found: Vec<PathBuf> = std::fs::read_dir(&place)
        .map_err(|e| refusals::no_library(format!("and '{}' cannot be read: {e}", place.display())))?
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|p| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with("libmujoco.so")))
        .collect();
    found.sort();
    found.pop().ok_or_else(|| refusals::no_library(format!("and '{}' contains no libmujoco.so", place.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_library_says_how_to_get_it() {
        let error = load(Some(Path::new("/nowhere/at/all"))).err().expect("there is none").to_string();
        assert!(error.contains("pip install mujoco") && error.contains("/nowhere/at/all"), "{error}");
    }
}
