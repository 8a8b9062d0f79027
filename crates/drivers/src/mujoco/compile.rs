// SPDX-License-Identifier: Apache-2.0
//! Compilation of an MJCF file into a model.
use super::contacts::model_with;
use super::functions::{Files, Model, MuJoCo};
use super::{log, refusals, trial};
use device::DriverError;
use std::ffi::{CStr, CString, c_char, c_int};
use std::path::{Path, PathBuf};

/// Returns the canonical path, because MuJoCo shortens `a/../b` textually, which is wrong after a symbolic link.
pub(super) fn whole(path: &Path) -> Result<PathBuf, DriverError> {
    path.canonicalize().map_err(|e| DriverError::File { kind: "mujoco".into(), path: path.into(), problem: e.to_string() })
}

/// Tries the file at `whole`; error messages refer to it as `path`.
pub(super) fn tried(library: &Path, path: &Path, whole: &Path) -> Result<(), DriverError> {
    trial::model(library, whole).map_err(|problem| refusals::model(path, &problem))
}

/// Tries and compiles the model at `path`, with a sensor for this number of contacts.
pub(super) fn compile(mujoco: &MuJoCo, path: &Path, contacts: u32) -> Result<*mut Model, DriverError> {
    let whole = whole(path)?;
    tried(&mujoco.path, path, &whole)?;
    let failed = |problem: String| refusals::model(path, &problem);
    let (whole, text) = if contacts > 0 { model_with(&whole, contacts) } else { (whole, String::new()) };
    let file = CString::new(whole.as_os_str().as_encoded_bytes()).map_err(|_| failed("its name contains a NUL character".into()))?;
    let files = InMemory::new(mujoco, &file, &text);
    let mut message = [0 as c_char; 1000];
    let mut model = std::ptr::null_mut();
    log::watch(|| {
        // SAFETY: the file name ends in NUL, the message has the size that is passed, and the files in memory outlive the call.
        model = unsafe { (mujoco.mj_loadXML)(file.as_ptr(), &files.0, message.as_mut_ptr(), message.len() as c_int) };
    });
    if model.is_null() {
        // SAFETY: MuJoCo ends the message in NUL.
        let text = unsafe { CStr::from_ptr(message.as_ptr()) }.to_string_lossy().trim().replace('\n', "; ");
        return Err(failed(text));
    }
    Ok(model)
}

/// A file in memory, if there is a text for it; MuJoCo searches there first.
struct InMemory<'a>(Files, &'a MuJoCo);

impl<'a> InMemory<'a> {
    fn new(mujoco: &'a MuJoCo, name: &CStr, text: &str) -> InMemory<'a> {
        let mut files = InMemory(Files { implementation: std::ptr::null_mut() }, mujoco);
        // SAFETY: MuJoCo copies the text, whose length is passed; a file that is not added is one that it does not find.
        unsafe {
            (mujoco.mj_defaultVFS)(&mut files.0);
            if !text.is_empty() {
                (mujoco.mj_addBufferVFS)(&mut files.0, name.as_ptr(), text.as_ptr().cast(), text.len() as c_int);
            }
        }
        files
    }
}

impl Drop for InMemory<'_> {
    fn drop(&mut self) {
        // SAFETY: the VFS was made by `mj_defaultVFS` and is freed only here.
        unsafe { (self.1.mj_deleteVFS)(&mut self.0) }
    }
}
