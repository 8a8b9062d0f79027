// SPDX-License-Identifier: Apache-2.0
//! Slots that the bridge serves: one for each end of a connection, and one for each link.
use crate::bell::SLOTS;
use interconnect::EndError;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Work of the bridge for an end or a link. Times are on the host's CLOCK_MONOTONIC.
pub(crate) trait BridgeWork: Send + Sync {
    /// Handles a ring of the bell by the real-time end.
    fn rung(&self, now_ns: i64);

    /// Sends packets that have become due. Returns false if no packet will ever be due again.
    fn tick(&self, now_ns: i64) -> bool;

    /// Handles the recovery of the connection.
    fn again(&self, now_ns: i64);

    /// Handles the departure of the host with this number.
    fn lose(&self, _host: u64) {}

    /// Returns true if no packet is waiting to be sent.
    fn is_idle(&self) -> bool {
        true
    }
}

#[derive(Default)]
pub(crate) struct Slots(Mutex<Vec<Option<Arc<dyn BridgeWork>>>>);

impl Slots {
    /// Claims a free slot for the object that `make` creates from the slot's number.
    pub(crate) fn take<S: BridgeWork + 'static>(&self, make: impl FnOnce(usize) -> Arc<S>) -> Result<Arc<S>, EndError> {
        let mut slots = self.all();
        let free = slots.iter().position(Option::is_none).unwrap_or(slots.len());
        if free == SLOTS {
            return Err(EndError {
                message: format!("this host already has {SLOTS} ends of connections, the maximum; delete verb instances, or share the work with another host"),
            });
        }
        let served = make(free);
        if free == slots.len() {
            slots.push(None);
        }
        slots[free] = Some(served.clone());
        Ok(served)
    }

    pub(crate) fn at(&self, slot: usize) -> Option<Arc<dyn BridgeWork>> {
        self.all().get(slot).cloned().flatten()
    }

    /// Calls `each` for every slot, and frees those for which it returns false.
    pub(crate) fn keep(&self, each: impl Fn(&dyn BridgeWork) -> bool) {
        let served: Vec<_> = self.all().iter().cloned().enumerate().collect();
        for (slot, served) in served.into_iter().filter_map(|(slot, served)| Some((slot, served?))) {
            if !each(served.as_ref()) {
                self.all()[slot] = None;
            }
        }
    }

    /// Calls `each` for every slot.
    pub(crate) fn each(&self, each: impl Fn(&dyn BridgeWork)) {
        self.keep(|served| {
            each(served);
            true
        });
    }

    fn all(&self) -> MutexGuard<'_, Vec<Option<Arc<dyn BridgeWork>>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
