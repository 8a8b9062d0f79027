// SPDX-License-Identifier: Apache-2.0
//! MuJoCo's C library, loaded at run time: the functions that the plant calls, and no field of any of its structs.
//!
//! Signatures and enums are those of `include/mujoco/*.h` of the MuJoCo 4.0.0 wheel. Everything inside `mjModel` and `mjData` is
//! reached through functions, so that no layout is assumed: state by `mj_getState`/`mj_setState`, model fields by name through
//! a batch of one (`mjb_expand`, written back by `mjb_getModel`), bias by `mj_rne`, sensors by `mj_readSensor`.
use crate::DriverError;
use libloading::Library;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// `mjModel` and `mjData`, opaque.
pub type Model = c_void;
pub type Data = c_void;

/// `mjtObj`: what a name is the name of.
pub mod object {
    pub const BODY: i32 = 1;
    pub const JOINT: i32 = 3;
    pub const SITE: i32 = 6;
    pub const SENSOR: i32 = 20;
    pub const KEY: i32 = 24;
}

/// `mjtState`: components of the state.
pub mod state {
    pub const QPOS: i32 = 1 << 1;
    pub const QVEL: i32 = 1 << 2;
    pub const QFRC_APPLIED: i32 = 1 << 7;
    pub const XFRC_APPLIED: i32 = 1 << 8;
}

/// First members of `mjLogMessage`, up to the text.
#[repr(C)]
pub struct LogMessage {
    /// `mjtLogLevel`: 2 warning, 3 error.
    pub level: c_int,
    pub topic: c_int,
    pub subject: [c_char; 1024],
}

pub type LogReceiver = unsafe extern "C" fn(*const LogMessage);

/// `mjBatchConfig`.
#[repr(C)]
pub struct BatchConfig {
    pub threads: c_int,
    pub persistent: bool,
}

macro_rules! functions {
    ($($name:ident: $signature:ty;)*) => {
        /// The functions, by the names of the header. They are valid as long as this value lives.
        #[allow(non_snake_case)]
        pub struct MuJoCo { $(pub $name: $signature,)* pub path: PathBuf, _library: Library }

        #[allow(non_snake_case)]
        fn resolve(library: Library, path: &Path) -> Result<MuJoCo, DriverError> {
            $(
                // SAFETY: the type is that of this function in the header of the version that `load` has checked.
                let $name = *unsafe { library.get::<$signature>(concat!(stringify!($name), "\0").as_bytes()) }
                    .map_err(|_| DriverError::LibrarySymbol { path: path.into(), symbol: stringify!($name).into() })?;
            )*
            Ok(MuJoCo { $($name,)* path: path.into(), _library: library })
        }
    };
}

functions! {
    mj_loadXML: unsafe extern "C" fn(*const c_char, *const c_void, *mut c_char, c_int) -> *mut Model;
    mj_deleteModel: unsafe extern "C" fn(*mut Model);
    mj_makeData: unsafe extern "C" fn(*const Model) -> *mut Data;
    mj_deleteData: unsafe extern "C" fn(*mut Data);
    mj_resetDataKeyframe: unsafe extern "C" fn(*const Model, *mut Data, c_int);
    mj_step: unsafe extern "C" fn(*const Model, *mut Data);
    mj_step1: unsafe extern "C" fn(*const Model, *mut Data);
    mj_step2: unsafe extern "C" fn(*const Model, *mut Data);
    mj_stateSize: unsafe extern "C" fn(*const Model, c_int) -> c_int;
    mj_getState: unsafe extern "C" fn(*const Model, *const Data, *mut f64, c_int);
    mj_setState: unsafe extern "C" fn(*const Model, *mut Data, *const f64, c_int);
    mj_rne: unsafe extern "C" fn(*const Model, *mut Data, c_int, *mut f64);
    mj_fullM: unsafe extern "C" fn(*const Model, *const Data, *mut f64);
    mj_local2Global: unsafe extern "C" fn(*mut Data, *mut f64, *mut f64, *const f64, *const f64, c_int, u8);
    mj_readSensor: unsafe extern "C" fn(*const Model, *const Data, c_int, f64, *mut f64, c_int) -> *const f64;
    mj_name2id: unsafe extern "C" fn(*const Model, c_int, *const c_char) -> c_int;
    mj_id2name: unsafe extern "C" fn(*const Model, c_int, c_int) -> *const c_char;
    mju_setLogHandler: unsafe extern "C" fn(Option<LogReceiver>) -> Option<LogReceiver>;
    mjb_makeBatch: unsafe extern "C" fn(*const Model, c_int, *const BatchConfig, *mut c_char, c_int) -> *mut c_void;
    mjb_deleteBatch: unsafe extern "C" fn(*mut c_void);
    mjb_expand: unsafe extern "C" fn(*mut c_void, *const c_char, *mut c_int, *mut c_int) -> *mut c_void;
    mjb_getModel: unsafe extern "C" fn(*mut c_void, c_int, *mut Model);
}

