// SPDX-License-Identifier: Apache-2.0
//! A programming system, or the processor of a source, that is cut off.
use crate::refuse::unknown;
use crate::stopping::cut_off::abandon;
use crate::system::System;
use model::definition::IfCutOff;
use model::refusal::Refusals;

impl System {
    /// Returns true if an instance goes on when the programming system that started it is cut off. False for one that is not there.
    pub fn continues(&self, instance: u64) -> bool {
        self.shared.locked().instances.get(&instance).is_some_and(|instance| instance.if_cut_off() == IfCutOff::Continue)
    }

    /// Tells that the programming system `who`, which started these instances, is cut off: each that runs follows the word
    /// `if_cut_off` of its verb. Instances that have ended, or were deleted, are passed over.
    pub fn abandon(&self, instances: &[u64], who: &str) -> Result<(), Refusals> {
        self.shared.command(|core| {
            abandon(core, instances, who);
            Ok(())
        })
    }

    /// Cuts off a source, for tests: it gets no script and acknowledges none, as if its processor were gone.
    ///
    /// # Errors
    /// `UnknownName`.
    pub fn cut_off(&self, source: &str) -> Result<(), Refusals> {
        self.shared.command(|core| {
            let Some(id) = core.registry.sources.get(source).copied() else {
                return Err(unknown("source", source, core.registry.sources.keys().map(String::as_str)));
            };
            core.safety.cut_off.insert(id);
            Ok(())
        })
    }
}
