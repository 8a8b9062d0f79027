// SPDX-License-Identifier: Apache-2.0
//! A record while it is made: what the kernels wrote down, and the code that it needs.
use rtp::Module;
use runtime::trace::{CodeNames, Entry, Trace};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// One item of a record. They are needed in the order in which they come.
#[derive(Debug, Serialize, Deserialize)]
pub enum Item {
    /// The code of blocks that come behind it.
    Module {
        /// Name by which scripts call it.
        key: String,
        /// Its name.
        name: String,
        /// The shared object.
        bytes: Vec<u8>,
    },
    /// Item that a host wrote down.
    Entry(Entry),
}

impl Item {
    /// Returns it as bytes, as a record keeps it.
    ///
    /// # Panics
    /// Never: an item has nothing that cannot be written.
    pub fn bytes(&self) -> Vec<u8> {
        postcard::to_allocvec(self).expect("every item can be written")
    }

    /// Reads it from the bytes of a record.
    ///
    /// # Errors
    /// In words: they are none, or of another version.
    pub fn of(bytes: &[u8]) -> Result<Item, String> {
        postcard::from_bytes(bytes).map_err(|why| format!("an item of the record cannot be read ({why}): it is damaged, or of another version of OpenGPAC"))
    }

    /// Returns why the record cannot be run again from here on, if that is what it says.
    pub fn broken(&self) -> Option<&str> {
        if let Item::Entry(Entry::Broken(why)) = self { Some(why) } else { None }
    }

    /// Returns source and release of what happened, ns on the clock; none for what only prepares.
    pub fn time_ns(&self) -> Option<i64> {
        if let Item::Entry(Entry::Stretch(_, stretch)) = self { Some(stretch.time_ns) } else { None }
    }
}

/// The code that scripts have named, by key.
type Modules = Arc<Mutex<HashMap<String, Code>>>;

struct Code {
    name: String,
    bytes: Vec<u8>,
    is_taken: bool,
}

/// Gathers the items of a record that is being made. Dropping it ends the writing.
pub struct Recording {
    trace: Arc<Trace>,
    modules: Modules,
    entries: Vec<Entry>,
}

impl Recording {
    /// Begins a record: `begin` is given how code is called in it, and gives the trace of the host that is recorded.
    ///
    /// # Errors
    /// Those of `begin`.
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

    /// Takes what has come since the last call, in order. To be called often enough by one thread: what found no room is lost, and the record says
    /// how much.
    pub fn take(&mut self, out: &mut Vec<Item>) {
        self.trace.take(&mut self.entries);
        // The code of what has just been taken is known by now.
        if let Ok(mut modules) = self.modules.lock() {
            for (key, code) in modules.iter_mut().filter(|(_, code)| !code.is_taken) {
                code.is_taken = true;
                let bytes = std::mem::take(&mut code.bytes);
                // The library comes with the player.
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
