// SPDX-License-Identifier: Apache-2.0
//! State shared by the threads of a processor.
use device::Beside;
use interconnect::Link;
use kernel::{Device, SourceId};
use runtime::Host;
use runtime::encoding::Reader;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// Devices opened in this processor, by name.
pub(crate) type Devices = Mutex<BTreeMap<String, Arc<Device>>>;

/// State shared by the threads of a processor.
pub(crate) struct ProcessorState {
    pub host: Arc<Host>,
    pub link: Arc<dyn Link>,
    pub reader: Mutex<Reader>,
    pub devices: Arc<Devices>,
    /// Services and counters of the devices' drivers.
    pub besides: Mutex<BTreeMap<String, Beside>>,
    /// Sources that run here.
    pub sources: Mutex<Vec<SourceId>>,
    /// True if the heart of the process beats for the local sources; initially false if another agent's processes already run here.
    pub leads: AtomicBool,
    pub ends: AtomicBool,
    /// While set, every write of a device outputs the safe values.
    pub stop: Arc<AtomicBool>,
    /// Maximum silence of the commander, ms; 0 if unlimited.
    pub silence_ms: AtomicU64,
}

impl ProcessorState {
    /// Returns true if the commander has been silent for too long.
    pub fn is_over(&self, silence: Duration) -> bool {
        let limit_ms = self.silence_ms.load(Ordering::Acquire);
        limit_ms != 0 && silence > Duration::from_millis(limit_ms)
    }
}

/// Maximum wait for a frame before the other checks are made.
pub(crate) const LOOK: Duration = Duration::from_millis(100);

pub(crate) fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().expect("nobody panics with the lock held")
}
