// SPDX-License-Identifier: Apache-2.0
//! Registers of a servo, and the interpretation of their values. The names are those in the manufacturer's control table.
use super::protocol::Protocol;
use std::f64::consts::TAU;

/// 0 °C, in K.
const ICE: f64 = 273.15;

/// Unit of the watchdog's register, ns.
pub(super) const WATCHDOG_UNIT_NS: i64 = 20_000_000;
/// Maximum timeout of the watchdog, in those units.
pub(super) const WATCHDOG_UNITS_MAX: i64 = 127;

/// A register: its address and length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Register {
    pub(super) address: u16,
    pub(super) len: u16,
}

/// Registers that the driver uses on one type of servo.
#[derive(Debug)]
pub(super) struct Map {
    pub(super) model: Register,
    /// Register that determines whether writes are answered.
    pub(super) answers: Register,
    /// Minimum value of `answers` with which writes are answered.
    pub(super) answers_min: u32,
    pub(super) mode: Register,
    /// Modes in which a goal is a position.
    pub(super) modes: &'static [u32],
    pub(super) offset: Register,
    pub(super) torque: Register,
    pub(super) goal: Register,
    pub(super) error: Register,
    /// Registers that are read in each exchange.
    pub(super) present: Register,
    /// Watchdog of the servo itself, if it has one.
    pub(super) watchdog: Option<Register>,
    /// Names of the bits of `error`; an unused bit has an empty name.
    pub(super) errors: [&'static str; 6],
    /// Bits of `error` that stop the servo.
    pub(super) grave: u8,
    /// Baud rates to which servos of this type may be set, the manufacturer's default first.
    pub(super) bauds: &'static [u32],
}

const fn at(address: u16, len: u16) -> Register {
    Register { address, len }
}

static STS: Map = Map {
    model: at(3, 2),
    answers: at(8, 1),
    answers_min: 1,
    mode: at(33, 1),
    modes: &[0],
    offset: at(31, 2),
    torque: at(40, 1),
    goal: at(42, 2),
    error: at(65, 1),
    present: at(56, 15),
    watchdog: None,
    errors: ["voltage", "sensor", "overheat", "overcurrent", "angle", "overload"],
    grave: 0b10_1110,
    bauds: &[1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400],
};

static DYNAMIXEL: Map = Map {
    model: at(0, 2),
    answers: at(68, 1),
    answers_min: 2,
    mode: at(11, 1),
    modes: &[3, 4, 5],
    offset: at(20, 4),
    torque: at(64, 1),
    goal: at(116, 4),
    error: at(70, 1),
    present: at(126, 21),
    watchdog: Some(at(98, 1)),
    errors: ["voltage", "", "overheat", "encoder", "electrical shock", "overload"],
    grave: 0b11_1100,
    bauds: &[57_600, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 115_200, 9_600],
};

/// Quantity from which a model's effort is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Effort {
    /// Load only, in thousandths of its maximum.
    Load,
    /// Current only, with the amperes per count.
    Current(f64),
    Both(f64),
}

/// A model of servo.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) name: &'static str,
    /// Model number reported by the servo; `None` if any is accepted.
    pub(super) number: Option<u32>,
    pub(super) effort: Effort,
}

const fn model(name: &'static str, number: u32, effort: Effort) -> Model {
    Model { name, number: Some(number), effort }
}

/// Counts per revolution, for every model here.
pub(super) const TURN: f64 = 4096.0;

static STS_MODELS: [Model; 3] = [
    model("sts3215", 777, Effort::Both(0.0065)),
    model("sts3250", 2825, Effort::Both(0.0065)),
    Model { name: "sts", number: None, effort: Effort::Both(0.0065) },
];

static DYNAMIXEL_MODELS: [Model; 9] = [
    model("xl330-m288", 1200, Effort::Current(0.001)),
    model("xl330-m077", 1190, Effort::Current(0.001)),
    model("xl430-w250", 1060, Effort::Load),
    model("xc430-w150", 1070, Effort::Load),
    model("xm430-w350", 1020, Effort::Current(0.00269)),
    model("xm430-w210", 1030, Effort::Current(0.00269)),
    model("xm540-w270", 1120, Effort::Current(0.00269)),
    model("xm540-w150", 1130, Effort::Current(0.00269)),
    Model { name: "x", number: None, effort: Effort::Load },
];

