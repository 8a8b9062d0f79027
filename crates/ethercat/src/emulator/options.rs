// SPDX-License-Identifier: Apache-2.0
//! Options of an emulated subdevice.
use serde::Deserialize;

/// A drive of the line.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveOptions {
    /// Name in its EEPROM and its object 0x1008.
    pub name: String,
    /// Where its axis stands at the start, counts.
    #[serde(default)]
    pub position: i32,
    /// True if it has a watchdog of its outputs; left out: yes.
    pub watchdog: Option<bool>,
    /// Where the switches at the ends of its machine are, counts; left out: it has none.
    pub limits: Option<[f64; 2]>,
    /// Speed at which a load falls that neither its brake nor its motor holds, counts/s; left out: it has neither load nor brake.
    pub falls: Option<f64>,
    /// Its serial number; left out: its place in the list, from 1.
    pub serial: Option<u32>,
    /// Its configured station alias; 0: none.
    #[serde(default)]
    pub alias: u16,
    /// Channels of a terminal; left out: it is a drive.
    pub terminal: Option<TerminalOptions>,
    /// Drift of its clock, millionths; positive: it is too fast.
    #[serde(default)]
    pub clock_ppm: f64,
    /// Time of a frame from the one before it to this one, ns; left out: 350.
    pub cable_ns: Option<u64>,
}

/// Channels of a terminal, digital or analog ones; none at all is a coupler.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TerminalOptions {
    pub digital_inputs: u8,
    pub digital_outputs: u8,
    pub analog_inputs: u8,
    pub analog_outputs: u8,
}

impl TerminalOptions {
    /// Its product code, of its own for each kind.
    pub fn product(&self) -> u32 {
        0x8000_0000 | u32::from_le_bytes([self.digital_inputs, self.digital_outputs, self.analog_inputs, self.analog_outputs])
    }

    /// Returns true for analog ones: they have objects, and a mailbox through which they are read.
    pub fn has_objects(&self) -> bool {
        self.analog_inputs > 0 || self.analog_outputs > 0
    }
}
