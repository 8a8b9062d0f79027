// SPDX-License-Identifier: Apache-2.0
//! Sources elsewhere: in another process of this host, or on another one. The host here keeps them by number like its own; who runs them
//! stands behind [`Far`].
//!
//! A verb instance whose sources all lie in one place has its word there: kernels react to its conditions in the same firing,
//! as everywhere, and who takes it asks there. The word of one whose sources lie in several places is here; kernels elsewhere only tell
//! what was reported, and it is served when that arrives.
use crate::relay::Wanted;
use crate::{BlockId, BlockTimes, Script, SourceId, Statistics, Taken};
use interconnect::{ConnectionSpec, EndError, Full, Header, Receiver, Sender};
use std::sync::Arc;

/// Whoever runs sources elsewhere. All calls come from ordinary threads; none waits longer than the link to it lives.
pub trait Far: Send + Sync {
    /// Hands a script to a source there. Its acknowledgement comes back by [`Host::tell`](crate::Host::tell).
    fn submit(&self, source: SourceId, script: Box<Script>);

    /// Requests a firing of a software source there.
    fn request(&self, source: SourceId);

    /// Restarts a source there that a fault stopped.
    fn restart(&self, source: SourceId);

    /// Counters and histograms of a source, as it told last.
    fn statistics(&self, source: SourceId) -> Statistics;

    /// [`Host::probe`](crate::Host::probe), there.
    fn probe(&self, source: SourceId, for_ns: u64);

    /// How long the invocations of a block there took, as it told last.
    fn block_times(&self, block: BlockId) -> BlockTimes;

    /// [`Process::take`](crate::Process::take), there. `None`: nobody answers any more.
    fn take(&self, process: u64, generation: u32, insist: bool) -> Option<Taken>;

    /// A process whose sources lie in several places is in this stage from now on: what is reported there belongs to it.
    fn enter(&self, process: u64, stage: u16, generation: u32);

    /// Sets or clears the flag that every write of a device there obeys.
    fn stop(&self, set: bool);

    /// The host on which it runs; none where that is this one.
    fn host(&self) -> Option<&str>;

    /// The writing end here of a connection to it.
    ///
    /// # Errors
    /// What keeps it from being made.
    fn sender(&self, number: u64, spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError>;

    /// The reading end here of a connection from it.
    ///
    /// # Errors
    /// As for `sender`.
    fn receiver(&self, number: u64, spec: &ConnectionSpec, raise: Box<dyn Fn() + Send + Sync>) -> Result<Box<dyn Receiver>, EndError>;

    /// Ends it: its sources stop, its devices are safe.
    fn close(&self);
}

/// How far apart the ends of a connection lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Reach {
    /// In one process.
    Process,
    /// In two processes of one host.
    Host,
    /// On two hosts.
    Network,
}

/// A connection by name: what both of its ends are made with, wherever they lie.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// Never given twice in a system.
    pub number: u64,
    /// Its two sources and its lengths.
    pub spec: ConnectionSpec,
    /// How far apart its ends lie.
    pub reach: Reach,
}

/// An end of a connection over which nothing goes and nothing comes: one that lies elsewhere, in the tables that are kept here and that nothing
/// here runs ([`Nowhere::default`]); or one that could not be made, in a table that is run ([`Nowhere::of`]).
#[derive(Default)]
pub struct Nowhere {
    group: Vec<u8>,
    /// Of an end that lies elsewhere: what hands its values on goes on as long as this is here.
    _wanted: Option<Arc<Wanted>>,
}

impl Nowhere {
    /// In the place of an end of `spec` that could not be made: what is published goes nowhere, a row finds no room.
    pub fn of(spec: &ConnectionSpec) -> Nowhere {
        Nowhere { group: vec![0; spec.asynchronous_len], _wanted: None }
    }

    /// In the place of an end that lies elsewhere, of a connection that goes through here.
    pub(crate) fn relayed(wanted: Option<Arc<Wanted>>) -> Nowhere {
        Nowhere { group: Vec::new(), _wanted: wanted }
    }
}

impl Sender for Nowhere {
    fn group(&mut self) -> &mut [u8] {
        &mut self.group
    }

    fn publish(&mut self, _number: u64, _now_ns: i64) {}

    fn push(&mut self, _number: u64, _now_ns: i64, _fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        Err(Full)
    }

    fn arrived(&self) -> bool {
        false
    }
}

impl Receiver for Nowhere {
    fn latch(&mut self, _now_ns: i64) -> Option<Header> {
        None
    }

    fn group(&self) -> &[u8] {
        &self.group
    }

    fn peek_row(&mut self) -> Option<(u64, &[u8])> {
        None
    }

    fn pop_row(&mut self) -> bool {
        false
    }

    fn rows(&self) -> usize {
        0
    }
}
