// SPDX-License-Identifier: Apache-2.0
//! Block library: each file of `src/blocks` is one function block, and its declaration is its documentation.
//!
//! To add a block, write its file: `build.rs` lists the folder. The subfolder of `blocks` is its category. Code shared by several blocks
//! is outside `blocks`.
pub mod chatter;
pub mod kinematics;
pub mod motion;
pub mod online;
pub mod pace;
pub mod path;
pub mod profile;
pub mod queue;
pub mod reference;
pub mod ripple;
pub mod section;
pub mod servo;
pub mod span;
pub mod takeover;
pub mod window;

include!(concat!(env!("OUT_DIR"), "/blocks.rs"));
