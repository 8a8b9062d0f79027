// SPDX-License-Identifier: Apache-2.0
//! The emulated bus line.
use super::node::Node;
use super::said::{NodeOptions, Out, SAID_MAX};
use crate::frame::{self, FRAME_LEN, Frame};
use serde_json::{Value, json};
use std::collections::VecDeque;

/// The nodes on a line.
pub struct Bus {
    nodes: Vec<Node>,
    said: VecDeque<[u8; FRAME_LEN]>,
    /// Number of upcoming frames to drop, and number to corrupt.
    lose: u64,
    spoil: u64,
    frames: u64,
}

impl Bus {
    pub fn new(nodes: &[NodeOptions]) -> Bus {
        let mut bus = Bus { nodes: Vec::new(), said: VecDeque::with_capacity(SAID_MAX), lose: 0, spoil: 0, frames: 0 };
        bus.nodes = nodes.iter().map(Node::new).collect();
        bus.each(|node, out| node.boot(out));
        bus
    }

    fn each(&mut self, mut act: impl FnMut(&mut Node, &mut Out<'_>)) {
        let mut out = Out { said: &mut self.said, lose: &mut self.lose, spoil: &mut self.spoil };
        self.nodes.iter_mut().filter(|node| node.is_on).for_each(|node| act(node, &mut out));
    }

    /// Processes a frame from a controller.
    pub fn take(&mut self, frame: &Frame) {
        self.frames += 1;
        self.each(|node, out| node.take(frame, out));
    }

    /// Advances time.
    pub fn go_on(&mut self, span_ns: i64) {
        self.each(|node, out| node.go_on(span_ns, out));
    }

    /// Returns the next frame or bus report on the line.
    pub fn said(&mut self) -> Option<[u8; FRAME_LEN]> {
        self.said.pop_front()
    }

    /// Returns the number of frames received from controllers.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    fn find(&mut self, node: u8) -> Option<&mut Node> {
        self.nodes.iter_mut().find(|of| of.id() == node)
    }

    /// Switches the power supply of a drive. A drive that is switched on again has lost its settings, but its axis has not moved.
    pub fn power(&mut self, node: u8, is_on: bool) {
        let mut out = Out { said: &mut self.said, lose: &mut self.lose, spoil: &mut self.spoil };
        if let Some(node) = self.nodes.iter_mut().find(|of| of.id() == node) {
            node.power(is_on, &mut out);
        }
    }

    /// Drops the next frames sent by nodes.
    pub fn lose(&mut self, frames: u64) {
        self.lose = frames;
    }

    /// Truncates the next frames sent by nodes.
    pub fn spoil(&mut self, frames: u64) {
        self.spoil = frames;
    }

    /// Triggers a fault with a CiA 402 error code in a drive.
    pub fn fail(&mut self, node: u8, error: u16) {
        let mut out = Out { said: &mut self.said, lose: &mut self.lose, spoil: &mut self.spoil };
        if let Some(node) = self.nodes.iter_mut().find(|of| of.id() == node) {
            node.fail(error, &mut out);
        }
    }

    /// Closes or opens the enable input of a drive.
    pub fn set_enable_input(&mut self, node: u8, is_closed: bool) {
        if let Some(node) = self.find(node) {
            node.set_enable_input(is_closed);
        }
    }

    /// Puts the controller's adapter into the bus-off state.
    pub fn bus_off(&mut self) {
        self.said.push_back(frame::report(frame::BUS_OFF, 0));
    }

    /// Returns an object dictionary entry of a drive as a number; 0 if it does not exist.
    pub fn number(&mut self, node: u8, index: u16, sub: u8) -> i64 {
        self.find(node).map_or(0, |node| node.number(index, sub))
    }

    /// Returns the name of a node's state.
    pub fn state(&mut self, node: u8) -> String {
        self.find(node).map_or_else(String::new, |node| if node.is_on { node.state().to_string() } else { "off".to_owned() })
    }

    /// Returns the value at a terminal of a module, which is an `input`, `output`, `analog_input` or `analog_output`, numbered from 0;
    /// `None` if it does not exist.
    pub fn terminal(&mut self, node: u8, what: &str, number: u8) -> Option<i64> {
        self.find(node).and_then(|node| node.terminal(what, number))
    }

    /// Sets the value at a terminal of a module.
    pub fn put(&mut self, node: u8, what: &str, number: u8, value: i64) {
        if let Some(node) = self.find(node) {
            node.put(what, number, value);
        }
    }

    /// Returns the state of the bus, for display and for tests.
    pub fn show(&mut self) -> Value {
        let (modules, drives): (Vec<&Node>, Vec<&Node>) = self.nodes.iter().partition(|node| node.is_module());
        let state = |node: &Node| if node.is_on { node.state().to_string() } else { "off".to_owned() };
        let drives: Vec<Value> = drives
            .into_iter()
            .map(|node| {
                let number = |index| node.number(index, 0);
                let drive = cia402::DriveState::of(number(0x6041) as u16).to_string();
                let (position, target, mode, error) = (number(0x6064), number(0x607A), number(0x6061), number(0x603F) as u16);
                json!({ "node": node.id(), "state": state(node), "drive": drive, "position": position, "target": target, "mode": mode, "error": error })
            })
            .collect();
        let modules: Vec<Value> = modules
            .into_iter()
            .map(|node| {
                let all = |what: &str| (0..=u8::MAX).map_while(|number| node.terminal(what, number)).collect::<Vec<i64>>();
                let (inputs, outputs) = (all("input"), all("output"));
                let (analog_inputs, analog_outputs) = (all("analog_input"), all("analog_output"));
                json!({ "node": node.id(), "state": state(node), "inputs": inputs, "outputs": outputs, "analog_inputs": analog_inputs, "analog_outputs": analog_outputs })
            })
            .collect();
        json!({ "frames": self.frames, "drives": drives, "modules": modules })
    }
}
