// SPDX-License-Identifier: Apache-2.0
//! Options of an emulated node, and its messages.
use crate::frame::{FRAME_LEN, Frame};
use serde::Deserialize;
use std::collections::VecDeque;

/// Options of an emulated node: a drive, or a module of inputs and outputs.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NodeOptions {
    pub name: String,
    /// Its number on the bus, 1 to 127.
    pub node: u8,
    /// Counts: where its axis stands at the start.
    #[serde(default)]
    pub position: i32,
    /// True if it heeds the heartbeat of its controller; left out: it does.
    pub watchdog: Option<bool>,
    /// Where the switches at the ends of its machine are, counts; left out: it has none.
    pub limits: Option<[f64; 2]>,
    /// Speed at which a load falls that neither its brake nor its motor holds, counts/s; left out: it has neither load nor brake.
    pub falls: Option<f64>,
    /// Its serial number; left out: that of its node.
    pub serial: Option<u32>,
    /// Numbers of terminals of a module; left out: it is a drive.
    pub module: Option<Terminals>,
}

/// The terminals of a module.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Terminals {
    /// Digital ones, up to 64.
    pub inputs: u8,
    pub outputs: u8,
    pub analog_inputs: u8,
    pub analog_outputs: u8,
    /// The error values of its analog outputs have 16 bits, not 32.
    pub short_error_values: bool,
}

/// Maximum number of messages of its nodes that have not been taken yet.
pub(super) const SAID_MAX: usize = 4096;

/// Messages of nodes, on their way to the line.
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
