// SPDX-License-Identifier: Apache-2.0
//! Processors that run in separate processes, possibly several in one, or on other hosts. All other code treats their sources like any
//! others.
//!
//! Processors that share a process are represented by one [`Processor`] of `rtp`: it has the sources of all of them, so that
//! communication between them stays within one host, as it does between threads here.
use indexmap::IndexMap;
use process_kit::Restarts;
use rtp::Processor;
use std::collections::HashMap;
use std::sync::Arc;

/// Remote processors of a system. A source is named `processor.source`.
#[derive(Default)]
pub(crate) struct Remote {
    /// Processors by name; those that share a process have the same [`Processor`].
    pub processors: IndexMap<String, Arc<Processor>>,
    /// Other processes of this host, as requested, with the processors in each.
    pub processes: IndexMap<String, Vec<String>>,
    /// Restarts left for each process.
    pub restarts: HashMap<String, Restarts>,
}

impl Remote {
    /// Returns the processes, each only once even if it contains several processors, and the processors on other hosts.
    pub fn places(&self) -> Vec<Arc<Processor>> {
        let mut places: Vec<Arc<Processor>> = Vec::new();
        for remote in self.processors.values() {
            if !places.iter().any(|known| Arc::ptr_eq(known, remote)) {
                places.push(remote.clone());
            }
        }
        places
    }

    /// Returns the human-readable name of a remote processor: its own name, or the name of its process if several processors may share
    /// that process.
    pub fn called(&self, remote: &Processor) -> String {
        let what = if self.processors.contains_key(remote.name()) { "processor" } else { "process" };
        format!("{what} '{}'", remote.name())
    }

    /// Returns the processors in a process, in order of creation.
    pub fn processors_in(&self, remote: &Arc<Processor>) -> Vec<String> {
        self.processors.iter().filter(|(_, own)| Arc::ptr_eq(own, remote)).map(|(name, _)| name.clone()).collect()
    }

    /// Returns the remote processor that runs a source; `None` if the source runs in this process.
    pub fn at(&self, source: &str) -> Option<&Arc<Processor>> {
        self.processors.get(processor_of(source))
    }

    /// Returns the name of the unit that is lost together with a source: the process if several processors share it, otherwise the
    /// processor.
    pub fn lost_place(&self, source: &str) -> String {
        self.at(source).map_or(processor_of(source), |remote| remote.name()).to_owned()
    }

    /// Returns false if the process or host of a source is lost, even if the loss has not yet been reported for this source.
    pub fn is_reached(&self, source: &str) -> bool {
        self.at(source).is_none_or(|remote| remote.is_up())
    }

    /// Returns true if a source belongs to a processor of this process.
    pub fn runs_in(&self, source: &str, remote: &Arc<Processor>) -> bool {
        self.at(source).is_some_and(|own| Arc::ptr_eq(own, remote))
    }

    /// Returns the full reason why a source is lost, including its processor and the process that was lost with it.
    pub fn loss_of(&self, source: &str, why: &str) -> String {
        let processor = processor_of(source);
        let process = self.at(source).map(|remote| remote.name()).filter(|process| *process != processor);
        let process = process.map(|process| format!(" with process '{process}'")).unwrap_or_default();
        format!("processor '{processor}' was lost{process}: {why}")
    }
}

/// Returns the processor part of the name `processor.source`.
pub(crate) fn processor_of(source: &str) -> &str {
    source.split('.').next().unwrap_or_default()
}
