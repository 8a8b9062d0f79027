// SPDX-License-Identifier: Apache-2.0
//! Brake of an emulated drive, and a load that falls if nothing holds it.
use super::objects::{Access, Handle, Objects};

/// Bit of the digital outputs that closes the brake.
const CLOSED: u32 = 1;

pub struct Brake {
    outputs: Handle,
    mask: Handle,
    /// Speed at which the load falls, counts/s; `None` if there is no brake.
    falls: Option<f64>,
}

impl Brake {
    pub fn new(objects: &mut Objects) -> Brake {
        objects.add(0x60FE, 0, Access::Constant, &[2]);
        let outputs = objects.add(0x60FE, 1, Access::Written, &0u32.to_le_bytes());
        let mask = objects.add(0x60FE, 2, Access::Written, &0u32.to_le_bytes());
        Brake { outputs, mask, falls: None }
    }

    /// Adds a brake and a load that falls at this speed, counts/s.
    pub fn set_load(&mut self, falls: Option<f64>) {
        self.falls = falls;
    }

    /// Returns the distance that the load falls in a given time if nothing holds it, counts.
    pub fn fall(&self, span_s: f64) -> f64 {
        self.falls.unwrap_or(0.0) * span_s
    }

    /// Returns true if the brake holds the axis: as commanded if the main device controls its bit, otherwise whenever the motor is not
    /// powered.
    pub fn is_closed(&self, objects: &Objects, is_powered: bool) -> bool {
        let is_told = objects.bits(self.mask) & CLOSED != 0;
        self.falls.is_some() && if is_told { objects.bits(self.outputs) & CLOSED != 0 } else { !is_powered }
    }
}
