// SPDX-License-Identifier: Apache-2.0
//! Values of SVVs as JSON.
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use indexmap::IndexMap;
use model::refusal::Refusals;
use model::types::Type;
use model::value::Value;
use schemars::JsonSchema;
use serde::Serialize;
use supervisor::System;

/// A value with its number and time.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Reading {
    /// Value, unless bytes are requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<Value>,
    /// Memory of the value's C type in base64, little-endian, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<String>,
    pub number: u64,
    pub time_ns: i64,
}

/// Values at a single point in time.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Snapshot {
    pub time_ns: i64,
    pub values: IndexMap<String, Reading>,
}

/// Reads one consistent snapshot. If `raw` is true, returns `bytes`, the memory of the C type in base64, little-endian, instead of
/// `value`, which cannot represent NaN or infinity in JSON.
pub fn snapshot(system: &System, names: &[String], raw: bool) -> Result<Snapshot, Refusals> {
    let types: Vec<Type> = names.iter().map(|name| type_of(system, name)).collect::<Result<_, _>>()?;
    let (time_ns, readings) = system.read(names)?;
    let read = names.iter().zip(&types).zip(readings);
    let values = read.map(|((name, of), (bytes, number, at_ns))| (name.clone(), reading(of, &bytes, number, at_ns, raw))).collect();
    Ok(Snapshot { time_ns, values })
}

/// Returns the most recent `count` values, oldest first.
pub(crate) fn history(system: &System, name: &str, count: usize, raw: bool) -> Result<Vec<Reading>, Refusals> {
    let of = type_of(system, name)?;
    let past = system.history(name, count)?;
    Ok(past.iter().map(|(number, time_ns, bytes)| reading(&of, bytes, *number, *time_ns, raw)).collect())
}

fn reading(of: &Type, bytes: &[u8], number: u64, time_ns: i64, raw: bool) -> Reading {
    let (value, bytes) = if raw { (None, Some(STANDARD.encode(bytes))) } else { (Some(of.decode(bytes)), None) };
    Reading { value, bytes, number, time_ns }
}

fn type_of(system: &System, svv: &str) -> Result<Type, Refusals> {
    let about = system.svv_about(svv)?;
    Type::parse(&about.type_text, &about.types).map_err(|refusal| vec![refusal])
}
