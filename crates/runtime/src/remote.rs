// SPDX-License-Identifier: Apache-2.0
//! Remote sources, in another process of this host or on another host. The local host numbers them like its own; their host is accessed
//! through [`Remote`].
//!
//! The word of a verb instance whose sources all run in one processor process is kept in that process: kernels react to its conditions in
//! the same firing, as usual, and the supervisor sends a request to take it. The word of an instance spread over several processes is
//! kept locally; remote kernels only report conditions, which are served on arrival.
use interconnect::{ConnectionSpec, EndError, Receiver, Sender};
use kernel::{BlockId, BlockTimes, RemoteWord, Script, SourceId, Statistics};

/// Host of remote sources. All calls are made by ordinary threads, and return at the latest when the link to that host is closed.
pub trait Remote: RemoteWord {
    /// Submits a script to a remote source. Its acknowledgement is returned through [`Host::tell`](crate::Host::tell).
    fn submit(&self, source: SourceId, script: Box<Script>);

    /// Requests a firing of a remote software source.
    fn request(&self, source: SourceId);

    /// Restarts a remote source that a fault stopped.
    fn restart(&self, source: SourceId);

    /// Returns the counters and histograms of a source, as last reported.
    fn statistics(&self, source: SourceId) -> Statistics;

    /// Probes a remote source, as [`Host::probe`](crate::Host::probe) does locally.
    fn probe(&self, source: SourceId, for_ns: u64);

    /// Returns the durations of the invocations of a remote block, as last reported.
    fn block_times(&self, block: BlockId) -> BlockTimes;

    /// Enters a stage of a process whose sources are in several locations; later reports of the remote kernels refer to it.
    fn enter(&self, process: u64, stage: u16, generation: u32);

    /// Sets or clears the flag that every write of a remote device obeys.
    fn stop(&self, set: bool);

    /// Returns the name of the remote host; `None` for this host.
    fn host(&self) -> Option<&str>;

    /// Returns the local writing end of a connection to the remote host.
    ///
    /// # Errors
    /// Fails if the end cannot be created.
    fn sender(&self, number: u64, spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError>;

    /// Returns the local reading end of a connection from the remote host.
    ///
    /// # Errors
    /// Same as for `sender`.
    fn receiver(&self, number: u64, spec: &ConnectionSpec, raise: Box<dyn Fn() + Send + Sync>) -> Result<Box<dyn Receiver>, EndError>;

    /// Closes the remote host: its sources stop, and its devices are made safe.
    fn close(&self);
}
