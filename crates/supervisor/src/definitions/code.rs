// SPDX-License-Identifier: Apache-2.0
//! Code: the library, and modules added under a name.
use crate::definitions::catalog::Code;
use crate::definitions::download::load;
use crate::observation::description::ModuleAbout;
use crate::refuse::refuse;
use crate::system::System;
use indexmap::IndexMap;
use model::refusal::{Class, Refusals};
use std::path::Path;
use std::sync::Arc;

impl System {
    /// Adds the library's blocks as module `library`.
    pub(crate) fn enter_library(&self) {
        let (faces, types) = library::faces();
        self.enter_module("library", faces, types, Arc::new(rtp::Module::library()));
    }

    /// Adds blocks that are part of this program (Rust blocks linked into it) as module `module`; an existing module with this name is
    /// redefined. For code that arrives while the system is running, see [`System::download`]. Fails with `ModuleError` if a descriptor
    /// is invalid, and with `InUse` if an instance of the module's blocks is running.
    pub fn enter(&self, module: &str, blocks: &[&'static opengpac::abi::Descriptor], types: &[&'static opengpac::abi::TypeDescriptor]) -> Result<(), Refusals> {
        self.refuse_busy_module(module)?;
        let wrong = |why: String| refuse(Class::ModuleError, format!("cannot register module '{module}': {why}"), "");
        let types = types.iter().map(|t| opengpac::read::TypeFace::read(t)).collect::<Result<Vec<_>, _>>().map_err(|why| wrong(why.to_string()))?;
        let faces = blocks.iter().map(|d| opengpac::read::BlockFace::read(d, &types)).collect::<Result<Vec<_>, _>>().map_err(|why| wrong(why.to_string()))?;
        self.enter_module(module, &faces, &types, Arc::new(()));
        Ok(())
    }

    /// Adds blocks under a module's name; verbs that use them are rechecked when next applied.
    pub(crate) fn enter_module(
        &self,
        module: &str,
        blocks: &[opengpac::read::BlockFace],
        types: &[opengpac::read::TypeFace],
        keep: Arc<dyn std::any::Any + Send + Sync>,
    ) {
        let mut definitions = self.shared.definitions();
        let types: IndexMap<String, String> = types.iter().map(|t| (t.name.clone(), t.declaration.clone())).collect();
        let code: Vec<Code> = (blocks.iter())
            .map(|face| Code {
                descriptor: face.descriptor,
                module: keep.clone(),
                interface: Arc::new(crate::definitions::faces::interface(module, face, &types)),
            })
            .collect();
        let prefix = format!("{module}.");
        definitions.configuration.interfaces.retain(|name, _| !name.starts_with(&prefix));
        for entry in &code {
            definitions.configuration.interfaces.insert(entry.interface.name.clone(), (*entry.interface).clone());
        }
        definitions.catalog.enter(module, types, code);
        definitions.checked.clear();
        drop(definitions);
        // A replaced module is trusted again.
        self.shared.locked().safety.poisoned.remove(module);
    }

    /// Refuses to redefine a module while verb instances that use its blocks are running or suspended.
    pub(crate) fn refuse_busy_module(&self, module: &str) -> Result<(), Refusals> {
        let core = self.shared.locked();
        let prefix = format!("{module}.");
        match core.instances.values().find(|i| i.is_busy() && i.plan.blocks.iter().any(|b| b.block.starts_with(&prefix))) {
            None => Ok(()),
            Some(busy) => Err(refuse(
                Class::InUse,
                format!("cannot download module '{module}' again: instance '{}', which uses its blocks, is {}", busy.name, busy.state().name()),
                format!("halt '{}' first", busy.name),
            )),
        }
    }

    /// Returns the shared objects of the current code modules by module name.
    pub fn module_code(&self) -> Vec<(String, Vec<u8>)> {
        self.shared.definitions().catalog.code()
    }

    /// Returns the SHA-256 digests, in hexadecimal, of the shared objects of all code modules that the system has ever loaded.
    pub fn module_digests(&self) -> Vec<String> {
        self.shared.definitions().catalog.digests.iter().cloned().collect()
    }

    /// Downloads a code module: C or C++ source, a shared object, or a compiled Rust module. Its blocks are named `module.block`; an
    /// existing module with this name is redefined. `python` is the interpreter that tests modules, and in which the `ziglang` wheel may
    /// be installed.
    pub fn download(&self, path: &Path, name: Option<&str>, python: &str) -> Result<ModuleAbout, Refusals> {
        let stem = path.file_stem().and_then(|s| s.to_str()).unwrap_or("module").trim_start_matches("lib").to_owned();
        let module = name.map_or(stem, str::to_owned);
        if module == "library" || module.is_empty() || module.contains('.') {
            return Err(refuse(Class::ModuleError, format!("a module cannot be named '{module}'"), "give it another name: cell.download(path, name=…)"));
        }
        self.refuse_busy_module(&module)?;
        let loaded = load(path, python)?;
        self.enter_module(&module, &loaded.blocks, &loaded.types, Arc::new(rtp::Module::new(&module, loaded.bytes.clone())));
        let mut described = self.module_about(&module);
        if loaded.changed_floats {
            described.note = Some(self.note_floats(&module));
        }
        Ok(described)
    }
}
