// SPDX-License-Identifier: Apache-2.0
//! Calls for the cut-off of a programming system, or of a source's processor.
use crate::refuse::unknown;
use crate::stopping::cut_off::abandon;
use crate::system::System;
use model::definition::IfCutOff;
use model::refusal::Refusals;

impl System {
    /// Returns true if an instance continues when the programming system that started it is cut off; false if it does not exist.
    pub fn continues(&self, instance: u64) -> bool {
        self.shared.locked().instances.get(&instance).is_some_and(|instance| instance.if_cut_off() == IfCutOff::Continue)
    }

    /// Reports that the programming system `who`, which started these instances, is cut off: each running instance follows the
    /// `if_cut_off` of its verb. Instances that have ended or were deleted are skipped.
    pub fn abandon(&self, instances: &[u64], who: &str) -> Result<(), Refusals> {
        self.shared.command(|core| {
            abandon(core, instances, who);
            Ok(())
        })
    }

    /// Cuts off a source, for tests: it neither receives nor acknowledges scripts, as if its processor had exited.
    ///
    /// # Errors
    /// `UnknownName` if the source does not exist.
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
