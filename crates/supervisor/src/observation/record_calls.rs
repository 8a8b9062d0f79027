// SPDX-License-Identifier: Apache-2.0
//! Replayable record of a system, which must be started before the first source is created.
use crate::refuse::refuse;
use crate::system::System;
use model::refusal::{Class, Refusals};
use runtime::trace::{CodeNames, Trace};
use std::sync::Arc;

impl System {
    /// Starts a record; its reader fetches the segments with [`Trace::take`]. `names` contains the names of code in the record.
    ///
    /// # Errors
    /// Fails if the system already has sources or a record.
    pub fn record(&self, names: CodeNames) -> Result<Arc<Trace>, Refusals> {
        self.shared.host.record(names).ok_or_else(|| {
            let what = if self.shared.host.trace().is_some() {
                "it already has such a recording"
            } else {
                "it already has interrupt sources, and their previous firings would be missing"
            };
            let message = format!("cannot record system '{}' for replay: {what}", self.name);
            refuse(Class::InvalidState, message, "start the recording before you create the first source, and start it only once")
        })
    }
}
