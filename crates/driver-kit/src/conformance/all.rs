// SPDX-License-Identifier: Apache-2.0
//! All checks that run in the driver's process.
use super::check::Check;
use super::{channels, cost, declaration, driven, exchange, kept, life, options, promises, pushed, safe_state, services};

/// Returns all checks in order.
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
