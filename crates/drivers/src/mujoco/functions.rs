// SPDX-License-Identifier: Apache-2.0
//! MuJoCo's C library, loaded at run time: the functions that the plant calls, without access to fields of its structs.
//!
//! Signatures and enums are those of `include/mujoco/*.h` of the MuJoCo 4.0.0 wheel. Everything inside `mjModel` and `mjData` is accessed
//! through functions, so that no layout is assumed: state by `mj_getState`/`mj_setState`, model fields by name through a batch of one
//! simulation (`mjb_expand`, written back by `mjb_getModel`), bias by `mj_rne`, sensors by `mj_readSensor`.
use super::refusals;
use device::DriverError;
use libloading::Library;
use std::ffi::{c_char, c_int, c_void};
use std::path::{Path, PathBuf};

/// `mjModel` and `mjData`, opaque.
pub type Model = c_void;
pub type Data = c_void;

/// `mjtObj`: kind of a named object.
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

/// `mjVFS`: files in memory.
#[repr(C)]
pub struct Files {
    pub implementation: *mut c_void,
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
        /// Functions, by their names in the header. They are valid for the lifetime of this value.
        #[allow(non_snake_case)]
        pub struct MuJoCo { $(pub $name: $signature,)* pub path: PathBuf, _library: Library }

        #[allow(non_snake_case)]
        /// Resolves the functions in a library whose version has been checked.
        pub(super) fn resolve(library: Library, path: &Path) -> Result<MuJoCo, DriverError> {
            $(
                // SAFETY: the type is that of this function in the header of the version that `load` has checked.
                let $name = *unsafe { library.get::<$signature>(concat!(stringify!($name), "\0").as_bytes()) }
                    .map_err(|_| refusals::no_symbol(path, stringify!($name)))?;
            )*
            Ok(MuJoCo { $($name,)* path: path.into(), _library: library })
        }
    };
}

functions! {
    mj_loadXML: unsafe extern "C" fn(*const c_char, *const Files, *mut c_char, c_int) -> *mut Model;
    mj_defaultVFS: unsafe extern "C" fn(*mut Files);
    mj_addBufferVFS: unsafe extern "C" fn(*mut Files, *const c_char, *const c_void, c_int) -> c_int;
    mj_deleteVFS: unsafe extern "C" fn(*mut Files);
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
