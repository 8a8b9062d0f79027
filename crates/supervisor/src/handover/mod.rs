// SPDX-License-Identifier: Apache-2.0
//! What a new supervisor finds, and takes over.
pub(crate) mod take_over;
