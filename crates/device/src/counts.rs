// SPDX-License-Identifier: Apache-2.0
//! Channels whose value is derived from counts: value = counts × scale + offset, where the counts come from an object dictionary entry, a
//! terminal or a register.
use crate::option_word::{Kind, OptionWord};
use crate::types::Number;
use serde::Deserialize;
use serde_json::Value;

/// Maximum scale and offset; a double still resolves single counts far above it.
const FARTHEST: f64 = 1e15;

/// Numeric options of a channel whose value is derived from counts.
pub const WORDS: [OptionWord; 3] = [
    OptionWord::with_default("scale", Kind::Number, "1", "value of one count").within(-FARTHEST, FARTHEST),
    OptionWord::with_default("offset", Kind::Number, "0", "its value at 0 counts").within(-FARTHEST, FARTHEST),
    OptionWord::with_default("safe", Kind::Number, "off, or 0 counts", "value at which an output is left").within(-FARTHEST, FARTHEST),
];

/// Options of a channel whose value is derived from counts, except its address on the bus.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct CountsOptions {
    scale: Option<f64>,
    offset: Option<f64>,
    unit: Option<String>,
    safe: Option<Value>,
}

impl CountsOptions {
    /// Returns true if the value is a double, counts × scale + offset, rather than the raw counts.
    pub fn is_scaled(&self) -> bool {
        self.scale.is_some() || self.offset.is_some()
    }

    pub fn unit(&self) -> &str {
        self.unit.as_deref().unwrap_or("")
    }

    /// Returns the conversion for numbers of this type with `bits` bits.
    pub fn counts(&self, number: Number, bits: u32) -> Counts {
        Counts { number, bits, scale: self.scale.unwrap_or(1.0), offset: self.offset.unwrap_or(0.0) }
    }

    /// Returns the safe value; by default off, or 0 counts.
    pub fn safe(&self) -> f64 {
        let off = self.offset.unwrap_or(0.0);
        match &self.safe {
            Some(Value::Bool(on)) => f64::from(u8::from(*on)),
            Some(value) => value.as_f64().unwrap_or(off),
            None => off,
        }
    }

    /// Returns a human-readable reason why the options are invalid; `None` if they are valid.
    pub fn problem(&self, is_digital: bool, is_output: bool) -> Option<String> {
        if is_digital && (self.is_scaled() || self.unit.is_some()) {
            return Some("is a single bit: it cannot have a scale, offset or unit".to_owned());
        }
        if self.scale.is_some_and(|scale| !scale.is_normal()) {
            return Some("cannot have scale 0: its value is counts × scale + offset".to_owned());
        }
        match &self.safe {
            Some(_) if !is_output => Some("is an input: it cannot have a safe value".to_owned()),
            Some(value) if is_digital != value.is_boolean() || !(value.is_boolean() || value.is_number()) => {
                Some(format!("cannot have the safe value {value}; give true or false for an output of one bit, and a number for others"))
            }
            _ => None,
        }
    }
}

/// Conversion between counts on a bus and a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    pub number: Number,
    /// Number of bits, at most the width of the number.
    pub bits: u32,
    pub scale: f64,
    pub offset: f64,
}

impl Counts {
    /// Returns the identity conversion, at the full width of the C type.
    pub fn of(number: Number) -> Counts {
        Counts { number, bits: 8 * number.width() as u32, scale: 1.0, offset: 0.0 }
    }

    /// Converts counts, the least significant bits of `raw`, to a value. Real-time safe.
    pub fn value(&self, raw: u64) -> f64 {
        let unused = 64 - self.bits;
        let counts = match self.number {
            Number::Int8 | Number::Int16 | Number::Int32 | Number::Int64 => ((raw << unused) as i64 >> unused) as f64,
            Number::Float => f32::from_bits(raw as u32).into(),
            Number::Double => f64::from_bits(raw),
            _ => (raw << unused >> unused) as f64,
        };
        self.scale * counts + self.offset
    }

