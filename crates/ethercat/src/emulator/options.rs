// SPDX-License-Identifier: Apache-2.0
//! Options of an emulated subdevice.
use serde::Deserialize;

/// Options of a drive on the line.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveOptions {
    /// Name in its EEPROM and in object 0x1008.
    pub name: String,
    /// Initial position of its axis, counts.
    #[serde(default)]
    pub position: i32,
    /// True (the default) if its outputs have a watchdog.
    pub watchdog: Option<bool>,
    /// Positions of the machine's limit switches, counts; if omitted, there are no switches.
    pub limits: Option<[f64; 2]>,
    /// Speed at which a load falls if neither the brake nor the motor holds it, counts/s; if omitted, there is neither load nor brake.
    pub falls: Option<f64>,
    /// Serial number; defaults to the position in the list, starting at 1.
    pub serial: Option<u32>,
    /// Configured station alias; 0 for none.
    #[serde(default)]
    pub alias: u16,
    /// Channels of a terminal; if omitted, the subdevice is a drive.
    pub terminal: Option<TerminalOptions>,
    /// Drift of its clock, parts per million; positive if it runs too fast.
    #[serde(default)]
    pub clock_ppm: f64,
    /// Time that a frame takes from the previous subdevice to this one, ns; default 350.
    pub cable_ns: Option<u64>,
}

/// Channels of a terminal, either all digital or all analog; a terminal without channels is a coupler.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TerminalOptions {
    pub digital_inputs: u8,
    pub digital_outputs: u8,
    pub analog_inputs: u8,
    pub analog_outputs: u8,
}

impl TerminalOptions {
    /// Returns the product code, which depends on the channels.
    pub fn product(&self) -> u32 {
        0x8000_0000 | u32::from_le_bytes([self.digital_inputs, self.digital_outputs, self.analog_inputs, self.analog_outputs])
    }

    /// Returns true for analog terminals, which have objects and a mailbox through which the objects are read.
    pub fn has_objects(&self) -> bool {
        self.analog_inputs > 0 || self.analog_outputs > 0
    }
}
