// SPDX-License-Identifier: Apache-2.0
//! Interpretation of registers: numbers that span one to four of them, in one of four byte orders, with scale and offset; single bits.
use device::counts::Counts;
use device::{Number, Type};
use serde::Deserialize;

/// Number type in registers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Of {
    Int16,
    #[default]
    Uint16,
    Int32,
    Uint32,
    Int64,
    Uint64,
    Float,
    Double,
}

impl Of {
    pub(super) const NAMES: &'static str = "int16, uint16, int32, uint32, int64, uint64, float or double";

    /// Returns the number of registers of the type.
    pub(super) fn registers(self) -> u16 {
        match self {
            Of::Int16 | Of::Uint16 => 1,
            Of::Int32 | Of::Uint32 | Of::Float => 2,
            Of::Int64 | Of::Uint64 | Of::Double => 4,
        }
    }

    /// Returns the corresponding C type.
    fn number(self) -> Number {
        match self {
            Of::Int16 => Number::Int16,
            Of::Uint16 => Number::Uint16,
            Of::Int32 => Number::Int32,
            Of::Uint32 => Number::Uint32,
            Of::Int64 => Number::Int64,
            Of::Uint64 => Number::Uint64,
            Of::Float => Number::Float,
            Of::Double => Number::Double,
        }
    }

    /// Returns the conversion for this type with a scale and an offset.
    fn counts(self, scale: f64, offset: f64) -> Counts {
        Counts { scale, offset, ..Counts::of(self.number()) }
    }
}

/// Returns the least significant bits of counts as big-endian bytes.
fn bytes_of(counts: &Counts, raw: u64) -> [u8; 8] {
    (raw << (64 - counts.bits)).to_be_bytes()
}

/// Returns the counts in these big-endian bytes.
fn raw_of(counts: &Counts, bytes: [u8; 8]) -> u64 {
    u64::from_be_bytes(bytes) >> (64 - counts.bits)
}

/// Byte order of a number, in the notation of device manuals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub(super) enum Order {
    /// Order of the standard: most significant word first, each word big-endian.
    #[default]
    #[serde(rename = "ABCD")]
    Abcd,
    /// Least significant word first.
    #[serde(rename = "CDAB")]
    Cdab,
    #[serde(rename = "BADC")]
    Badc,
    #[serde(rename = "DCBA")]
    Dcba,
}

impl Order {
    /// Converts bytes from wire order to big-endian or back; each order is its own inverse.
    fn turn(self, bytes: &mut [u8]) {
        if matches!(self, Order::Cdab | Order::Dcba) {
            let words = bytes.len() / 2;
            for word in 0..words / 2 {
                let other = words - 1 - word;
                bytes.swap(2 * word, 2 * other);
                bytes.swap(2 * word + 1, 2 * other + 1);
            }
        }
        if matches!(self, Order::Badc | Order::Dcba) {
            bytes.chunks_exact_mut(2).for_each(|word| word.swap(0, 1));
        }
    }
}

/// Format of a channel in registers or in a bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    /// A coil or a discrete input.
    Coil,
    /// A bit of a register.
    Bit(u8),
    /// `value = scale * number + offset`, where the number is the high or the low byte of a register, as a double.
    Byte { is_high: bool, scale: f64, offset: f64 },
    /// `value = scale * number + offset`, as a double.
    Scaled { of: Of, order: Order, scale: f64, offset: f64 },
    /// Plain number, in the C type with the same name.
    Raw { of: Of, order: Order },
}

impl Form {
    pub(super) fn registers(&self) -> u16 {
        match self {
            Form::Coil | Form::Bit(_) | Form::Byte { .. } => 1,
            Form::Scaled { of, .. } | Form::Raw { of, .. } => of.registers(),
        }
    }

    /// Returns the mask of the channel's bits in its register; all bits if it occupies whole registers.
    pub(super) fn mask(&self) -> u16 {
        match self {
            Form::Bit(bit) => 1 << bit,
            Form::Byte { is_high, .. } => 0xFF << shift(*is_high),
            Form::Coil | Form::Scaled { .. } | Form::Raw { .. } => u16::MAX,
        }
    }

    /// Returns the type of the channel.
    pub(super) fn channel_type(&self) -> Type {
        match self {
            Form::Coil | Form::Bit(_) => Type::BOOL,
            Form::Byte { .. } | Form::Scaled { .. } => Type::DOUBLE,
            Form::Raw { of, .. } => Type::of(of.number()),
        }
    }

