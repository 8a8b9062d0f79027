// SPDX-License-Identifier: Apache-2.0
//! Takeover by a new supervisor of what it finds.
pub(crate) mod take_over;
