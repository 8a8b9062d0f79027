// SPDX-License-Identifier: Apache-2.0
//! Processors that run in other processes and on other hosts.
pub(crate) mod farewell;
pub(crate) mod guarded;
pub(crate) mod processors;
