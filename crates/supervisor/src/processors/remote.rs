// SPDX-License-Identifier: Apache-2.0
//! Processors that run in processes of their own, several in one, or on other hosts; everything else treats their sources like any other.
//!
//! Those that share a process are one [`Processor`] of `rtp`: it has the sources of all of them, so that what is between them is within one
//! host there, as between threads here.
use indexmap::IndexMap;
use process_kit::Restarts;
use rtp::Processor;
use std::collections::HashMap;
use std::sync::Arc;

/// The remote processors of a system. A source is named `processor.source`.
#[derive(Default)]
pub(crate) struct Remote {
    /// Processors by their names; those that share a process have one [`Processor`].
    pub processors: IndexMap<String, Arc<Processor>>,
    /// Processes of this host but this one, as they were asked for, with the processors in each.
    pub processes: IndexMap<String, Vec<String>>,
    /// Number of new processes that each of them may get.
    pub restarts: HashMap<String, Restarts>,
}

impl Remote {
    /// Processes, each once however many processors it has, and processors on other hosts.
    pub fn places(&self) -> Vec<Arc<Processor>> {
        let mut places: Vec<Arc<Processor>> = Vec::new();
        for remote in self.processors.values() {
            if !places.iter().any(|known| Arc::ptr_eq(known, remote)) {
                places.push(remote.clone());
            }
        }
        places
    }

    /// Returns the name of a remote processor for people: its own, or if several may share it, that of its process.
    pub fn called(&self, remote: &Processor) -> String {
        let what = if self.processors.contains_key(remote.name()) { "processor" } else { "process" };
        format!("{what} '{}'", remote.name())
    }

    /// Returns the processors of a process, in the order in which they were made.
    pub fn processors_in(&self, remote: &Arc<Processor>) -> Vec<String> {
        self.processors.iter().filter(|(_, own)| Arc::ptr_eq(own, remote)).map(|(name, _)| name.clone()).collect()
    }

    /// Returns where a source runs, if not in this process.
    pub fn at(&self, source: &str) -> Option<&Arc<Processor>> {
        self.processors.get(processor_of(source))
    }

    /// Returns the unit that is lost with a source when its processor is lost: the process if several share one, else the processor.
    pub fn lost_place(&self, source: &str) -> String {
        self.at(source).map_or(processor_of(source), |remote| remote.name()).to_owned()
    }

    /// Returns false if a source belongs to a process or host that is gone, whether or not that was told of this source yet.
    pub fn is_reached(&self, source: &str) -> bool {
        self.at(source).is_none_or(|remote| remote.is_up())
    }

    /// Returns true if a source belongs to a processor of this process.
    pub fn runs_in(&self, source: &str, remote: &Arc<Processor>) -> bool {
        self.at(source).is_some_and(|own| Arc::ptr_eq(own, remote))
    }

    /// Returns why a source is lost, in full: its processor, and the process that went with it.
    pub fn loss_of(&self, source: &str, why: &str) -> String {
        let processor = processor_of(source);
        let process = self.at(source).map(|remote| remote.name()).filter(|process| *process != processor);
        let process = process.map(|process| format!(" with process '{process}'")).unwrap_or_default();
        format!("processor '{processor}' was lost{process}: {why}")
    }
}

/// Returns the processor of a source, by their name `processor.source`.
pub(crate) fn processor_of(source: &str) -> &str {
    source.split('.').next().unwrap_or_default()
}
