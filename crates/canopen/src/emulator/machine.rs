// SPDX-License-Identifier: Apache-2.0
//! The machine behind an emulated node: a drive or a module.
use super::terminals::SwitchedTerminals;
use cia402::emulated::{Drive, Objects};

/// A drive, or an input and output module.
pub(super) enum Machine {
    Drive(Box<Drive>),
    Module(SwitchedTerminals),
}

impl Machine {
    /// Advances by a time span.
    pub fn step(&mut self, objects: &mut Objects, span_s: f64) {
        if let Machine::Drive(drive) = self {
            drive.step(objects, span_s);
        }
    }

    /// Reacts to the loss of the controller as the node does.
    pub fn lose_communication(&mut self, objects: &mut Objects) {
        match self {
            Machine::Drive(drive) => drive.lose_communication(objects),
            Machine::Module(module) => module.be_safe(objects),
        }
    }

    /// Closes or opens the enable input of a drive.
    pub fn set_enable_input(&mut self, is_closed: bool) {
        if let Machine::Drive(drive) = self {
            drive.set_enable_input(is_closed);
        }
    }

    /// Triggers a fault.
    pub fn fail(&mut self, error: u16, objects: &mut Objects) {
        match self {
            Machine::Drive(drive) => drive.fail(error, objects),
            Machine::Module(module) => module.error = error,
        }
    }

    /// Returns the error code.
    pub fn error(&self, objects: &Objects) -> u16 {
        match self {
            Machine::Drive(_) => objects.find(cia402::Entry { index: 0x603F, sub: 0 }).map_or(0, |at| objects.number(at)) as u16,
            Machine::Module(module) => module.error,
        }
    }
}
