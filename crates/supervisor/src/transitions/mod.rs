// SPDX-License-Identifier: Apache-2.0
//! Transitions between command lists: conditions that each kernel watches, and the route of a start.
pub(crate) mod leading;
pub(crate) mod route;
pub(crate) mod stages;
