// SPDX-License-Identifier: Apache-2.0
//! Code available in a processor: the library, and modules sent to it.
use crate::module::{LIBRARY, Module};
use modules::{LoadOptions, Probe};
use opengpac::abi::Descriptor;
use opengpac::read::BlockFace;
use runtime::encoding::CodeName;
use std::any::Any;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

type Keeper = Arc<dyn Any + Send + Sync>;

/// Blocks by name.
pub struct Code {
    known: HashMap<CodeName, (&'static Descriptor, Keeper)>,
    probe: Probe,
}

impl Code {
    /// Creates a registry that contains only the library. `probe`: tries modules before they are loaded.
    pub fn new(probe: Probe) -> Code {
        let mut code = Code { known: HashMap::new(), probe };
        code.enter(LIBRARY, &library::faces().0, &(Arc::new(Module::library()) as Keeper));
        code
    }

    /// Loads a module from its bytes. Fails with a description if the module is faulty.
    pub fn load(&mut self, key: &str, name: &str, bytes: &[u8]) -> Result<(), String> {
        let module = Module::new(name, bytes.into());
        if module.key() != key {
            return Err(format!("module '{name}' is damaged: it was changed in transit"));
        }
        if self.known.keys().any(|known| known.module == key) {
            return Ok(());
        }
        self.enter_bytes(key, module)
    }

    /// Replaces the blocks registered under `key` with the blocks of the shared object `bytes`. Fails with a description if the shared
    /// object is faulty.
    pub fn replace(&mut self, key: &str, name: &str, bytes: &[u8]) -> Result<(), String> {
        self.enter_bytes(key, Module::new(name, bytes.into()))
    }

    fn enter_bytes(&mut self, key: &str, module: Module) -> Result<(), String> {
        let options = LoadOptions { probe: self.probe.clone(), ..LoadOptions::default() };
        let path = PathBuf::from(format!("{}.so", module.name()));
        let loaded = modules::load_bytes(&path, module.bytes().to_vec(), &options).map_err(|why| why.to_string())?;
        self.enter(key, &loaded.blocks, &(Arc::new(module) as Keeper));
        Ok(())
    }

    /// Registers blocks that are already loaded.
    pub fn enter(&mut self, key: &str, faces: &[BlockFace], keeper: &Keeper) {
        for face in faces {
            self.known.insert(CodeName { module: key.to_owned(), block: face.name.clone() }, (face.descriptor, keeper.clone()));
        }
    }

    /// Returns the code of a block, and the owner that keeps it loaded.
    pub fn find(&self, name: &CodeName) -> Option<(&'static Descriptor, Keeper)> {
        self.known.get(name).cloned()
    }
}
