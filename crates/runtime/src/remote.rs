// SPDX-License-Identifier: Apache-2.0
//! Remote sources: in another process of this host, or on another one. The host here keeps them by number like its own; what runs them
//! stands behind [`Remote`].
//!
//! A verb instance whose sources all lie in one place has its word there: kernels react to its conditions in the same firing,
//! as everywhere, and who takes it asks there. The word of one whose sources lie in several places is here; remote kernels only tell
//! what was reported, and it is served when that arrives.
use interconnect::{ConnectionSpec, EndError, Receiver, Sender};
use kernel::{BlockId, BlockTimes, RemoteWord, Script, SourceId, Statistics};

/// Host of remote sources. All calls come from ordinary threads; none waits longer than the link to it lives.
pub trait Remote: RemoteWord {
    /// Hands a script to a source there. Its acknowledgement comes back by [`Host::tell`](crate::Host::tell).
    fn submit(&self, source: SourceId, script: Box<Script>);

    /// Requests a firing of a software source there.
    fn request(&self, source: SourceId);

    /// Restarts a source there that a fault stopped.
    fn restart(&self, source: SourceId);

    /// Counters and histograms of a source, as it told last.
    fn statistics(&self, source: SourceId) -> Statistics;

    /// Probes there, as [`Host::probe`](crate::Host::probe) does here.
    fn probe(&self, source: SourceId, for_ns: u64);

    /// Returns the durations of the invocations of a block there, as it told last.
    fn block_times(&self, block: BlockId) -> BlockTimes;

    /// Enters a stage of a process whose sources lie in several places: later reports there belong to it.
    fn enter(&self, process: u64, stage: u16, generation: u32);

    /// Sets or clears the flag that every write of a device there obeys.
    fn stop(&self, set: bool);

    /// Returns the host on which it runs; none if that is this one.
    fn host(&self) -> Option<&str>;

    /// Returns the writing end here of a connection to it.
    ///
    /// # Errors
    /// What keeps it from being made.
    fn sender(&self, number: u64, spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError>;

    /// Returns the reading end here of a connection from it.
    ///
    /// # Errors
    /// As for `sender`.
    fn receiver(&self, number: u64, spec: &ConnectionSpec, raise: Box<dyn Fn() + Send + Sync>) -> Result<Box<dyn Receiver>, EndError>;

    /// Ends it: its sources stop, its devices are safe.
    fn close(&self);
}
