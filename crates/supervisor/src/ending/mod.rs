// SPDX-License-Identifier: Apache-2.0
//! Ends: departures, and the end and report of each start.
pub(crate) mod departure;
pub(crate) mod end;
pub(crate) mod latest;
pub(crate) mod latest_calls;
pub(crate) mod report;
