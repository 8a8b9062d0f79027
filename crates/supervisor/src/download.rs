// SPDX-License-Identifier: Apache-2.0
//! Code that comes while the system runs, and trying a block without a system.
use crate::refuse::{refuse, refuse_at, unknown};
use crate::system::System;
use indexmap::IndexMap;
use model::interface::{Interface, Kind};
use model::refusal::{Class, Place, Refusals};
use model::types::Type;
use model::value::Value;
use modules::{BuildError, BuildOptions, LoadError, LoadOptions, Probe};
use opengpac::read::{BlockFace, TypeFace};
use opengpac::trial::Trial;
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

fn library_faces() -> (Vec<BlockFace>, Vec<TypeFace>) {
    let types: Vec<TypeFace> = library::types().iter().filter_map(|t| TypeFace::read(t).ok()).collect();
    let read = |d: &&'static opengpac::abi::Descriptor| BlockFace::read(d, &types).ok();
    (library::blocks().iter().filter_map(read).collect(), types)
}

/// Runs a block `times` times with no system, an invocation every `period_ns`. `inputs`: a constant, or a list with one value an invocation.
/// Returns each output's values, the conditions as (invocation, name, value or none), and the fault that ended it, if one did.
pub fn trial(
    module: &str,
    block: &str,
    values: &IndexMap<String, Value>,
    inputs: &IndexMap<String, Vec<Value>>,
    times: usize,
    period_ns: i64,
    python: &str,
) -> Result<Json, Refusals> {
    let (faces, types) = if module == "library" {
        library_faces()
    } else {
        let loaded = load(Path::new(module), python)?;
        (loaded.blocks, loaded.types)
    };
    let names: Vec<String> = faces.iter().map(|f| f.name.clone()).collect();
    let Some(face) = faces.into_iter().find(|f| f.name == block) else { return Err(unknown("block", block, names.iter().map(String::as_str))) };
    let declarations: IndexMap<String, String> = types.iter().map(|t| (t.name.clone(), t.declaration.clone())).collect();
    let interface = crate::faces::interface(module, &face, &declarations);
    let size = size_of(&interface, values, inputs)?;
    let mut trial = Trial::of(face);
    trial.period_ns = period_ns;
    if let Some(item) = interface.items.iter().find(|i| i.kind == Kind::Size) {
        // First: the lengths of the others depend on it.
        put(&mut trial, &interface, &item.name, &Value::Integer(0), size)?;
    }
    for (name, value) in values {
        put(&mut trial, &interface, name, value, size)?;
    }
    run_trial(&mut trial, &interface, inputs, times, size)
}

/// n of a sized block: given, or the length of a sized item's value.
fn size_of(interface: &Interface, values: &IndexMap<String, Value>, inputs: &IndexMap<String, Vec<Value>>) -> Result<Option<u32>, Refusals> {
    let Some(item) = interface.items.iter().find(|i| i.kind == Kind::Size) else { return Ok(None) };
    if let Some(Value::Integer(n)) = values.get(&item.name) {
        return Ok(u32::try_from(*n).ok());
    }
    let sized = |name: &str| interface.items.iter().any(|i| i.name == name && i.sized);
    let given = values.iter().filter(|(name, _)| sized(name)).map(|(_, v)| v);
    let first = inputs.iter().filter(|(name, _)| sized(name)).filter_map(|(_, v)| v.first());
    match given.chain(first).find_map(|v| if let Value::List(list) = v { Some(list.len()) } else { None }) {
        Some(len) if (item.least as usize..=item.most as usize).contains(&len) => Ok(u32::try_from(len).ok()),
        Some(len) => Err(refuse(Class::ValueRefused, format!("'{}' takes {} to {} elements, not {len}", interface.name, item.least, item.most), "")),
        None => Ok(Some(item.least)),
    }
}

fn put(trial: &mut Trial, interface: &Interface, name: &str, value: &Value, size: Option<u32>) -> Result<(), Refusals> {
    let Some(item) = interface.items.iter().find(|i| i.name == name) else {
        return Err(unknown(&format!("item of '{}' named", interface.name), name, interface.items.iter().map(|i| i.name.as_str())));
    };
    let bytes = if item.kind == Kind::Size {
        size.unwrap_or(item.least).to_le_bytes().to_vec()
    } else {
        let of = Type::parse_sized(&item.type_text, &interface.types, size).map_err(|r| vec![r])?;
        of.encode(value, &item.unit).map_err(|r| vec![crate::life::named(r, name)])?
    };
    trial.set(name, &bytes).map_err(|why| refuse(Class::ValueRefused, why.to_string(), ""))
}

fn run_trial(trial: &mut Trial, interface: &Interface, inputs: &IndexMap<String, Vec<Value>>, times: usize, size: Option<u32>) -> Result<Json, Refusals> {
    let shown: Vec<_> = interface.items.iter().filter(|i| matches!(i.kind, Kind::Output | Kind::DeviceWrite)).collect();
    let mut outputs: IndexMap<String, Vec<Value>> = shown.iter().map(|i| (i.name.clone(), Vec::new())).collect();
    let (mut conditions, mut fault) = (Vec::new(), Json::Null);
    for time in 0..times {
        for (name, values) in inputs {
            if let Some(value) = values.get(time).or_else(|| values.last()) {
                put(trial, interface, name, value, size)?;
            }
        }
        if let Err(why) = trial.run() {
            fault = json!({"invocation": time, "text": why.to_string()});
            break;
        }
        for item in &shown {
            let of = Type::parse_sized(&item.type_text, &interface.types, size).map_err(|r| vec![r])?;
            let bytes = trial.get(&item.name).map_err(|why| refuse(Class::ValueRefused, why.to_string(), ""))?;
            outputs[&item.name].push(of.decode(&bytes[..of.size().min(bytes.len())]));
        }
        for name in trial.reported() {
            let value = reported(trial, interface, &name, size)?;
            conditions.push(json!([time, name, value]));
        }
    }
    Ok(json!({ "outputs": outputs, "conditions": conditions, "fault": fault }))
}

/// The value that a condition reported, if it has one.
fn reported(trial: &Trial, interface: &Interface, name: &str, size: Option<u32>) -> Result<Option<Value>, Refusals> {
    let Some(item) = interface.items.iter().find(|i| i.name == name && !i.type_text.is_empty()) else { return Ok(None) };
    let of = Type::parse_sized(&item.type_text, &interface.types, size).map_err(|r| vec![r])?;
    let bytes = trial.get(name).map_err(|why| refuse(Class::ValueRefused, why.to_string(), ""))?;
    Ok(Some(of.decode(&bytes)))
}
