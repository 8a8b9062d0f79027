// SPDX-License-Identifier: Apache-2.0
//! Ends: departures, the one end of each start and its report.
pub(crate) mod departure;
pub(crate) mod end;
pub(crate) mod latest;
pub(crate) mod latest_calls;
pub(crate) mod report;
