// SPDX-License-Identifier: Apache-2.0
//! The block library: one file of `src/blocks` is one function block, and its declaration is its documentation.
//!
//! To add one, write its file: `build.rs` lists the folder. What several blocks share is beside the folder.
pub mod profile;
pub mod reference;
pub mod servo;

include!(concat!(env!("OUT_DIR"), "/blocks.rs"));
