// SPDX-License-Identifier: Apache-2.0
//! Code that comes while the system runs.
use crate::refuse::{refuse, refuse_at};
use crate::system::System;
use indexmap::IndexMap;
use model::interface::Interface;
use model::refusal::{Class, Place, Refusals};
use modules::{BuildError, BuildOptions, LoadError, LoadOptions, Probe};
use opengpac::read::{BlockFace, TypeFace};
use serde_json::{Value as Json, json};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl System {
    /// Downloads a code module: C or C++ source, a shared object, a compiled Rust module. Its blocks are `module.block`; a name
    /// that is there is redefined. `python`: the interpreter that tries modules and may have the `ziglang` wheel.
    pub fn download(&self, path: &Path, name: Option<&str>, python: &str) -> Result<Json, Refusals> {
        let stem = path.file_stem().and_then(|s| s.to_str()).unwrap_or("module").trim_start_matches("lib").to_owned();
        let module = name.map_or(stem, str::to_owned);
        if module == "library" || module.is_empty() || module.contains('.') {
            return Err(refuse(Class::ModuleError, format!("a module cannot be named '{module}'"), "give it another name: cell.download(path, name=…)"));
        }
        self.refuse_busy_module(&module)?;
        let loaded = load(path, python)?;
        self.enter_module(&module, &loaded.blocks, &loaded.types, Arc::new(rtp::Module::new(&module, loaded.bytes.clone())));
        Ok(self.module_json(&module))
    }
}

/// Loads a module; what is wrong with the file is a `ModuleError`.
pub fn load(path: &Path, python: &str) -> Result<modules::LoadedModule, Refusals> {
    let options = LoadOptions { probe: probe(python), build: BuildOptions { python: Some(python.into()), ..BuildOptions::default() } };
    modules::load(path, &options).map_err(|error| {
        let place = match &error {
            LoadError::BuildFailed { file, line, .. } => Some(Place { file: file.display().to_string(), line: *line }),
            _ => None,
        };
        let message = match error {
            LoadError::BuildFailed { first_error, .. } => first_error,
            other => other.to_string(),
        };
        refuse_at(Class::ModuleError, message, "", place)
    })
}

fn probe(python: &str) -> Probe {
    Probe::of([OsString::from(python), "-I".into(), "-c".into(), modules::PYTHON_PROBE.into()])
}

/// Compiles C or C++ sources into a code module; its path.
pub fn build(sources: &[PathBuf], output: Option<PathBuf>, python: &str) -> Result<PathBuf, Refusals> {
    let options = BuildOptions { output, python: Some(python.into()), ..BuildOptions::default() };
    modules::build(sources, &options).map_err(|error| match error {
        BuildError::Failed { message, file, line } => refuse_at(Class::ModuleError, message, "", Some(Place { file: file.display().to_string(), line })),
        other => refuse(Class::ModuleError, other.to_string(), ""),
    })
}

/// The blocks of the library, with their interfaces.
pub fn library_json() -> Json {
    let (faces, types) = library_faces();
    let types: IndexMap<String, String> = types.iter().map(|t| (t.name.clone(), t.declaration.clone())).collect();
    json!(faces.iter().map(|face| crate::faces::interface("library", face, &types)).collect::<Vec<Interface>>())
}

pub(crate) fn library_faces() -> (Vec<BlockFace>, Vec<TypeFace>) {
    let types: Vec<TypeFace> = library::types().iter().filter_map(|t| TypeFace::read(t).ok()).collect();
    let read = |d: &&'static opengpac::abi::Descriptor| BlockFace::read(d, &types).ok();
    (library::blocks().iter().filter_map(read).collect(), types)
}
