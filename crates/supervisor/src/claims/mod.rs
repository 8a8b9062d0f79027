// SPDX-License-Identifier: Apache-2.0
//! Claims of writers, and takeover by a start.
pub(crate) mod claiming;
pub(crate) mod takeover;
pub(crate) mod writers;
