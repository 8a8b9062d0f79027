// SPDX-License-Identifier: Apache-2.0
//! Alarms: their causes, acknowledgement, and shelving.
pub(crate) mod alarm_calls;
pub(crate) mod causes;
pub(crate) mod list;
pub(crate) mod shelving;
pub(crate) mod shelving_calls;
