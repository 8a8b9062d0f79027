// SPDX-License-Identifier: Apache-2.0
//! Alarms: what raises them, who has seen them, and what is shelved.
pub(crate) mod alarm_calls;
pub(crate) mod causes;
pub(crate) mod list;
pub(crate) mod shelving;
pub(crate) mod shelving_calls;
