// SPDX-License-Identifier: Apache-2.0
//! Network management (NMT): states of nodes, and the commands that change them.
use crate::frame::Frame;
use std::fmt;

/// Highest node number on a bus.
pub const NODE_MAX: u8 = 127;

/// State of a node, as reported by its heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeState {
    /// The node has just started and sent its boot-up message.
    BootUp = 0,
    Stopped = 4,
    Operational = 5,
    PreOperational = 127,
}

impl NodeState {
    pub fn of(code: u8) -> Option<NodeState> {
        use NodeState::*;
        [BootUp, Stopped, Operational, PreOperational].into_iter().find(|state| *state as u8 == code)
    }
}

impl fmt::Display for NodeState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            NodeState::BootUp => "starting",
            NodeState::Stopped => "stopped",
            NodeState::Operational => "operational",
            NodeState::PreOperational => "pre-operational",
        })
    }
}

/// Command to a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    Start = 1,
    Stop = 2,
    PreOperational = 128,
    Reset = 129,
    ResetCommunication = 130,
}

impl Command {
    const ALL: [(Command, &'static str); 5] = [
        (Command::Start, "start"),
        (Command::Stop, "stop"),
        (Command::PreOperational, "pre_operational"),
        (Command::Reset, "reset"),
        (Command::ResetCommunication, "reset_communication"),
    ];
    /// Names of the commands.
    pub const NAMES: &'static str = "start, stop, pre_operational, reset or reset_communication";

    pub fn of(code: u8) -> Option<Command> {
        Command::ALL.into_iter().map(|(command, _)| command).find(|command| *command as u8 == code)
    }

    pub fn named(name: &str) -> Option<Command> {
        Command::ALL.into_iter().find(|(_, of)| *of == name).map(|(command, _)| command)
    }

    /// Returns the frame that sends this command to a node.
    pub fn frame(self, node: u8) -> Frame {
        Frame::new(0, &[self as u8, node])
    }
}

/// Returns the heartbeat frame of a node.
pub fn heartbeat(node: u8, state: NodeState) -> Frame {
    Frame::new(0x700 + u16::from(node), &[state as u8])
}

/// Returns the frame that triggers synchronous process data.
pub fn sync() -> Frame {
    Frame::new(0x080, &[])
}
