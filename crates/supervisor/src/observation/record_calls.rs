// SPDX-License-Identifier: Apache-2.0
//! A record of a system that can be run again: made from the first source on, or not at all.
use crate::refuse::refuse;
use crate::system::System;
use model::refusal::{Class, Refusals};
use runtime::trace::{CodeNames, Trace};
use std::sync::Arc;

impl System {
    /// Starts a record, whose reader takes each part by [`Trace::take`]. `names`: names of code in the record.
    ///
    /// # Errors
    /// The system has sources already, or a record.
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
