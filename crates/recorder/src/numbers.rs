// SPDX-License-Identifier: Apache-2.0
//! Extracts the numbers of a recorded value in memory order. Optimised for speed, because there may be millions of values.
use crate::json;
use model::types::{Scalar, Type};
use serde_json::Value as Json;

/// Returns the number of components of a value.
pub(crate) fn count(of: &Type) -> usize {
    match of {
        Type::Scalar(_) => 1,
        Type::Array(element, n) => n * count(element),
        Type::Struct(members) => members.iter().map(|member| count(&member.member_type)).sum(),
    }
}

/// Appends the numbers of a message `{"number": …, "value": …}`. Returns the message's number, or `None` if it is not a value of this
/// type.
pub(crate) fn read(of: &Type, data: &[u8], out: &mut Vec<f64>) -> Option<u64> {
    quick(of, data, out).or_else(|| {
        let message: Json = serde_json::from_slice(data).ok()?;
        let mut bytes = Vec::new();
        json::read(of, &message["value"], &mut bytes).then_some(())?;
        of_bytes(of, &bytes, out);
        Some(message["number"].as_u64().unwrap_or(0))
    })
}

/// Fast path of [`read`] for finite numbers in the format that the recorder writes.
fn quick(of: &Type, data: &[u8], out: &mut Vec<f64>) -> Option<u64> {
    let Type::Scalar(Scalar::Double | Scalar::Int32 | Scalar::Uint32 | Scalar::Int16 | Scalar::Uint16 | Scalar::Int8 | Scalar::Uint8) = of else {
        return None;
    };
    let text = std::str::from_utf8(data).ok()?.strip_prefix("{\"number\":")?;
    let (number, rest) = text.split_once(",\"value\":")?;
    let value = rest.strip_suffix('}')?.parse().ok()?;
    let number = number.parse().ok()?;
    out.push(value);
    Some(number)
}

/// Appends the numbers of a value from the memory layout of its type; a Boolean becomes 0 or 1.
pub(crate) fn of_bytes(of: &Type, bytes: &[u8], out: &mut Vec<f64>) {
    match of {
        Type::Scalar(scalar) => out.push(number(*scalar, bytes)),
        Type::Array(element, n) => (0..*n).for_each(|at| of_bytes(element, &bytes[at * element.size()..], out)),
        Type::Struct(members) => members.iter().zip(of.offsets()).for_each(|(member, offset)| of_bytes(&member.member_type, &bytes[offset..], out)),
    }
}

#[allow(clippy::cast_precision_loss, reason = "a picture needs no more digits than a double has")]
fn number(of: Scalar, bytes: &[u8]) -> f64 {
    fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
        *bytes.first_chunk().expect("a value has the bytes of its type")
    }
    match of {
        Scalar::Int8 => i8::from_le_bytes(first(bytes)).into(),
        Scalar::Int16 => i16::from_le_bytes(first(bytes)).into(),
        Scalar::Int32 => i32::from_le_bytes(first(bytes)).into(),
        Scalar::Int64 => i64::from_le_bytes(first(bytes)) as f64,
        Scalar::Uint8 => bytes[0].into(),
        Scalar::Uint16 => u16::from_le_bytes(first(bytes)).into(),
        Scalar::Uint32 => u32::from_le_bytes(first(bytes)).into(),
        Scalar::Uint64 => u64::from_le_bytes(first(bytes)) as f64,
        Scalar::Bool => u8::from(bytes[0] != 0).into(),
        Scalar::Float => f32::from_le_bytes(first(bytes)).into(),
        Scalar::Double => f64::from_le_bytes(first(bytes)),
    }
}
