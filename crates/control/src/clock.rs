// SPDX-License-Identifier: Apache-2.0
//! The clock of the control interface.

/// What time it is, by the clock of the runtime: a test may let that stand still.
pub(crate) fn now() -> std::time::Instant {
    tokio::time::Instant::now().into_std()
}
