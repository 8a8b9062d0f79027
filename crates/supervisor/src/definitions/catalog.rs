// SPDX-License-Identifier: Apache-2.0
//! Catalogue of available code: the library, and downloaded modules.
use indexmap::IndexMap;
use model::interface::Interface;
use opengpac::abi::Descriptor;
use std::any::Any;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

/// An installable block.
#[derive(Clone)]
pub(crate) struct Code {
    pub descriptor: &'static Descriptor,
    /// Keeps the module loaded.
    pub module: Arc<dyn Any + Send + Sync>,
    pub interface: Arc<Interface>,
}

/// All blocks by `module.block`. A module replaces a previous one with the same name; existing instances continue to use the old one.
#[derive(Default)]
pub(crate) struct Catalog {
    pub blocks: HashMap<String, Code>,
    /// Declarations of struct types, by module.
    pub modules: IndexMap<String, IndexMap<String, String>>,
    /// SHA-256 digests of all shared objects added so far.
    pub digests: BTreeSet<String>,
}

impl Catalog {
    /// Adds a module.
    pub fn enter(&mut self, module: &str, types: IndexMap<String, String>, blocks: Vec<Code>) {
        let prefix = format!("{module}.");
        self.blocks.retain(|name, _| !name.starts_with(&prefix));
        if let Some(code) = blocks.first().and_then(|code| rtp::Module::of(&code.module)).filter(|code| !code.bytes().is_empty()) {
            self.digests.insert(code.sha256());
        }
        for code in blocks {
            self.blocks.insert(code.interface.name.clone(), code);
        }
        self.modules.insert(module.to_owned(), types);
    }

    /// Returns the current shared objects by module name.
    pub fn code(&self) -> Vec<(String, Vec<u8>)> {
        let mut found: BTreeMap<&str, Vec<u8>> = BTreeMap::new();
        for code in self.blocks.values() {
            let Some(module) = rtp::Module::of(&code.module).filter(|module| !module.bytes().is_empty()) else { continue };
            found.entry(module.name()).or_insert_with(|| module.bytes().to_vec());
        }
        found.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect()
    }
}