    /// Converts registers on the wire to a channel. Both must have the length required by the format; shorter slices are ignored.
    pub(super) fn read(&self, wire: &[u8], channel: &mut [u8]) {
        let len = 2 * usize::from(self.registers());
        let (Some(wire), true) = (wire.get(..len), channel.len() == self.channel_type().len()) else { return };
        let mut bytes = [0; 8];
        bytes[..len].copy_from_slice(wire);
        match *self {
            Form::Coil => channel[0] = bytes[1] & 1,
            Form::Byte { is_high, scale, offset } => {
                let counts = byte(scale, offset);
                channel.copy_from_slice(&counts.value(bytes[usize::from(!is_high)].into()).to_ne_bytes());
            }
            Form::Bit(bit) => channel[0] = u8::from(u16::from_be_bytes([bytes[0], bytes[1]]) >> bit & 1 != 0),
            Form::Scaled { of, order, scale, offset } => {
                order.turn(&mut bytes[..len]);
                let counts = of.counts(scale, offset);
                channel.copy_from_slice(&counts.value(raw_of(&counts, bytes)).to_ne_bytes());
            }
            Form::Raw { order, .. } => {
                order.turn(&mut bytes[..len]);
                native(&mut bytes[..len]);
                channel.copy_from_slice(&bytes[..len]);
            }
        }
    }

    /// Converts a channel to its wire format. Returns the bytes, and true if the value was in range; otherwise, the bytes are those of
    /// the nearest value. Returns `None` for NaN.
    pub(super) fn write(&self, channel: &[u8]) -> Option<([u8; 8], bool)> {
        let len = 2 * usize::from(self.registers());
        match *self {
            Form::Coil => Some(([*channel.first()?, 0, 0, 0, 0, 0, 0, 0], true)),
            Form::Bit(bit) => Some((in_register(u16::from(*channel.first()? != 0) << bit), true)),
            Form::Byte { is_high, scale, offset } => {
                let (counts, fits) = byte(scale, offset).counts(f64::from_ne_bytes(channel.try_into().ok()?))?;
                Some((in_register((counts as u16) << shift(is_high)), fits))
            }
            Form::Scaled { of, order, scale, offset } => written(&of.counts(scale, offset), order, f64::from_ne_bytes(channel.try_into().ok()?)),
            Form::Raw { of: of @ (Of::Float | Of::Double), order } => {
                let value = match of {
                    Of::Float => f64::from(f32::from_ne_bytes(channel.try_into().ok()?)),
                    _ => f64::from_ne_bytes(channel.try_into().ok()?),
                };
                written(&of.counts(1.0, 0.0), order, value)
            }
            Form::Raw { order, .. } => {
                let mut bytes = [0; 8];
                bytes[..len].copy_from_slice(channel.get(..len)?);
                native(&mut bytes[..len]);
                order.turn(&mut bytes[..len]);
                Some((bytes, true))
            }
        }
    }
}

/// Returns a value in its wire format, and true if it was in range.
fn written(counts: &Counts, order: Order, value: f64) -> Option<([u8; 8], bool)> {
    let (raw, fits) = counts.counts(value)?;
    let mut bytes = bytes_of(counts, raw);
    order.turn(&mut bytes[..counts.bits as usize / 8]);
    Some((bytes, fits))
}

/// Returns the conversion of a single byte.
fn byte(scale: f64, offset: f64) -> Counts {
    Counts { scale, offset, ..Counts::of(Number::Uint8) }
}

/// Returns the number of bits by which a byte is shifted within its register.
fn shift(is_high: bool) -> u32 {
    if is_high { 8 } else { 0 }
}

/// Returns the two bytes of a register in wire order, followed by zeros.
fn in_register(value: u16) -> [u8; 8] {
    let [high, low] = value.to_be_bytes();
    [high, low, 0, 0, 0, 0, 0, 0]
}

