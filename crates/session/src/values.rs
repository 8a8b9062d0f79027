// SPDX-License-Identifier: Apache-2.0
//! Values of SVVs as JSON.
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use indexmap::IndexMap;
use model::refusal::{Class, Refusal, Refusals};
use model::types::Type;
use serde_json::{Value as Json, json};
use supervisor::System;

/// One consistent snapshot: `{"time_ns": t, "values": {name: {"value", "number", "time_ns"}}}`. `raw`: instead of `value`, which cannot say
/// NaN or infinity in JSON, `bytes`, the memory of the C type in base64, little endian.
pub fn read(system: &System, names: &[String], raw: bool) -> Result<Json, Refusals> {
    let types: Vec<Type> = names.iter().map(|name| type_of(system, name)).collect::<Result<_, _>>()?;
    let (time_ns, readings) = system.read(names)?;
    let mut values = serde_json::Map::new();
    for ((name, of), (bytes, number, at_ns)) in names.iter().zip(&types).zip(readings) {
        values.insert(name.clone(), entry(of, &bytes, number, at_ns, raw));
    }
    Ok(json!({ "time_ns": time_ns, "values": values }))
}

/// The last `count` values, oldest first: `[{"value", "number", "time_ns"}]`, or `bytes` as [`read`] gives them.
pub(crate) fn history(system: &System, name: &str, count: usize, raw: bool) -> Result<Json, Refusals> {
    let of = type_of(system, name)?;
    let past = system.history(name, count)?;
    Ok(past.iter().map(|(number, time_ns, bytes)| entry(&of, bytes, *number, *time_ns, raw)).collect())
}

fn entry(of: &Type, bytes: &[u8], number: u64, time_ns: i64, raw: bool) -> Json {
    if raw {
        return json!({ "bytes": STANDARD.encode(bytes), "number": number, "time_ns": time_ns });
    }
    json!({ "value": of.decode(bytes), "number": number, "time_ns": time_ns })
}

fn type_of(system: &System, svv: &str) -> Result<Type, Refusals> {
    let about = system.svv_json(svv)?;
    let text = about["type_text"].as_str().ok_or_else(|| vec![Refusal::new(Class::TypeMismatch, format!("SVV '{svv}' has no type"))])?;
    let named = about["types"].as_object().into_iter().flatten();
    let types: IndexMap<String, String> = named.filter_map(|(name, of)| Some((name.clone(), of.as_str()?.to_owned()))).collect();
    Type::parse(text, &types).map_err(|refusal| vec![refusal])
}
