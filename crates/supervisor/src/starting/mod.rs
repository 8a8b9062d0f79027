// SPDX-License-Identifier: Apache-2.0
//! Starts: their needs, checks and stores, and the operations that begin an instance.
pub(crate) mod needs;
pub(crate) mod opening;
pub(crate) mod operating;
pub(crate) mod planned;
pub(crate) mod psi;
pub(crate) mod ranges;
pub(crate) mod requirements;
pub(crate) mod start;
