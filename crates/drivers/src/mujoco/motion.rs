// SPDX-License-Identifier: Apache-2.0
//! Configuration on which MuJoCo computes: one `mjData`.
use super::arm::Arm;
use super::functions::{Data, MuJoCo};

/// A configuration of a model with MuJoCo's working memory for it, freed when dropped.
pub(super) struct Motion(*mut Data, &'static MuJoCo);

// SAFETY: the data is owned by this value; MuJoCo keeps no thread-local state about it.
unsafe impl Send for Motion {}

impl Drop for Motion {
    fn drop(&mut self) {
        // SAFETY: the data came from `mj_makeData` and is freed only here.
        unsafe { (self.1.mj_deleteData)(self.0) }
    }
}

impl Motion {
    pub fn new(arm: &Arm) -> Motion {
        // SAFETY: the model is valid; MuJoCo ends the process if it runs out of memory.
        Motion(unsafe { (arm.mujoco.mj_makeData)(arm.model) }, arm.mujoco)
    }

    /// Returns the data, for calls to MuJoCo.
    pub fn data(&self) -> *mut Data {
        self.0
    }
}
