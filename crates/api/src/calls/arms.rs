// SPDX-License-Identifier: Apache-2.0
//! Calls for arms, that is, sets of joints that together move one tool.
use crate::sure;
use supervisor::ArmDescription;

crate::calls! {
    /// Calls for arms, as described by programs.
    pub(super) const ARMS about "arms" = [
        /// Registers an arm, replacing any arm with the same name: its joints, and the geometry that connects them or the reason why it
        /// is unknown.
        Configure describe_arm(whole arm: ArmDescription) -> (): commands("name"), replaces(&["name"])
            => |system| system.describe_arm(arm);
        /// Returns the arms whose joints all exist.
        Observe arms() -> Vec<ArmDescription>
            => |system| sure(system.arms());
    ];
}
