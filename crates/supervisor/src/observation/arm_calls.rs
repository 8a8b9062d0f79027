// SPDX-License-Identifier: Apache-2.0
//! Arms: entering what a program says of one, and listing them.
use crate::observation::arms::ArmDescription;
use crate::system::System;
use model::refusal::Refusals;

impl System {
    /// Enters an arm, in the place of the one of that name. Errors: its chain is not one of its joints.
    pub fn describe_arm(&self, arm: ArmDescription) -> Result<(), Refusals> {
        self.shared.command(|core| core.observation.arms.enter(arm))
    }

    /// Returns the arms whose joints are logical devices now.
    pub fn arms(&self) -> Vec<ArmDescription> {
        let core = self.shared.locked();
        core.observation.arms.present(|joint| core.registry.logical.contains_key(joint))
    }
}
