// SPDX-License-Identifier: Apache-2.0
//! Calls for arms: describes an arm, sets the file of its taught points, and lists the arms.
use crate::observation::arms::{ArmDescription, PointFile};
use crate::system::System;
use model::refusal::Refusals;

impl System {
    /// Registers an arm, replacing the one of that name. Fails if its chain does not fit its joints, or there are too many arms.
    pub fn describe_arm(&self, arm: ArmDescription) -> Result<(), Refusals> {
        self.shared.command(|core| core.observation.arms.enter(arm))
    }

    /// Sets the file in which the taught points of an arm are kept.
    pub fn name_points(&self, file: PointFile) -> Result<(), Refusals> {
        self.shared.command(|core| {
            core.observation.arms.enter_points(file);
            Ok(())
        })
    }

    /// Returns the file in which the taught points of an arm are kept. Fails if no program has named one.
    pub fn point_file(&self, arm: &str) -> Result<PointFile, Refusals> {
        self.shared.locked().observation.arms.points(arm).cloned()
    }

    /// Returns the arms whose joints are all present as logical devices.
    pub fn arms(&self) -> Vec<ArmDescription> {
        let core = self.shared.locked();
        core.observation.arms.present(|joint| core.registry.logical.contains_key(joint))
    }
}
