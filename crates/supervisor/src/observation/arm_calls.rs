// SPDX-License-Identifier: Apache-2.0
//! Arm calls: they describe an arm, set the file that contains its taught points, and list the arms.
use crate::observation::arms::{ArmDescription, PointFile};
use crate::system::System;
use model::refusal::Refusals;

impl System {
    /// Registers an arm, replacing any arm with the same name. Fails if its chain does not match its joints, or if there are too many
    /// arms.
    pub fn describe_arm(&self, arm: ArmDescription) -> Result<(), Refusals> {
        self.shared.command(|core| core.observation.arms.enter(arm))
    }

    /// Sets the file in which the taught points of an arm are stored.
    pub fn name_points(&self, file: PointFile) -> Result<(), Refusals> {
        self.shared.command(|core| {
            core.observation.arms.enter_points(file);
            Ok(())
        })
    }

    /// Returns the file in which the taught points of an arm are stored. Fails if no program has set one.
    pub fn point_file(&self, arm: &str) -> Result<PointFile, Refusals> {
        self.shared.locked().observation.arms.points(arm).cloned()
    }

    /// Returns the arms whose joints all exist as logical devices.
    pub fn arms(&self) -> Vec<ArmDescription> {
        let core = self.shared.locked();
        core.observation.arms.present(|joint| core.registry.logical.contains_key(joint))
    }
}
