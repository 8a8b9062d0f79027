// SPDX-License-Identifier: Apache-2.0
//! Shared code of this crate's tests.
#![allow(dead_code)] // not every test uses all of it

use modules::{BuildOptions, LoadError, LoadOptions, LoadedModule, Probe, build, load};
use std::path::{Path, PathBuf};

pub fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples")
}

/// Creates a folder for one test.
pub fn folder(test: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

pub fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

pub fn options() -> LoadOptions {
    LoadOptions { probe: Probe::of([env!("CARGO_BIN_EXE_opengpac-probe").into()]), build: BuildOptions::default() }
}

/// Builds and loads a module from this source.
pub fn module(test: &str, name: &str, text: &str) -> LoadedModule {
    load(&write(&folder(test), name, text), &options()).unwrap()
}

pub fn built(test: &str, text: &str) -> PathBuf {
    build(&[write(&folder(test), "module.c", text)], &BuildOptions::default()).unwrap()
}

pub fn refusal(path: &Path) -> LoadError {
    load(path, &options()).map(|module| module.name).unwrap_err()
}

pub const GAIN: &str = "#include <opengpac.h>\nFUNCTION_BLOCK(gain, \"y = k u.\", in(double, u, \"in\"), out(double, y, \"out\"), param(double, k, 2.0, \"gain\"))\n{ self->y = self->k * self->u; return OK; }\n";
