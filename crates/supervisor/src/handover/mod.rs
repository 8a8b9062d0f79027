// SPDX-License-Identifier: Apache-2.0
//! Takeover of running processors by a new supervisor.
pub(crate) mod take_over;
