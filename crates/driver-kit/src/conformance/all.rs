// SPDX-License-Identifier: Apache-2.0
//! Every check that runs in the process of the driver.
use super::check::Check;
use super::{channels, cost, declaration, driven, exchange, kept, life, options, promises, pushed, safe_state, services};

/// In their order.
pub(super) fn checks() -> Vec<&'static Check> {
    let groups = [
        declaration::CHECKS,
        promises::CHECKS,
        options::CHECKS,
        channels::CHECKS,
        life::CHECKS,
        services::CHECKS,
        exchange::CHECKS,
        driven::CHECKS,
        pushed::CHECKS,
        kept::CHECKS,
        cost::CHECKS,
        safe_state::CHECKS,
    ];
    groups.into_iter().flatten().collect()
}
