// SPDX-License-Identifier: Apache-2.0
//! Wiring: locations of blocks, cells and connections, and the blocks that each source runs.
pub(crate) mod connect;
pub(crate) mod follow;
pub(crate) mod fuse;
pub(crate) mod fusing;
pub(crate) mod homes;
pub(crate) mod install;
pub(crate) mod installed;
pub(crate) mod instance_windows;
pub(crate) mod ports;
pub(crate) mod tables;
pub(crate) mod window_fills;
