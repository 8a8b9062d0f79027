// SPDX-License-Identifier: Apache-2.0
//! Receiver of what the parts of this crate tell people.
use rtp::Tell;
use std::sync::{Arc, OnceLock};

/// The system's log, from when it is known; what is told before that is for nobody.
#[derive(Clone, Default)]
pub(crate) struct Telling(Arc<OnceLock<Tell>>);

impl Telling {
    /// Sets the receiver; once.
    pub fn to(&self, tell: Tell) {
        // A second one would be of the same system.
        let _first = self.0.set(tell);
    }

    /// Tells it: of which kind it is, what it is about, the text.
    pub fn tell(&self, kind: &'static str, about: &str, text: String) {
        if let Some(tell) = self.0.get() {
            tell(kind, about, text);
        }
    }
}
