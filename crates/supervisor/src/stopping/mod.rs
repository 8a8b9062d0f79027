// SPDX-License-Identifier: Apache-2.0
//! Stops: the emergency stop, age limits, suspensions of processes, lost processors, and programming systems that are cut off.
pub(crate) mod absent_devices;
pub(crate) mod ages;
pub(crate) mod cut_off;
pub(crate) mod cut_off_calls;
pub(crate) mod emergency_calls;
pub(crate) mod emergency_stop;
pub(crate) mod latch;
pub(crate) mod lost_processors;
pub(crate) mod safety;
pub(crate) mod standstill;
pub(crate) mod unguarded;
