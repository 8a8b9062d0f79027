// SPDX-License-Identifier: Apache-2.0
//! Code that arrives while the system is running.
use crate::refuse::{refuse, refuse_at};
use indexmap::IndexMap;
use model::interface::Interface;
use model::refusal::{Class, Refusals, SourceLocation};
use modules::{BuildError, BuildOptions, LoadError, LoadOptions, Probe};
use std::path::{Path, PathBuf};

/// Loads a module; fails with `ModuleError` if the file is faulty.
pub fn load(path: &Path, python: &str) -> Result<modules::LoadedModule, Refusals> {
    let options = LoadOptions { probe: Probe::python(python), build: BuildOptions { python: Some(python.into()), ..BuildOptions::default() } };
    modules::load(path, &options).map_err(|error| {
        let place = match &error {
            LoadError::BuildFailed { file, line, .. } => Some(SourceLocation { file: file.display().to_string(), line: *line }),
            _ => None,
        };
        let message = match error {
            LoadError::BuildFailed { first_error, .. } => first_error,
            other => other.to_string(),
        };
        refuse_at(Class::ModuleError, message, "", place)
    })
}

/// Compiles C or C++ sources into a code module and returns its path.
pub fn build(sources: &[PathBuf], output: Option<PathBuf>, python: &str) -> Result<PathBuf, Refusals> {
    let options = BuildOptions { output, python: Some(python.into()), ..BuildOptions::default() };
    modules::build(sources, &options).map_err(|error| match error {
        BuildError::Failed { message, file, line } => {
            refuse_at(Class::ModuleError, message, "", Some(SourceLocation { file: file.display().to_string(), line }))
        }
        other => refuse(Class::ModuleError, other.to_string(), ""),
    })
}

/// Returns the interfaces of the library's blocks.
pub fn library() -> Vec<Interface> {
    let (faces, types) = library::faces();
    let types: IndexMap<String, String> = types.iter().map(|t| (t.name.clone(), t.declaration.clone())).collect();
    faces.iter().map(|face| crate::definitions::faces::interface("library", face, &types)).collect()
}
