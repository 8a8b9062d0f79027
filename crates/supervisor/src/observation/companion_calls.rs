// SPDX-License-Identifier: Apache-2.0
//! Calls for companions and observers.
use crate::observation::companions::Companion;
use crate::system::System;
use std::sync::Arc;

impl System {
    /// Adds a companion, which ends with the system, and returns its number.
    pub fn accompany(&self, companion: Arc<dyn Companion>) -> u64 {
        let mut companions = self.shared.companions.lock().expect("nobody panics with the lock held");
        companions.last += 1;
        let number = companions.last;
        companions.present.insert(number, companion);
        number
    }

    /// Returns the companion with this number.
    pub fn companion(&self, number: u64) -> Option<Arc<dyn Companion>> {
        self.shared.companions.lock().expect("nobody panics with the lock held").present.get(&number).cloned()
    }

    /// Removes a companion.
    pub fn dismiss(&self, number: u64) {
        // Dropped outside the lock: its end may take time.
        let _gone = self.shared.companions.lock().expect("nobody panics with the lock held").present.remove(&number);
    }

    pub(crate) fn end_companions(&self) {
        let present: Vec<_> = self.shared.companions.lock().expect("nobody panics with the lock held").present.values().cloned().collect();
        present.iter().for_each(|companion| companion.end());
    }

    /// Returns a handle of the same system for an observer; dropping the handle does not close the system.
    pub fn observer(&self) -> System {
        System::of(&self.name, self.shared.clone())
    }
}