    /// Returns the counts nearest to a value, in the least significant bits, and true if the value is in range. A value outside the range
    /// is clamped to its end, never to infinity. Returns `None` for NaN. Real-time safe.
    pub fn counts(&self, value: f64) -> Option<(u64, bool)> {
        let exact = (value - self.offset) / self.scale;
        let unused = 64 - self.bits;
        // The casts saturate. As doubles the ends of 64-bit ranges are one too large, and no double lies between.
        let (raw, least, most, counts) = match self.number {
            Number::Int8 | Number::Int16 | Number::Int32 | Number::Int64 => {
                let (least, most) = (i64::MIN >> unused, i64::MAX >> unused);
                ((exact.round() as i64).clamp(least, most) as u64 & u64::MAX >> unused, least as f64, most as f64, exact.round())
            }
            Number::Float => {
                let (least, most) = (f64::from(f32::MIN), f64::from(f32::MAX));
                (u64::from((exact.clamp(least, most) as f32).to_bits()), least, most, exact)
            }
            Number::Double => (exact.clamp(f64::MIN, f64::MAX).to_bits(), f64::MIN, f64::MAX, exact),
            _ => ((exact.round() as u64).min(u64::MAX >> unused), 0.0, (u64::MAX >> unused) as f64, exact.round()),
        };
        (!exact.is_nan()).then_some((raw, (least..=most).contains(&counts)))
    }
}

/// Returns a message about the first two entries that have the same name or the same address on a bus; `place` formats an address.
pub fn given_twice<P: PartialEq>(all: &[(&str, P)], place: impl Fn(&P) -> String) -> Option<String> {
    all.iter().enumerate().find_map(|(index, (name, at))| {
        all[..index].iter().find_map(|(before, taken)| match () {
            () if before == name => Some(format!("'{name}' is named twice")),
            () if taken == at => Some(format!("'{before}' and '{name}' are both {}", place(at))),
            () => None,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_value_beyond_its_counts_is_told_as_the_last_of_them() {
        let narrow = Counts { bits: 12, ..Counts::of(Number::Int16) };
        assert_eq!((narrow.value(0xFFF), narrow.counts(-1.0)), (-1.0, Some((0xFFF, true))));
        assert_eq!([narrow.counts(1e9), narrow.counts(-1e9)], [Some((0x7FF, false)), Some((0x800, false))]);
        let scaled = Counts { scale: 0.5, offset: -10.0, ..Counts::of(Number::Uint8) };
        assert_eq!((scaled.value(60), scaled.counts(20.0), scaled.counts(-11.0)), (20.0, Some((60, true)), Some((0, false))));
        for (number, most) in [(Number::Float, f64::from(f32::MAX)), (Number::Double, f64::MAX), (Number::Uint64, 18_446_744_073_709_551_615.0)] {
            let (raw, fits) = Counts::of(number).counts(f64::INFINITY).expect("a number");
            assert_eq!((Counts::of(number).value(raw), fits), (most, false), "{number:?}");
        }
        assert_eq!(scaled.counts(f64::NAN), None);
    }

    #[test]
    fn what_cannot_be_says_why() {
        let problem = |options: Value, is_digital: bool, is_output: bool| {
            let options: CountsOptions = serde_json::from_value(options).expect("options");
            options.problem(is_digital, is_output).unwrap_or_default()
        };
        assert!(problem(json!({ "unit": "V" }), true, false).contains("a single bit"));
        assert!(problem(json!({ "scale": 0 }), false, false).contains("scale 0"));
        assert!(problem(json!({ "safe": 1 }), false, false).contains("an input"));
        assert!(problem(json!({ "safe": 1 }), true, true).contains("true or false"));
        assert_eq!(problem(json!({ "safe": 1, "scale": 2 }), false, true), "");
    }

    #[test]
    fn names_and_places_are_given_once() {
        let at = |at: &i32| format!("at {at}");
        assert_eq!(given_twice(&[("a", 1), ("b", 2)], at), None);
        assert_eq!(given_twice(&[("a", 1), ("b", 2), ("a", 3)], at).as_deref(), Some("'a' is named twice"));
        assert_eq!(given_twice(&[("a", 1), ("b", 2), ("c", 2)], at).as_deref(), Some("'b' and 'c' are both at 2"));
    }
}
