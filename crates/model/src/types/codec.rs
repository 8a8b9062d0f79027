// SPDX-License-Identifier: Apache-2.0
//! Conversion of values to bytes and back.
use super::{Scalar, Type};
use crate::quantity;
use crate::refusal::{Class, Refusal};
use crate::value::Value;
use indexmap::IndexMap;

impl Type {
    /// Encodes `value` as bytes: a number in `unit`, a quantity (`"20 ms"`), a list for an array, or a record for a struct.
    ///
    /// # Errors
    /// `ValueRefused` if the structure or the length of a list is wrong, a number is out of range, an integer has a fractional part, or a member is missing or unknown. `UnitMismatch` if a quantity has the wrong dimension.
    pub fn encode(&self, value: &Value, unit: &str) -> Result<Vec<u8>, Refusal> {
        let mut bytes = vec![0; self.size()];
        self.encode_into(value, unit, &mut bytes)?;
        Ok(bytes)
    }

    /// Decodes a value from the start of `bytes`.
    ///
    /// # Panics
    /// Panics if there are fewer bytes than [`Type::size`].
    pub fn decode(&self, bytes: &[u8]) -> Value {
        match self {
            Type::Scalar(scalar) => scalar.decode(bytes),
            Type::Array(element, count) => Value::List(bytes.chunks_exact(element.size()).take(*count).map(|chunk| element.decode(chunk)).collect()),
            Type::Struct(members) => {
                let values = members.iter().zip(self.offsets());
                Value::Record(values.map(|(m, at)| (m.name.clone(), m.member_type.decode(&bytes[at..]))).collect())
            }
        }
    }

    fn encode_into(&self, value: &Value, unit: &str, bytes: &mut [u8]) -> Result<(), Refusal> {
        match (self, value) {
            (Type::Scalar(scalar), _) => scalar.encode(value, unit, bytes),
            (Type::Array(element, count), Value::List(values)) if values.len() == *count => {
                for (at, (value, chunk)) in values.iter().zip(bytes.chunks_exact_mut(element.size())).enumerate() {
                    element.encode_into(value, unit, chunk).map_err(|r| r.for_what(&format!("element {at}")))?;
                }
                Ok(())
            }
            (Type::Array(_, count), Value::List(values)) => {
                Err(refused(format!("{self} takes {count} values, not {}", values.len())).remedy(format!("give a list of {count}")))
            }
            (Type::Array(_, count), _) => {
                Err(refused(format!("{self} takes a list of {count}, not {}", value.described())).remedy(format!("give a list of {count}")))
            }
            (Type::Struct(_), Value::Record(values)) => self.encode_record(values, unit, bytes),
            (Type::Struct(members), Value::List(values)) if values.len() == members.len() => {
                let values = members.iter().map(|m| m.name.clone()).zip(values.iter().cloned()).collect();
                self.encode_record(&values, unit, bytes)
            }
            (Type::Struct(_), _) => Err(refused(format!("{self} takes a record of its members, not {}", value.described()))),
        }
    }

    fn encode_record(&self, values: &IndexMap<String, Value>, unit: &str, bytes: &mut [u8]) -> Result<(), Refusal> {
        let Type::Struct(members) = self else { return Ok(()) };
        if let Some(name) = values.keys().find(|name| members.iter().all(|m| m.name != **name)) {
            return Err(refused(format!("{self} has no member '{name}'")).remedy(hints::did_you_mean(name, members.iter().map(|m| m.name.as_str()))));
        }
        for (member, at) in members.iter().zip(self.offsets()) {
            let Some(value) = values.get(&member.name) else {
                return Err(refused(format!("the member '{}' of {self} is missing", member.name)));
            };
            let end = at + member.member_type.size();
            let encoded = member.member_type.encode_into(value, unit, &mut bytes[at..end]);
            encoded.map_err(|r| r.for_what(&format!("member '{}'", member.name)))?;
        }
        Ok(())
    }
}

impl Scalar {
    fn encode(self, value: &Value, unit: &str, bytes: &mut [u8]) -> Result<(), Refusal> {
        match self {
            Scalar::Bool => match value {
                Value::Bool(value) => bytes[0] = u8::from(*value),
                _ => return Err(refused(format!("bool takes true or false, not {}", value.described()))),
            },
            Scalar::Double => bytes.copy_from_slice(&self.number(value, unit)?.to_le_bytes()),
            Scalar::Float => {
                let number = self.number(value, unit)?;
                if number.is_finite() && !(number as f32).is_finite() {
                    return Err(refused(format!("{number} is out of range for float")));
                }
                bytes.copy_from_slice(&(number as f32).to_le_bytes());
            }
            _ => {
                let integer = self.integer(value, unit)?;
                let (least, most) = self.range();
                if integer < least || integer > most {
                    return Err(refused(format!("{integer} does not fit {} ({least} to {most})", self.name())));
                }
                bytes.copy_from_slice(&integer.to_le_bytes()[..self.size()]);
            }
        }
        Ok(())
    }

    fn number(self, value: &Value, unit: &str) -> Result<f64, Refusal> {
        match value {
            Value::Integer(value) => Ok(*value as f64),
            Value::Unsigned(value) => Ok(*value as f64),
            Value::Number(value) if !value.is_nan() => Ok(*value),
            Value::Text(text) => quantity::number_in(text, unit),
            _ => Err(refused(format!("{} takes a number, not {}", self.name(), value.described()))),
        }
    }

    fn integer(self, value: &Value, unit: &str) -> Result<i128, Refusal> {
        match value {
            Value::Integer(value) => Ok(i128::from(*value)),
            Value::Unsigned(value) => Ok(i128::from(*value)),
            Value::Text(text) if text.trim().parse::<i128>().is_ok() => Ok(text.trim().parse().expect("it was parsed a line above")),
            Value::Text(text) => {
                let number = quantity::number_in(text, unit)?;
                if number.fract() == 0.0 && number.abs() < 1e30 {
                    Ok(number as i128)
                } else {
                    Err(refused(format!("'{text}' is {number}, but {} takes whole numbers", self.name())))
                }
            }
            _ => Err(refused(format!("{} takes a whole number, not {}", self.name(), value.described())).remedy("round it if that is what you mean")),
        }
    }

    const fn range(self) -> (i128, i128) {
        let bits = 8 * self.size() as u32;
        match self {
            Scalar::Uint8 | Scalar::Uint16 | Scalar::Uint32 | Scalar::Uint64 => (0, (1 << bits) - 1),
            _ => (-(1 << (bits - 1)), (1 << (bits - 1)) - 1),
        }
    }

    fn decode(self, bytes: &[u8]) -> Value {
        let mut wide = [0; 8];
        wide[..self.size()].copy_from_slice(&bytes[..self.size()]);
        let unsigned = u64::from_le_bytes(wide);
        let shift = 64 - 8 * self.size() as u32;
        match self {
            Scalar::Bool => Value::Bool(bytes[0] != 0),
            Scalar::Float => Value::Number(f64::from(f32::from_bits(unsigned as u32))),
            Scalar::Double => Value::Number(f64::from_bits(unsigned)),
            Scalar::Uint8 | Scalar::Uint16 | Scalar::Uint32 | Scalar::Uint64 => i64::try_from(unsigned).map_or(Value::Unsigned(unsigned), Value::Integer),
            _ => Value::Integer((unsigned << shift) as i64 >> shift),
        }
    }
}

fn refused(message: String) -> Refusal {
    Refusal::new(Class::ValueRefused, message)
}
