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

use opengpac::read::{BlockFace, TypeFace};
use std::sync::LazyLock;

/// Returns the interfaces of the blocks and of the struct types, which are read once: there are hundreds, and each system and each trial
/// needs them.
pub fn faces() -> &'static (Vec<BlockFace>, Vec<TypeFace>) {
    static FACES: LazyLock<(Vec<BlockFace>, Vec<TypeFace>)> = LazyLock::new(|| {
        let types: Vec<TypeFace> = types().iter().map(|of| TypeFace::read(of).expect(SOUND)).collect();
        let blocks = blocks().iter().map(|of| BlockFace::read(of, &types).expect(SOUND)).collect();
        (blocks, types)
    });
    &FACES
}

const SOUND: &str = "the library's own blocks are valid, which its tests check";

include!(concat!(env!("OUT_DIR"), "/blocks.rs"));
