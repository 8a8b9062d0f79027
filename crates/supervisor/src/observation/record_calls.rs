// SPDX-License-Identifier: Apache-2.0
//! Replayable record of a system, which must begin before the first source is created.
use crate::refuse::refuse;
use crate::system::System;
use model::refusal::{Class, Refusals};
use runtime::trace::{CodeNames, Trace};
use std::sync::Arc;

impl System {
    /// Starts a record; its reader takes the parts by [`Trace::take`]. `names`: names of code in the record.
    ///
    /// # Errors
    /// Fails if the system already has sources or a record.
    pub fn record(&self, names: CodeNames) -> Result<Arc<Trace>, Refusals> {
        self.shared.host.record(names).ok_or_else(|| {
            let what = if self.shared.host.trace().is_some() {
                "it has such a recording already"
            } else {
                "it has interrupt sources already, and what they did before would be missing"
            };
            let message = format!("cannot record system '{}' so that it can be replayed: {what}", self.name);
            refuse(Class::InvalidState, message, "begin the recording before the first source is made, and only once")
        })
    }
}
