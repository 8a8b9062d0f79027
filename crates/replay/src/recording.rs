// SPDX-License-Identifier: Apache-2.0
//! A record in progress: the items that the kernels have written, and the code that these items need.
use rtp::Module;
use runtime::trace::{CodeNames, Entry, Trace};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// Item of a record. Items must be played in order.
#[derive(Debug, Serialize, Deserialize)]
pub enum Item {
    /// Code of blocks that later items use.
    Module {
        /// Key by which scripts refer to the module.
        key: String,
        /// Name of the module.
        name: String,
        /// Shared object.
        bytes: Vec<u8>,
    },
    /// Item written by a host.
    Entry(Entry),
}

impl Item {
    /// Serialises the item for a record.
    ///
    /// # Panics
    /// Never: any item can be serialised.
    pub fn bytes(&self) -> Vec<u8> {
        postcard::to_allocvec(self).expect("every item can be written")
    }

    /// Parses an item from the bytes of a record.
    ///
    /// # Errors
    /// Fails with a message if the bytes are not an item or have a different version.
    pub fn of(bytes: &[u8]) -> Result<Item, String> {
        postcard::from_bytes(bytes).map_err(|why| format!("an item of the record cannot be read ({why}): it is damaged, or of another version of OpenGPAC"))
    }

    /// Returns the reason why the record cannot be replayed beyond this item, if the item contains one.
    pub fn broken(&self) -> Option<&str> {
        if let Item::Entry(Entry::Broken(why)) = self { Some(why) } else { None }
    }

    /// Returns the source and the release time of the event, ns on the clock; `None` if the item only prepares the run.
    pub fn time_ns(&self) -> Option<i64> {
        if let Item::Entry(Entry::Stretch(_, stretch)) = self { Some(stretch.time_ns) } else { None }
    }
}

/// Code that scripts refer to, by key.
type Modules = Arc<Mutex<HashMap<String, Code>>>;

struct Code {
    name: String,
    bytes: Vec<u8>,
    is_taken: bool,
}

/// Gathers the items of a record in progress. Dropping it ends the record.
pub struct Recording {
    trace: Arc<Trace>,
    modules: Modules,
    entries: Vec<Entry>,
}

impl Recording {
    /// Starts a record. `begin` receives the names by which the record refers to code, and returns the trace of the recorded host.
    ///
    /// # Errors
    /// Fails as `begin` does.
    pub fn begin<E>(begin: impl FnOnce(CodeNames) -> Result<Arc<Trace>, E>) -> Result<Recording, E> {
        let modules = Modules::default();
        let known = modules.clone();
        let names: CodeNames = Box::new(move |block| {
            let name = rtp::name_of(block)?;
            if let (Some(module), Ok(mut known)) = (Module::of(block.module()), known.lock()) {
                known.entry(name.module.clone()).or_insert_with(|| Code { name: module.name().to_owned(), bytes: module.bytes().to_vec(), is_taken: false });
            }
            Some(name)
        });
        Ok(Recording { trace: begin(names)?, modules, entries: Vec::new() })
    }

    /// Appends the items recorded since the last call to `out`, in order. Call this regularly, and from one thread only: when the buffer
    /// is full, items are lost, and the record contains the number of lost items.
    pub fn take(&mut self, out: &mut Vec<Item>) {
        self.trace.take(&mut self.entries);
        // The code of the items just taken is registered by now.
        if let Ok(mut modules) = self.modules.lock() {
            for (key, code) in modules.iter_mut().filter(|(_, code)| !code.is_taken) {
                code.is_taken = true;
                let bytes = std::mem::take(&mut code.bytes);
                // The player brings the library itself.
                if !bytes.is_empty() {
                    out.push(Item::Module { key: key.clone(), name: code.name.clone(), bytes });
                }
            }
        }
        out.extend(self.entries.drain(..).map(Item::Entry));
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        self.trace.abandon();
    }
}
