// SPDX-License-Identifier: Apache-2.0
//! Options of an emulated node, and buffer of the messages that it sends.
use crate::frame::{FRAME_LEN, Frame};
use serde::Deserialize;
use std::collections::VecDeque;

/// Options of an emulated node: a drive, or an input and output module.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NodeOptions {
    pub name: String,
    /// Node number on the bus, 1 to 127.
    pub node: u8,
    /// Initial position of its axis, counts.
    #[serde(default)]
    pub position: i32,
    /// True (the default) if the node monitors the heartbeat of its controller.
    pub watchdog: Option<bool>,
    /// Positions of the machine's limit switches, counts; if omitted, there are no switches.
    pub limits: Option<[f64; 2]>,
    /// Speed at which a load falls if neither the brake nor the motor holds it, counts/s; if omitted, there is neither load nor brake.
    pub falls: Option<f64>,
    /// Serial number; defaults to the node number.
    pub serial: Option<u32>,
    /// Numbers of terminals of a module; if omitted, the node is a drive.
    pub module: Option<Terminals>,
}

/// Numbers of terminals of a module.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Terminals {
    /// Number of digital terminals, up to 64.
    pub inputs: u8,
    pub outputs: u8,
    pub analog_inputs: u8,
    pub analog_outputs: u8,
    /// True if the error values of its analog outputs have 16 bits instead of 32.
    pub short_error_values: bool,
}

/// Maximum number of pending messages of the nodes.
pub(super) const SAID_MAX: usize = 4096;

/// Messages from nodes to be put on the line.
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
            // The frame is shorter than configured; CAN's checksum does not detect this, because the sender itself was wrong.
            bytes[4] = bytes[4].saturating_sub(1);
        }
        if self.said.len() < SAID_MAX {
            self.said.push_back(bytes);
        }
    }
}
