// SPDX-License-Identifier: Apache-2.0
//! Arms: devices that move one tool.
use crate::sure;
use supervisor::ArmDescription;

crate::calls! {
    /// Arms, as programs describe them.
    pub(super) const ARMS about "arms" = [
        /// Enters an arm, in the place of the one of that name: its joints, and the geometry that joins them or the reason why it is not known.
        Configure describe_arm(whole arm: ArmDescription) -> (): commands("name"), replaces(&["name"])
            => |system| system.describe_arm(arm);
        /// Returns the arms whose joints are there.
        Observe arms() -> Vec<ArmDescription>
            => |system| sure(system.arms());
    ];
}
