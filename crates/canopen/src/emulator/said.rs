// SPDX-License-Identifier: Apache-2.0
//! How an emulated drive is asked for, and what it says.
use crate::frame::{FRAME_LEN, Frame};
use serde::Deserialize;
use std::collections::VecDeque;

/// How an emulated drive is.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveOptions {
    pub name: String,
    /// Its number on the bus, 1 to 127.
    pub node: u8,
    /// Counts: where its axis stands at the start.
    #[serde(default)]
    pub position: i32,
    /// Whether it heeds the heartbeat of its controller; left out: it does.
    pub watchdog: Option<bool>,
}

/// What its nodes say and nobody has taken yet, at most.
pub(super) const SAID_MAX: usize = 4096;

/// What nodes say, on its way to the line.
pub(super) struct Out<'a> {
    pub said: &'a mut VecDeque<[u8; FRAME_LEN]>,
    pub lose: &'a mut u64,
    pub spoil: &'a mut u64,
}

impl Out<'_> {
    pub fn say(&mut self, frame: &Frame) {
        if *self.lose > 0 {
            *self.lose -= 1;
            return;
        }
        let mut bytes = frame.encoded();
        if *self.spoil > 0 {
            *self.spoil -= 1;
            // Shorter than it was: what the check sum of CAN does not see, for the sender itself was wrong.
            bytes[4] = bytes[4].saturating_sub(1);
        }
        if self.said.len() < SAID_MAX {
            self.said.push_back(bytes);
        }
    }
}
