// SPDX-License-Identifier: Apache-2.0
//! Companions: what accompanies a system from outside the supervisor and ends with it, such as recordings; and observers.
use crate::system::System;
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Something that ends with the system.
pub trait Companion: Any + Send + Sync {
    /// The system closes: nothing moves any more, everything can still be read. Twice is once.
    fn end(&self);

    /// For who knows its type.
    fn as_any(self: Arc<Self>) -> Arc<dyn Any + Send + Sync>;
}

/// By their numbers.
#[derive(Default)]
pub(crate) struct Companions {
    last: u64,
    present: BTreeMap<u64, Arc<dyn Companion>>,
}

impl System {
    /// Ends with the system from now on. Its number.
    pub fn accompany(&self, companion: Arc<dyn Companion>) -> u64 {
        let mut companions = self.shared.companions.lock().expect("nobody panics with the lock held");
        companions.last += 1;
        let number = companions.last;
        companions.present.insert(number, companion);
        number
    }

    /// The companion of that number.
    pub fn companion(&self, number: u64) -> Option<Arc<dyn Companion>> {
        self.shared.companions.lock().expect("nobody panics with the lock held").present.get(&number).cloned()
    }

    /// It does not accompany the system any more.
    pub fn dismiss(&self, number: u64) {
        // Dropped outside the lock: it may take its time to end.
        let _gone = self.shared.companions.lock().expect("nobody panics with the lock held").present.remove(&number);
    }

    pub(crate) fn end_companions(&self) {
        let present: Vec<_> = self.shared.companions.lock().expect("nobody panics with the lock held").present.values().cloned().collect();
        present.iter().for_each(|companion| companion.end());
    }

    /// The same system for who only looks at it, however long: dropping this closes nothing.
    pub fn observer(&self) -> System {
        System::of(&self.name, self.shared.clone())
    }

    /// A recording has ended because its file cannot be written any more: a person is to know.
    pub fn recording_failed(&self, why: &str) {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.log.add(now_ns, "recorder", "system", why);
        core.alarm_recording(why);
    }

    /// Enters something into the log that somebody beside the supervisor has to tell.
    pub fn note(&self, kind: &'static str, about: &str, text: &str) {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        core.log.add(now_ns, kind, about, text);
    }
}