/// Converts bytes from big-endian to the byte order of this machine, or back.
fn native(bytes: &mut [u8]) {
    if cfg!(target_endian = "little") {
        bytes.reverse();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scaled(of: Of, order: Order) -> Form {
        Form::Scaled { of, order, scale: 1.0, offset: 0.0 }
    }

    fn there_and_back(form: Form, value: f64) -> f64 {
        let (wire, fits) = form.write(&value.to_ne_bytes()).expect("a number");
        assert!(fits, "{form:?} {value}");
        let mut channel = [0; 8];
        form.read(&wire, &mut channel);
        f64::from_ne_bytes(channel)
    }

    #[test]
    fn each_order_is_as_manuals_write_it() {
        let value = f64::from(0x4142_4344);
        for (order, wire) in [(Order::Abcd, b"ABCD"), (Order::Cdab, b"CDAB"), (Order::Badc, b"BADC"), (Order::Dcba, b"DCBA")] {
            let form = scaled(Of::Uint32, order);
            assert_eq!(&form.write(&value.to_ne_bytes()).expect("a number").0[..4], wire);
            assert_eq!(there_and_back(form, value), value);
        }
    }

    #[test]
    fn every_number_comes_back() {
        for (of, values) in [
            (Of::Int16, &[-32768.0, -1.0, 32767.0][..]),
            (Of::Uint16, &[0.0, 65535.0]),
            (Of::Int32, &[-2147483648.0, 2147483647.0]),
            (Of::Uint32, &[4294967295.0]),
            (Of::Int64, &[-9007199254740992.0]),
            (Of::Uint64, &[9007199254740992.0]),
            (Of::Float, &[-0.5, 1.25e6]),
            (Of::Double, &[0.1, -1e300]),
        ] {
            for (order, value) in [Order::Abcd, Order::Cdab, Order::Badc, Order::Dcba].into_iter().flat_map(|o| values.iter().map(move |v| (o, *v))) {
                assert_eq!(there_and_back(scaled(of, order), value), value, "{of:?} {order:?}");
            }
        }
    }

    #[test]
    fn a_scale_is_undone_and_what_is_too_large_is_told() {
        let form = Form::Scaled { of: Of::Int16, order: Order::Abcd, scale: 0.1, offset: -40.0 };
        let mut channel = [0; 8];
        form.read(&[0x02, 0x8A], &mut channel);
        assert_eq!(f64::from_ne_bytes(channel), 25.0);
        assert_eq!(form.write(&25.0_f64.to_ne_bytes()), Some(([0x02, 0x8A, 0, 0, 0, 0, 0, 0], true)));
        assert_eq!(form.write(&1e9_f64.to_ne_bytes()), Some(([0x7F, 0xFF, 0, 0, 0, 0, 0, 0], false)));
        assert_eq!(form.write(&f64::NAN.to_ne_bytes()), None);
        assert!(!scaled(Of::Float, Order::Abcd).write(&f64::INFINITY.to_ne_bytes()).expect("a number").1);
    }

    #[test]
    fn a_number_beyond_the_range_is_written_as_the_nearest_and_never_as_infinity() {
        for (of, most) in [(Of::Float, f64::from(f32::MAX)), (Of::Double, f64::MAX)] {
            for value in [1e39, f64::INFINITY, -1e39, f64::NEG_INFINITY].into_iter().filter(|value| value.abs() > most) {
                let raw = Form::Raw { of, order: Order::Cdab };
                let native = if of == Of::Float { (value as f32).to_ne_bytes().to_vec() } else { value.to_ne_bytes().to_vec() };
                for (form, channel) in [(scaled(of, Order::Cdab), value.to_ne_bytes().to_vec()), (raw, native)] {
                    let (wire, fits) = form.write(&channel).expect("a number");
                    let mut back = [0; 8];
                    scaled(of, Order::Cdab).read(&wire, &mut back);
                    assert_eq!((f64::from_ne_bytes(back), fits), (most.copysign(value), false), "{form:?} {value}");
                }
            }
        }
        // A very small scale makes a number that exceeds the range of a double.
        let form = Form::Scaled { of: Of::Double, order: Order::Abcd, scale: 1e-300, offset: 0.0 };
        assert_eq!(form.write(&1e300_f64.to_ne_bytes()), Some((f64::MAX.to_be_bytes(), false)));
        assert_eq!(Form::Raw { of: Of::Float, order: Order::Abcd }.write(&f32::NAN.to_ne_bytes()), None);
    }

    #[test]
    fn a_raw_one_has_the_type_of_c() {
        let form = Form::Raw { of: Of::Int32, order: Order::Cdab };
        assert_eq!(form.channel_type().to_string(), "int32_t");
        let (wire, _) = form.write(&(-2_i32).to_ne_bytes()).expect("four bytes");
        assert_eq!(wire[..4], [0xFF, 0xFE, 0xFF, 0xFF]);
        let mut channel = [0; 4];
        form.read(&wire, &mut channel);
        assert_eq!(i32::from_ne_bytes(channel), -2);
        let mut bit = [0];
        Form::Bit(9).read(&[0x02, 0x00], &mut bit);
        assert_eq!(bit, [1]);
        assert_eq!(Form::Bit(9).write(&[1]), Some(([0x02, 0, 0, 0, 0, 0, 0, 0], true)));
    }

    #[test]
    fn a_byte_of_a_register_is_a_number_that_saturates() {
        let form = |is_high| Form::Byte { is_high, scale: 0.5, offset: -10.0 };
        for (is_high, mask, wire) in [(true, 0xFF00, [60, 0]), (false, 0x00FF, [0, 60])] {
            assert_eq!(form(is_high).mask(), mask);
            let (written, fits) = form(is_high).write(&20.0_f64.to_ne_bytes()).expect("a number");
            assert_eq!((&written[..2], fits), (&wire[..], true));
            let mut channel = [0; 8];
            form(is_high).read(&wire, &mut channel);
            assert_eq!(f64::from_ne_bytes(channel), 20.0);
        }
        assert_eq!(form(false).write(&1e9_f64.to_ne_bytes()), Some(([0, 255, 0, 0, 0, 0, 0, 0], false)));
        assert_eq!(form(true).write(&f64::NEG_INFINITY.to_ne_bytes()), Some(([0; 8], false)));
        assert_eq!(form(true).write(&f64::NAN.to_ne_bytes()), None);
    }
}
