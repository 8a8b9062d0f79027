// SPDX-License-Identifier: Apache-2.0
//! Code modules, as sent to processors.
use runtime::encoding::CodeName;
use sha2::{Digest, Sha256};
use std::any::Any;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

/// Key of the blocks that are built into every processor.
pub(crate) const LIBRARY: &str = "library";

/// A code module that can be sent to a remote processor. A block keeps it as the owner of its code.
pub struct Module {
    key: String,
    name: String,
    bytes: Arc<[u8]>,
}

impl Module {
    /// Creates the entry of the library, which every processor has.
    pub fn library() -> Module {
        Module { key: LIBRARY.to_owned(), name: LIBRARY.to_owned(), bytes: Arc::default() }
    }

    /// Creates a module from a shared object. Two modules with the same bytes are identical.
    pub fn new(name: &str, bytes: Arc<[u8]>) -> Module {
        let mut hasher = DefaultHasher::new();
        bytes.hash(&mut hasher);
        Module { key: format!("{name}:{:016x}:{}", hasher.finish(), bytes.len()), name: name.to_owned(), bytes }
    }

    /// Returns the key of the module, which is the same on both sides.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Returns the human-readable name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the shared object; empty for the library.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the SHA-256 of the shared object, in hexadecimal digits.
    pub fn sha256(&self) -> String {
        sha256(&self.bytes)
    }

    /// Returns the module that a block keeps as the owner of its code, if it can be sent.
    pub fn of(keeper: &Arc<dyn Any + Send + Sync>) -> Option<&Module> {
        keeper.downcast_ref()
    }
}

/// Returns the SHA-256 of a shared object, in hexadecimal digits, which identifies the code.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns the name of a block's code, if it can be sent.
pub fn name_of(block: &kernel::Block) -> Option<CodeName> {
    let module = Module::of(block.module())?;
    Some(CodeName { module: module.key.clone(), block: block.code_name().to_owned() })
}
