// SPDX-License-Identifier: Apache-2.0
//! Suspension of an instance, and the values of its outputs during the suspension.
pub(crate) mod idle_values;
pub(crate) mod suspend;
