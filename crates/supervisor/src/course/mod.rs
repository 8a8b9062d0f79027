// SPDX-License-Identifier: Apache-2.0
//! The course of verb instances: what a call, a kernel or time brings, from the start to the end.
pub(crate) mod claims;
pub(crate) mod create;
pub(crate) mod deadlines;
pub(crate) mod devices;
pub(crate) mod end;
pub(crate) mod ending;
pub(crate) mod events;
pub(crate) mod exchange;
pub(crate) mod leading;
pub(crate) mod life;
pub(crate) mod of;
pub(crate) mod proceed;
pub(crate) mod start;
pub(crate) mod suspend;
