// SPDX-License-Identifier: Apache-2.0
//! Claims, the takeover of SVVs by a start, and the current writers of SVVs.
pub(crate) mod claiming;
pub(crate) mod takeover;
pub(crate) mod writers;
