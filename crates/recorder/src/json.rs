// SPDX-License-Identifier: Apache-2.0
//! Conversion of values to JSON and back without any loss of bits, and the schema of a type. Numbers that JSON cannot represent are
//! strings: "NaN", "Infinity", "-Infinity".
use model::types::{Scalar, Type};
use serde_json::{Map, Value as Json, json};
use std::io::Write;

/// Appends a value of a type as JSON.
pub(crate) fn write(of: &Type, bytes: &[u8], out: &mut Vec<u8>) {
    match of {
        Type::Scalar(scalar) => write_scalar(*scalar, bytes, out),
        Type::Array(inner, n) => {
            let size = inner.size();
            out.push(b'[');
            for index in 0..*n {
                if index > 0 {
                    out.push(b',');
                }
                write(inner, &bytes[index * size..], out);
            }
            out.push(b']');
        }
        Type::Struct(members) => {
            out.push(b'{');
            for (index, (member, offset)) in members.iter().zip(of.offsets()).enumerate() {
                // C identifiers need no escaping.
                let _infallible = write!(out, "{}\"{}\":", if index > 0 { "," } else { "" }, member.name);
                write(&member.member_type, &bytes[offset..], out);
            }
            out.push(b'}');
        }
    }
}

fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    *bytes.first_chunk().expect("a value has the bytes of its type")
}

fn write_scalar(of: Scalar, bytes: &[u8], out: &mut Vec<u8>) {
    let _infallible = match of {
        Scalar::Int8 => write!(out, "{}", i8::from_le_bytes(first(bytes))),
        Scalar::Int16 => write!(out, "{}", i16::from_le_bytes(first(bytes))),
        Scalar::Int32 => write!(out, "{}", i32::from_le_bytes(first(bytes))),
        Scalar::Int64 => write!(out, "{}", i64::from_le_bytes(first(bytes))),
        Scalar::Uint8 => write!(out, "{}", bytes[0]),
        Scalar::Uint16 => write!(out, "{}", u16::from_le_bytes(first(bytes))),
        Scalar::Uint32 => write!(out, "{}", u32::from_le_bytes(first(bytes))),
        Scalar::Uint64 => write!(out, "{}", u64::from_le_bytes(first(bytes))),
        Scalar::Bool => write!(out, "{}", bytes[0] != 0),
        Scalar::Float => match f32::from_le_bytes(first(bytes)) {
            x if x.is_finite() => write!(out, "{x:?}"),
            x => write!(out, "\"{}\"", beyond(x.into())),
        },
        Scalar::Double => match f64::from_le_bytes(first(bytes)) {
            x if x.is_finite() => write!(out, "{x:?}"),
            x => write!(out, "\"{}\"", beyond(x)),
        },
    };
}

fn beyond(x: f64) -> &'static str {
    match x {
        x if x.is_nan() => "NaN",
        x if x > 0.0 => "Infinity",
        _ => "-Infinity",
    }
}

/// Parses a value written by [`write`], and appends its bytes; returns false if the JSON is not a value of this type.
pub(crate) fn read(of: &Type, json: &Json, out: &mut Vec<u8>) -> bool {
    match (of, json) {
        (Type::Scalar(scalar), json) => read_scalar(*scalar, json, out).is_some(),
        (Type::Array(inner, n), Json::Array(items)) => items.len() == *n && items.iter().all(|item| read(inner, item, out)),
        (Type::Struct(members), Json::Object(given)) => {
            let start = out.len();
            let placed = members.iter().zip(of.offsets()).all(|(member, offset)| {
                out.resize(start + offset, 0);
                given.get(&member.name).is_some_and(|value| read(&member.member_type, value, out))
            });
            out.resize(start + of.size(), 0);
            placed
        }
        _ => false,
    }
}

