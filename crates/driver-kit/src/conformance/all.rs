// SPDX-License-Identifier: Apache-2.0
//! Every check that runs in the process of the driver.
use super::check::Check;
use super::{channels, declaration, exchange, life, options, rest, services};

/// In their order.
pub(super) fn checks() -> Vec<&'static Check> {
    [declaration::CHECKS, options::CHECKS, channels::CHECKS, life::CHECKS, services::CHECKS, exchange::CHECKS, rest::CHECKS]
        .iter()
        .flat_map(|checks| checks.iter())
        .collect()
}
