// SPDX-License-Identifier: Apache-2.0
//! The block library: one file of `src/blocks` is one function block, and its declaration is its documentation.
//!
//! To add one, write its file: `build.rs` lists the folder. The folder within `blocks` is its category. What several blocks
//! share is beside `blocks`.
pub mod chatter;
pub mod kinematics;
pub mod motion;
pub mod online;
pub mod pace;
pub mod path;
pub mod profile;
pub mod reference;
pub mod ripple;
pub mod section;
pub mod servo;
pub mod span;
pub mod takeover;
pub mod window;

include!(concat!(env!("OUT_DIR"), "/blocks.rs"));
