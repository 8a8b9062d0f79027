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
    /// True, the default, if it has a watchdog of its outputs.
    pub watchdog: Option<bool>,
    /// Positions of the limit switches of its machine, counts; omitted: it has none.
    pub limits: Option<[f64; 2]>,
    /// Speed at which a load falls if neither brake nor motor holds it, counts/s; omitted: there is neither load nor brake.
    pub falls: Option<f64>,
    /// Serial number; omitted: position in the list, from 1.
    pub serial: Option<u32>,
    /// Configured station alias; 0 for none.
    #[serde(default)]
    pub alias: u16,
    /// Channels of a terminal; omitted: it is a drive.
    pub terminal: Option<TerminalOptions>,
    /// Drift of its clock, millionths; positive if it is too fast.
    #[serde(default)]
    pub clock_ppm: f64,
    /// Time that a frame takes from the previous subdevice to this one, ns; default 350.
    pub cable_ns: Option<u64>,
}

/// Channels of a terminal, either digital or analog; a terminal without channels is a coupler.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TerminalOptions {
    pub digital_inputs: u8,
    pub digital_outputs: u8,
    pub analog_inputs: u8,
    pub analog_outputs: u8,
}

impl TerminalOptions {
    /// Returns the product code, which differs for each kind.
    pub fn product(&self) -> u32 {
        0x8000_0000 | u32::from_le_bytes([self.digital_inputs, self.digital_outputs, self.analog_inputs, self.analog_outputs])
    }

    /// Returns true for analog terminals, which have objects, and a mailbox through which these are read.
    pub fn has_objects(&self) -> bool {
        self.analog_inputs > 0 || self.analog_outputs > 0
    }
}