/// Libraries that are loaded, by file. None is ever unloaded: it holds our log receiver, and others may hold it.
static LOADED: Mutex<Vec<(PathBuf, &'static MuJoCo)>> = Mutex::new(Vec::new());

/// The library at `place`: the folder of the Python package `mujoco`, or the file itself; loaded once, with our log receiver.
///
/// Without a place, `OPENGPAC_MUJOCO` says where. Errors: not found, not MuJoCo 4, not complete.
pub fn load(place: Option<&Path>) -> Result<&'static MuJoCo, DriverError> {
    let path = find(place)?;
    let mut loaded = LOADED.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some((_, mujoco)) = loaded.iter().find(|(known, _)| *known == path) {
        return Ok(mujoco);
    }
    let mujoco: &'static MuJoCo = Box::leak(Box::new(load_file(path.clone())?));
    super::log::install(mujoco);
    loaded.push((path, mujoco));
    Ok(mujoco)
}

fn load_file(path: PathBuf) -> Result<MuJoCo, DriverError> {
    // SAFETY: loading runs the initialisers of a library that the user has named; MuJoCo's have no condition.
    let library =
        unsafe { Library::new(&path) }.map_err(|e| DriverError::LibraryMissing { problem: format!("and '{}' does not load: {e}", path.display()) })?;
    let missing = |_| DriverError::LibrarySymbol { path: path.clone(), symbol: "mj_version".into() };
    // SAFETY: `mj_version` has had this type in every version.
    let version = unsafe { library.get::<unsafe extern "C" fn() -> c_int>(b"mj_version\0").map_err(missing)?() };
    if !(4_000_000..5_000_000).contains(&version) {
        return Err(DriverError::LibraryVersion { found: version_text(&library).unwrap_or_else(|| version.to_string()), path });
    }
    resolve(library, &path)
}

fn version_text(library: &Library) -> Option<String> {
    // SAFETY: `mj_versionString` has had this type in every version, and gives a constant string.
    unsafe {
        let text = library.get::<unsafe extern "C" fn() -> *const c_char>(b"mj_versionString\0").ok()?();
        Some(CStr::from_ptr(text).to_string_lossy().into_owned())
    }
}

pub(super) fn find(place: Option<&Path>) -> Result<PathBuf, DriverError> {
    let place = match place {
        Some(place) => place.to_path_buf(),
        None => std::env::var_os("OPENGPAC_MUJOCO")
            .map(PathBuf::from)
            .ok_or_else(|| DriverError::LibraryMissing { problem: "and nothing says where it is".into() })?,
    };
    if place.is_file() {
        return Ok(place);
    }
    let mut found: Vec<PathBuf> = std::fs::read_dir(&place)
        .map_err(|e| DriverError::LibraryMissing { problem: format!("and '{}' cannot be read: {e}", place.display()) })?
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|p| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with("libmujoco.so")))
        .collect();
    found.sort();
    found.pop().ok_or_else(|| DriverError::LibraryMissing { problem: format!("and '{}' holds no libmujoco.so", place.display()) })
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
