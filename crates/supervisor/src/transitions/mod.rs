// SPDX-License-Identifier: Apache-2.0
//! Transitions between command lists: what each kernel watches for, and the route that a start has taken.
pub(crate) mod leading;
pub(crate) mod route;
pub(crate) mod stages;
