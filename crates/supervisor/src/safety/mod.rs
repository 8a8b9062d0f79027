// SPDX-License-Identifier: Apache-2.0
//! What stops, holds back or reports: emergency stop, pause, modes, alarms, what is lost.
pub(crate) mod alarms;
pub(crate) mod emergency;
pub(crate) mod modes;
pub(crate) mod pause;
pub(crate) mod present;
pub(crate) mod state;
