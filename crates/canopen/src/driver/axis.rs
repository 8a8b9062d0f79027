// SPDX-License-Identifier: Apache-2.0
//! An axis on a bus: the process data of its drive.
use super::options::AxisOptions;
use crate::message::emergency_name;
use crate::pdo::{self, Pdo, Word};
use cia402::axis;
use cia402::{BrakeOptions, DriveCommand, Entry, Mode};
use device::Layout;

/// An axis, with the last command to its drive.
pub struct Axis {
    pub moved: axis::Axis,
    pub mode: Mode,
    brake: Option<BrakeOptions>,
    told: DriveCommand,
    /// Error code of the drive; `emergency` is the error code of its latest emergency message.
    error: u16,
    emergency: u16,
}

impl Axis {
    pub fn new(options: &AxisOptions, layout: &mut Layout) -> Axis {
        let of = &options.axis;
        let mut moved = axis::Axis::new(of, format!("axis '{}' (node {})", of.name, options.node), emergency_name, layout);
        Axis { told: moved.commander.tell_idle(), moved, mode: of.mode.mode(), brake: of.brake, error: 0, emergency: 0 }
    }

    /// Returns the PDOs that the controller sends to the drive.
    pub fn outputs(&self) -> pdo::Pdos {
        pdo::outputs(self.mode, self.brake_word())
    }

    fn brake_word(&self) -> Option<Word> {
        self.brake.map(|brake| brake.object().mapped(32))
    }

    /// Returns the settings to write to the drive, if it supports them, before it goes operational.
    pub fn settings(&self) -> Vec<(Entry, Vec<u8>)> {
        self.brake.iter().flat_map(BrakeOptions::settings).collect()
    }

    /// Returns true if the exchange of an object is mandatory.
    pub fn needs(&self, word: Word) -> bool {
        !pdo::is_optional(word)
    }

    /// Handles process data from the drive.
    pub fn take(&mut self, pdo: &Pdo, bytes: &[u8]) {
        let number = |of| pdo::number(bytes, pdo, of);
        let mut measured = self.moved.measured;
        let put = |of, to: &mut dyn FnMut(i32)| number(of).into_iter().for_each(to);
        put(pdo::POSITION, &mut |value| measured.position = value);
        put(pdo::VELOCITY, &mut |value| measured.velocity = value);
        put(pdo::TORQUE, &mut |value| measured.torque = value as i16);
        put(pdo::MODE_SHOWN, &mut |value| measured.mode = value as i8);
        put(pdo::ERROR, &mut |value| self.error = value as u16);
        measured.error = self.code();
        self.moved.measured = measured;
        if let Some(status) = number(pdo::STATUS) {
            self.moved.look(axis::DriveReadings { status: status as u16, ..measured });
        }
    }

    /// Processes an emergency message; code 0 means that the error has been cleared.
    pub fn heed(&mut self, code: u16) {
        self.emergency = code;
        self.moved.measured.error = self.code();
    }

    /// Returns the error code, if the drive reports an error.
    fn code(&self) -> u16 {
        if self.error != 0 { self.error } else { self.emergency }
    }

    /// Sets the command until the next cycle.
    pub fn tell(&mut self, commands: &[u8], is_engaged: bool, span_s: f64) {
        self.told = self.moved.tell(commands, is_engaged, span_s);
    }

    /// Switches to the idle command.
    pub fn tell_idle(&mut self) {
        self.told = self.moved.commander.tell_idle();
    }

    /// Returns the commanded value of an object, as sent to the drive.
    pub fn carried(&self, word: Word) -> u32 {
        self.in_words(&self.told, word)
    }

    /// Returns the value of an object that another process sends on behalf of this process after it has exited.
    pub fn last_carried(&self, word: Word) -> u32 {
        self.in_words(&self.moved.commander.last_words(), word)
    }

    fn in_words(&self, told: &DriveCommand, word: Word) -> u32 {
        match word {
            pdo::CONTROL => told.control.into(),
            pdo::MODE => told.mode as u32,
            word if word == pdo::target(self.mode) => told.target as u32,
            word if Some(word) == self.brake_word() => told.brake.unwrap_or(0),
            _ => 0,
        }
    }
}
