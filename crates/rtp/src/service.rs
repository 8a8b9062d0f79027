// SPDX-License-Identifier: Apache-2.0
//! Services that a process provides to its processor.
use interconnect::{Ends, Link};
use kernel::Device;
use modules::Probe;
use std::sync::Arc;
use std::time::Duration;

/// Carriers of connections that leave the process.
#[derive(Default)]
pub struct Reaches {
    /// Carrier to other processes of this host.
    pub host: Option<Box<dyn Ends>>,
    /// Carrier to other hosts.
    pub network: Option<Box<dyn Ends>>,
}

/// Called with a device that has been opened (`true`) or is being closed (`false`).
pub type OnDevice = Arc<dyn Fn(&Device, bool) + Send + Sync>;

/// Called every 20 ms with the maximum stall of the watchers of this process; returns true if both the guard and the supervisor have
/// exceeded it.
pub type UnwatchedCheck = Arc<dyn Fn(Duration) -> bool + Send + Sync>;

/// Called every 20 ms with the index, in the order of creation of the local sources, of the timer that no longer fires; `None` while all
/// serve.
pub type Beats = Arc<dyn Fn(Option<usize>) + Send + Sync>;

/// Function that sleeps for the given time, and returns true if the commander is dying and will not send anything else.
pub type Rests = Arc<dyn Fn(Duration) -> bool + Send + Sync>;

/// Services that a process provides to its processor.
pub struct Service {
    /// Carriers of connections that leave the process.
    pub reaches: Reaches,
    /// Memory in which sources record the running block: zeroed, aligned to a cache line, valid for the lifetime of the process.
    pub black_box: Option<BlackBox>,
    /// Door at which a new supervisor connects, for a process that continues without one for a while; `None` if the process cannot be
    /// taken over.
    pub door: Option<Box<dyn Door>>,
    /// Terms under which supervisors command the processor.
    pub terms: Terms,
}

/// State shared by the successive commanders of a processor.
pub struct Terms {
    /// Tries code modules in a separate process.
    pub probe: Probe,
    /// Converts the system's epoch from the commanding host's CLOCK_MONOTONIC to this host's.
    pub epoch: Arc<dyn Fn(i64) -> i64 + Send + Sync>,
    /// Called with each device that has been opened (`true`) or is being closed (`false`).
    pub device: OnDevice,
    /// Called by the heart at each beat.
    pub beat: Beats,
    /// Returns true if both the guard and the supervisor have stalled; false if no watcher is required.
    pub unwatched: UnwatchedCheck,
    /// Sleeps between two beats of the heart.
    pub rests: Rests,
    /// True if the process exits when the supervisor disconnects without notice, with its outputs safe and its devices open, so that a
    /// returning supervisor finds external state unchanged. Intended for a process that has no other purpose.
    pub leaves: bool,
}

/// Memory in which sources record the running block: zeroed, aligned to a cache line, valid for the lifetime of the process.
#[derive(Clone, Copy)]
pub struct BlackBox {
    /// Address of the first byte.
    pub memory: *mut u8,
    /// Length in bytes.
    pub len: usize,
}

// SAFETY: an address that the one who serves hands to its host.
unsafe impl Send for BlackBox {}

/// Sleeps. For environments in which the death of the commander can be detected only by its broken link.
fn rest(span: Duration) -> bool {
    std::thread::sleep(span);
    false
}

impl Service {
    /// Creates a service that has no connections and cannot be taken over.
    pub fn new(terms: Terms) -> Service {
        Service { reaches: Reaches::default(), black_box: None, door: None, terms }
    }
}

impl Terms {
    /// Creates terms without a guard.
    pub fn new(probe: Probe) -> Terms {
        let (epoch, device, beat) = (Arc::new(|epoch_ns| epoch_ns), Arc::new(|_: &Device, _: bool| {}), Arc::new(|_| {}));
        Terms { probe, epoch, device, beat, unwatched: Arc::new(|_| false), rests: Arc::new(rest), leaves: false }
    }
}

/// Door at which a new supervisor asks to command this processor.
pub trait Door: Send {
    /// Returns the next supervisor that connects, after waiting for at most `limit`.
    fn wait(&mut self, limit: Duration) -> Option<Box<dyn Caller>>;
}

/// A supervisor that asks to command this processor.
pub trait Caller: Send {
    /// Rejects the supervisor; `why`: human-readable reason.
    fn refuse(self: Box<Self>, why: &str);

    /// Admits the supervisor.
    ///
    /// # Errors
    /// Fails with a message if the supervisor has disconnected, or its version differs.
    fn admit(self: Box<Self>) -> Result<AdmittedSupervisor, String>;
}

/// An admitted supervisor, whose greeting follows.
pub struct AdmittedSupervisor {
    /// To it.
    pub link: Arc<dyn Link>,
    /// Carriers of the connections of the supervisor's system.
    pub reaches: Reaches,
    /// Memory in which the supervisor's sources record the running block.
    pub black_box: Option<BlackBox>,
    /// True if the previous guard has exited, so that devices must be registered again.
    pub is_unguarded: bool,
}
