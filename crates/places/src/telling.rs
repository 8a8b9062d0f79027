// SPDX-License-Identifier: Apache-2.0
//! Receiver of messages that this crate sends to users.
use rtp::Tell;
use std::sync::{Arc, OnceLock};

/// Log of the system; messages sent before it is set are dropped.
#[derive(Clone, Default)]
pub(crate) struct Telling(Arc<OnceLock<Tell>>);

impl Telling {
    /// Sets the receiver. Can be called once.
    pub fn to(&self, tell: Tell) {
        // A second receiver would belong to the same system.
        let _first = self.0.set(tell);
    }

    /// Reports a message with its kind, subject and text.
    pub fn tell(&self, kind: &'static str, about: &str, text: String) {
        if let Some(tell) = self.0.get() {
            tell(kind, about, text);
        }
    }
}
