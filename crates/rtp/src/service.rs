// SPDX-License-Identifier: Apache-2.0
//! Services that a process gives to its processor.
use interconnect::{Ends, Link};
use kernel::Device;
use modules::Probe;
use std::sync::Arc;
use std::time::Duration;

/// Carrier of connections out of the process.
#[derive(Default)]
pub struct Reaches {
    /// To other processes of this host.
    pub host: Option<Box<dyn Ends>>,
    /// To other hosts.
    pub network: Option<Box<dyn Ends>>,
}

/// Told of a device that was opened (`true`) or is closed.
pub type OnDevice = Arc<dyn Fn(&Device, bool) + Send + Sync>;

/// Called every 20 ms with how long those who watch this process may stand still: whether both, the guard and the supervisor, have done so for
/// longer.
pub type UnwatchedCheck = Arc<dyn Fn(Duration) -> bool + Send + Sync>;

/// Called every 20 ms with the index of the timer, by the order in which the sources here were made, that no longer fires; none while all serve.
pub type Beats = Arc<dyn Fn(Option<usize>) + Send + Sync>;

/// Rests for so long; true: the commander is dying, and will say nothing more.
pub type Rests = Arc<dyn Fn(Duration) -> bool + Send + Sync>;

/// Services that a process gives to its processor.
pub struct Service {
    /// Carrier of connections out of the process.
    pub reaches: Reaches,
    /// Memory in which sources say which block runs, and its size in bytes: zero, on a cache line, for as long as the process lives.
    pub black_box: Option<BlackBox>,
    /// Address where a new supervisor knocks, for a process that goes on without one for a while; none: it cannot be taken over.
    pub door: Option<Box<dyn Door>>,
    /// The supervisor that commands it.
    pub terms: Terms,
}

/// State that is the same for all commanders of a processor, one after the other.
pub struct Terms {
    /// Tries code modules in a process of their own.
    pub probe: Probe,
    /// The epoch of the system on this host's CLOCK_MONOTONIC, of that on the commanding host's.
    pub epoch: Arc<dyn Fn(i64) -> i64 + Send + Sync>,
    /// Told of each device that is opened (`true`) or closed.
    pub device: OnDevice,
    /// Word of the heart.
    pub beat: Beats,
    /// Returns whether guard and supervisor both stand still; false where nobody needs to watch it.
    pub unwatched: UnwatchedCheck,
    /// Rests between two beats of the heart.
    pub rests: Rests,
    /// Ends the process where the supervisor is gone without a word, with its outputs safe and its devices open: what outlives it is
    /// found as it was by a supervisor that comes back. For a process that has nothing else to do.
    pub leaves: bool,
}

/// Memory where sources say which block runs: zero, on a cache line, for as long as the process lives.
#[derive(Clone, Copy)]
pub struct BlackBox {
    /// Its first byte.
    pub memory: *mut u8,
    /// Bytes.
    pub len: usize,
}

// SAFETY: an address that the one who serves hands to its host.
unsafe impl Send for BlackBox {}

/// Rests, for places where the death of the commander shows only by its broken link.
fn rest(span: Duration) -> bool {
    std::thread::sleep(span);
    false
}

impl Service {
    /// Makes a service without connections that cannot be taken over.
    pub fn new(terms: Terms) -> Service {
        Service { reaches: Reaches::default(), black_box: None, door: None, terms }
    }
}

impl Terms {
    /// Makes terms without a guard.
    pub fn new(probe: Probe) -> Terms {
        let (epoch, device, beat) = (Arc::new(|epoch_ns| epoch_ns), Arc::new(|_: &Device, _: bool| {}), Arc::new(|_| {}));
        Terms { probe, epoch, device, beat, unwatched: Arc::new(|_| false), rests: Arc::new(rest), leaves: false }
    }
}

/// Door at which a supervisor that wants to command this processor announces itself.
pub trait Door: Send {
    /// Returns the supervisor that knocks, after waiting for at most `limit`.
    fn wait(&mut self, limit: Duration) -> Option<Box<dyn Caller>>;
}

/// A supervisor that wants to command this processor.
pub trait Caller: Send {
    /// Turns it away; `why`: in words.
    fn refuse(self: Box<Self>, why: &str);

    /// Lets it in.
    ///
    /// # Errors
    /// In words: it is gone, or of another version.
    fn admit(self: Box<Self>) -> Result<AdmittedSupervisor, String>;
}

/// Supervisor that was let in: it greets next.
pub struct AdmittedSupervisor {
    /// To it.
    pub link: Arc<dyn Link>,
    /// Carrier of the connections of its system.
    pub reaches: Reaches,
    /// Memory in which its sources say which block runs.
    pub black_box: Option<BlackBox>,
    /// The guard before is gone: devices are to be told of again.
    pub is_unguarded: bool,
}
