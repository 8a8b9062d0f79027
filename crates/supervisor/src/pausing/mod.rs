// SPDX-License-Identifier: Apache-2.0
//! Pauses of a program, and its modes.
pub(crate) mod mode_calls;
pub(crate) mod modes;
pub(crate) mod pause;
pub(crate) mod pause_calls;
pub(crate) mod program;