/// Readings of a servo in each exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Present {
    pub(super) counts: f64,
    /// Velocity, rad/s, before the direction is applied.
    pub(super) velocity: f64,
    /// Load, as a fraction of the maximum.
    pub(super) load: f64,
    /// Current, counts.
    pub(super) current: f64,
    /// V.
    pub(super) voltage: f64,
    /// K.
    pub(super) temperature: f64,
    /// Error bits (Feetech).
    pub(super) error: u8,
}

impl Map {
    pub(super) fn of(protocol: Protocol) -> &'static Map {
        match protocol {
            Protocol::Sts => &STS,
            Protocol::Dynamixel => &DYNAMIXEL,
        }
    }

    /// Returns the names of the set error bits, joined.
    pub(super) fn named(&self, bits: u8) -> String {
        let names = self.errors.iter().enumerate().filter(|(bit, name)| bits & (1 << bit) != 0 && !name.is_empty());
        names.map(|(_, name)| *name).collect::<Vec<_>>().join(" and ")
    }
}

impl Model {
    pub(super) fn all(protocol: Protocol) -> &'static [Model] {
        match protocol {
            Protocol::Sts => &STS_MODELS,
            Protocol::Dynamixel => &DYNAMIXEL_MODELS,
        }
    }

    /// Returns the name of the servo model with that number.
    pub(super) fn called(protocol: Protocol, number: u32) -> &'static str {
        let all = Model::all(protocol);
        all.iter().find(|model| model.number == Some(number)).or(all.last()).map_or("", |model| model.name)
    }
}

/// Decodes a little-endian number of up to four bytes.
pub(super) fn whole(bytes: &[u8]) -> u32 {
    bytes.iter().take(4).rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}

/// Decodes a sign-magnitude number whose sign is bit `bit`.
fn signed_by(bit: u32, number: u32) -> f64 {
    let size = f64::from(number & ((1 << bit) - 1));
    if number & (1 << bit) == 0 { size } else { -size }
}

/// Decodes a two-byte number in two's complement.
fn short(bytes: &[u8]) -> f64 {
    f64::from(whole(bytes) as u16 as i16)
}

impl Protocol {
    /// Returns the readings in a servo's register `present`; `None` if bytes are missing.
    pub(super) fn present(self, bytes: &[u8]) -> Option<Present> {
        let field = |at: usize, len: usize| bytes.get(at..at + len);
        let one = |at: usize| field(at, 1).map(whole);
        Some(match self {
            Protocol::Sts => Present {
                counts: signed_by(15, whole(field(0, 2)?)),
                velocity: signed_by(15, whole(field(2, 2)?)) * TAU / TURN,
                load: signed_by(10, whole(field(4, 2)?) & 0x7ff) * 1e-3,
                current: signed_by(15, whole(field(13, 2)?)),
                voltage: f64::from(one(6)?) * 0.1,
                temperature: ICE + f64::from(one(7)?),
                error: one(9)? as u8,
            },
            Protocol::Dynamixel => Present {
                counts: f64::from(whole(field(6, 4)?) as i32),
                velocity: f64::from(whole(field(2, 4)?) as i32) * 0.229 * TAU / 60.0,
                load: short(field(0, 2)?) * 1e-3,
                current: short(field(0, 2)?),
                voltage: f64::from(whole(field(18, 2)?)) * 0.1,
                temperature: ICE + f64::from(one(20)?),
                error: 0,
            },
        })
    }

    /// Converts a position to the format of the goal register; only the first `Map::goal.len` bytes are used.
    pub(super) fn goal(self, counts: f64) -> [u8; 4] {
        let counts = counts.round().clamp(-1_048_575.0, 1_048_575.0) as i32;
        match self {
            Protocol::Sts => {
                let size = counts.unsigned_abs().min(0x7fff);
                (size | if counts < 0 { 0x8000 } else { 0 }).to_le_bytes()
            }
            Protocol::Dynamixel => counts.to_le_bytes(),
        }
    }

    /// Converts a homing offset from the format of its register.
    pub(super) fn offset(self, number: u32) -> i64 {
        match self {
            Protocol::Sts => signed_by(11, number & 0xfff) as i64,
            Protocol::Dynamixel => i64::from(number as i32),
        }
    }
}
