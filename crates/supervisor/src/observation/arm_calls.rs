// SPDX-License-Identifier: Apache-2.0
//! Arms: entering what a program says of one, and listing them.
use crate::observation::arms::{ArmDescription, PointFile};
use crate::system::System;
use model::refusal::Refusals;

impl System {
    /// Enters an arm, in the place of the one of that name. Errors: its chain is not one of its joints.
    pub fn describe_arm(&self, arm: ArmDescription) -> Result<(), Refusals> {
        self.shared.command(|core| core.observation.arms.enter(arm))
    }

    /// Says in which file the taught points of an arm are kept.
    pub fn name_points(&self, file: PointFile) -> Result<(), Refusals> {
        self.shared.command(|core| {
            core.observation.arms.enter_points(file);
            Ok(())
        })
    }

    /// Returns the file in which the taught points of an arm are kept. Errors: no program has named one.
    pub fn point_file(&self, arm: &str) -> Result<PointFile, Refusals> {
        self.shared.locked().observation.arms.points(arm).cloned()
    }

    /// Returns the arms whose joints are logical devices now.
    pub fn arms(&self) -> Vec<ArmDescription> {
        let core = self.shared.locked();
        core.observation.arms.present(|joint| core.registry.logical.contains_key(joint))
    }
}
