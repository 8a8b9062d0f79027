// SPDX-License-Identifier: Apache-2.0
//! Brake of an axis whose drive does not control the brake itself: a digital output, and the conditions for releasing the brake.
//!
//! The brake is released only while the motor holds the axis, and the motor holds the axis until the brake has closed.
use crate::objects::Entry;
use device::{Kind, OptionWord};
use serde::Deserialize;

/// Digital outputs of a CiA 402 drive, and the mask of the outputs that the controller sets.
const OUTPUTS: u16 = 0x60FE;
const MASK: u8 = 2;
/// Quick-stop option code object, and the value with which the motor holds the axis after the ramp.
const QUICK_STOP_OPTION: Entry = Entry { index: 0x605A, sub: 0 };
const STAYS_IN_QUICK_STOP: i16 = 6;

/// Numeric options of a brake.
pub(crate) const FIELDS: [OptionWord; 5] = [
    OptionWord::with_default("index", Kind::Whole, "0x60FE", "object of its output").within(0.0, 65535.0),
    OptionWord::with_default("sub", Kind::Whole, "1", "subindex of its output").within(0.0, 255.0),
    OptionWord::with_default("bit", Kind::Whole, "0", "bit of its output").within(0.0, 31.0),
    OptionWord::with_default("release_ns", Kind::Whole, "0.1 s", "time that it takes to open").unit("ns").within(0.0, u32::MAX as f64),
    OptionWord::with_default("close_ns", Kind::Whole, "0.1 s", "time that it takes to close").unit("ns").within(0.0, u32::MAX as f64),
];

/// Options of a brake.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BrakeOptions {
    pub index: u16,
    pub sub: u8,
    pub bit: u8,
    /// True if the bit is 1 to release the brake; otherwise it is 1 to close the brake.
    pub released_by_one: bool,
    /// Time that the brake takes to open, and time that it takes to close.
    pub release_ns: u32,
    pub close_ns: u32,
}

impl BrakeOptions {
    /// Returns the object of the brake's output, all 32 bits.
    pub fn object(&self) -> Entry {
        Entry { index: self.index, sub: self.sub }
    }

    /// Returns the settings to write to the drive, if it supports them, before it goes operational. First the brake is closed, then its
    /// output bit is assigned to the controller, then the motor is set to hold after a quick stop.
    pub fn settings(&self) -> Vec<(Entry, Vec<u8>)> {
        let closed = (self.object(), Brake::new(*self).word().to_le_bytes().to_vec());
        let mask = (Entry { index: OUTPUTS, sub: MASK }, (1u32 << self.bit).to_le_bytes().to_vec());
        let holds = (QUICK_STOP_OPTION, STAYS_IN_QUICK_STOP.to_le_bytes().to_vec());
        if self.index == OUTPUTS { vec![closed, mask, holds] } else { vec![closed, holds] }
    }
}

impl Default for BrakeOptions {
    fn default() -> BrakeOptions {
        BrakeOptions { index: OUTPUTS, sub: 1, bit: 0, released_by_one: false, release_ns: 100_000_000, close_ns: 100_000_000 }
    }
}

/// A brake and its state.
#[derive(Clone, Copy, Debug)]
pub struct Brake {
    options: BrakeOptions,
    is_released: bool,
    /// Time since the brake command changed, s.
    since_s: f64,
}

impl Brake {
    /// Creates a brake that is closed.
    pub fn new(options: BrakeOptions) -> Brake {
        Brake { options, is_released: false, since_s: f64::INFINITY }
    }

    /// Sets the brake command for the next `span_s`: released or closed.
    pub fn tell(&mut self, released: bool, span_s: f64) {
        self.since_s = if released == self.is_released { self.since_s + span_s } else { 0.0 };
        self.is_released = released;
    }

    /// Returns the value of the brake's object.
    pub fn word(&self) -> u32 {
        u32::from(self.is_released == self.options.released_by_one) << self.options.bit
    }

    /// Returns true if the brake is open, so that the axis may move.
    pub fn is_open(&self) -> bool {
        self.is_released && self.since_s >= f64::from(self.options.release_ns) * 1e-9
    }

    /// Returns true if the brake is closed, so that the motor may release the axis.
    pub fn is_closed(&self) -> bool {
        !self.is_released && self.since_s >= f64::from(self.options.close_ns) * 1e-9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_opens_and_closes_in_its_time_and_is_closed_at_first() {
        for (released_by_one, closed) in [(false, 8), (true, 0)] {
            let mut brake = Brake::new(BrakeOptions { bit: 3, released_by_one, ..BrakeOptions::default() });
            assert_eq!((brake.word(), brake.is_closed(), brake.is_open()), (closed, true, false));
            brake.tell(true, 0.001);
            assert_eq!((brake.word(), brake.is_closed(), brake.is_open()), (8 - closed, false, false));
            brake.tell(true, 0.1);
            assert!(brake.is_open());
            brake.tell(false, 0.001);
            assert_eq!((brake.word(), brake.is_closed(), brake.is_open()), (closed, false, false));
            brake.tell(false, 0.1);
            assert!(brake.is_closed());
        }
    }
}