fn read_scalar(of: Scalar, json: &Json, out: &mut Vec<u8>) -> Option<()> {
    match of {
        Scalar::Int8 => out.extend(i8::try_from(json.as_i64()?).ok()?.to_le_bytes()),
        Scalar::Int16 => out.extend(i16::try_from(json.as_i64()?).ok()?.to_le_bytes()),
        Scalar::Int32 => out.extend(i32::try_from(json.as_i64()?).ok()?.to_le_bytes()),
        Scalar::Int64 => out.extend(json.as_i64()?.to_le_bytes()),
        Scalar::Uint8 => out.extend(u8::try_from(json.as_u64()?).ok()?.to_le_bytes()),
        Scalar::Uint16 => out.extend(u16::try_from(json.as_u64()?).ok()?.to_le_bytes()),
        Scalar::Uint32 => out.extend(u32::try_from(json.as_u64()?).ok()?.to_le_bytes()),
        Scalar::Uint64 => out.extend(json.as_u64()?.to_le_bytes()),
        Scalar::Bool => out.push(u8::from(json.as_bool()?)),
        #[allow(clippy::cast_possible_truncation, reason = "it was written from a float: the nearest one is the same")]
        Scalar::Float => out.extend((number(json)? as f32).to_le_bytes()),
        Scalar::Double => out.extend(number(json)?.to_le_bytes()),
    }
    Some(())
}

fn number(json: &Json) -> Option<f64> {
    match json {
        Json::String(text) => match text.as_str() {
            "NaN" => Some(f64::NAN),
            "Infinity" => Some(f64::INFINITY),
            "-Infinity" => Some(f64::NEG_INFINITY),
            _ => None,
        },
        json => json.as_f64(),
    }
}

/// Returns the schema of the messages that contain values of a type: `{"number", "value"}`.
pub(crate) fn schema(of: &Type, unit: &str) -> Json {
    let mut value = schema_of(of);
    if !unit.is_empty() {
        value["description"] = json!(unit);
    }
    let number = json!({"type": "integer", "description": "number of the invocation that stored it"});
    json!({"type": "object", "properties": {"number": number, "value": value}})
}

fn schema_of(of: &Type) -> Json {
    match of {
        Type::Scalar(Scalar::Bool) => json!({"type": "boolean"}),
        Type::Scalar(Scalar::Float | Scalar::Double) => json!({"type": "number"}),
        Type::Scalar(_) => json!({"type": "integer"}),
        Type::Array(inner, _) => json!({"type": "array", "items": schema_of(inner)}),
        Type::Struct(members) => {
            let properties: Map<String, Json> = members.iter().map(|member| (member.name.clone(), schema_of(&member.member_type))).collect();
            json!({"type": "object", "properties": properties})
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indexmap::IndexMap;

    fn there_and_back(text: &str, bytes: &[u8]) {
        let of = Type::parse(text, &IndexMap::new()).expect("a type");
        assert_eq!(of.size(), bytes.len(), "{text}");
        let (mut written, mut back) = (Vec::new(), Vec::new());
        write(&of, bytes, &mut written);
        let json: Json = serde_json::from_slice(&written).unwrap_or_else(|why| panic!("{why}: {}", String::from_utf8_lossy(&written)));
        assert!(read(&of, &json, &mut back), "{json}");
        assert_eq!(back, bytes, "{json}");
    }

    #[test]
    fn every_number_comes_back_with_its_bits() {
        for x in [0.0, -0.0, 1.0, 0.1, 1e300, 5e-324, f64::MAX, -1.0 / 3.0, 1e16, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            there_and_back("double", &x.to_le_bytes());
        }
        for x in [0.1f32, -0.0, f32::MAX, 1e-45, f32::INFINITY] {
            there_and_back("float", &x.to_le_bytes());
        }
        there_and_back("uint64_t", &u64::MAX.to_le_bytes());
        there_and_back("int64_t", &i64::MIN.to_le_bytes());
        there_and_back("bool", &[1]);
    }

    #[test]
    fn arrays_and_structs_come_back_with_their_layout() {
        there_and_back("int16_t[3]", &[1, 0, 2, 0, 255, 255]);
        let mut bytes = vec![7, 0, 0, 0, 0, 0, 0, 0];
        bytes.extend(2.5f64.to_le_bytes());
        there_and_back("struct { uint8_t a; double b; }", &bytes);
    }

    #[test]
    fn what_is_of_another_type_is_refused() {
        let of = Type::parse("double[2]", &IndexMap::new()).expect("a type");
        for wrong in [json!(1.0), json!([1.0]), json!([1.0, "x"])] {
            assert!(!read(&of, &wrong, &mut Vec::new()), "{wrong}");
        }
    }
}
