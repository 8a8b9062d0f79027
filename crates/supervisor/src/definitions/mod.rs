// SPDX-License-Identifier: Apache-2.0
//! Definitions: code, verbs, graphs and device types, and trials of blocks.
pub(crate) mod block_trial;
pub(crate) mod catalog;
pub(crate) mod code;
pub(crate) mod define;
pub(crate) mod download;
pub(crate) mod drawings;
pub(crate) mod faces;
pub(crate) mod sane;
pub(crate) mod system_definitions;
pub(crate) mod verbs;
