// SPDX-License-Identifier: Apache-2.0
//! Arms: devices that move one tool.
use crate::sure;
use supervisor::ArmDescription;

crate::calls! {
    /// Arms, as programs describe them.
    pub(super) const ARMS about "arms" = [
        /// Registers an arm, replacing the one of that name: its joints, and the geometry that connects them or the reason why it is
        /// unknown.
        Configure describe_arm(whole arm: ArmDescription) -> (): commands("name"), replaces(&["name"])
            => |system| system.describe_arm(arm);
        /// Returns the arms whose joints are all present.
        Observe arms() -> Vec<ArmDescription>
            => |system| sure(system.arms());
    ];
}
