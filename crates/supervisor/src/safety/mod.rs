// SPDX-License-Identifier: Apache-2.0
//! Stops, holds and reports: emergency stop, pause, modes, alarms, losses.
pub(crate) mod alarms;
pub(crate) mod emergency;
pub(crate) mod modes;
pub(crate) mod pause;
pub(crate) mod present;
pub(crate) mod shelving;
pub(crate) mod state;
