// SPDX-License-Identifier: Apache-2.0
//! Channels of any numeric type that read a table of values: a physical device for tests.
//!
//! Options: `channels`, a list of `{name, direction: "read" | "write", type: "double" | "float" | "bool" | "int8_t" … "uint64_t" or
//! such a type with `[n]`, unit, safe, slew, loop_of}`, and `table`, a list of rows `{at_ns, values: {name: number or list}}`: from `at_ns` after opening
//! on, those read channels have those values (0 before). A read channel with `loop_of: "<write channel>"` of the same type reads
//! what was last written there instead. A write channel whose claim ends gets its safe value from the kernel, as any device.
use crate::{DriverError, driver};
use kernel::{Channel, DeviceError, Direction, Driver};
use serde::Deserialize;
use serde_json::{Map, Value, json};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    channels: Vec<ChannelOptions>,
    #[serde(default)]
    table: Vec<RowOptions>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChannelOptions {
    name: String,
    direction: String,
    r#type: String,
    #[serde(default)]
    unit: String,
    safe: Option<Value>,
    slew: Option<f64>,
    loop_of: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RowOptions {
    at_ns: i64,
    values: Map<String, Value>,
}

/// From `at_ns` on, these bytes are read at `offset`.
struct Row {
    at_ns: i64,
    offset: usize,
    bytes: Vec<u8>,
}

/// A read channel that shows a write channel: (where read, where written, bytes).
type Loop = (usize, usize, usize);

struct Scripted {
    channels: Vec<Channel>,
    rows: Vec<Row>,
    next: usize,
    loops: Vec<Loop>,
    opened_ns: i64,
    readings: Vec<u8>,
    commands: Vec<u8>,
}

/// Makes the device. Errors name the channel or row that is wrong.
pub(crate) fn open(options: &Value) -> Result<(Box<dyn Driver>, Value), DriverError> {
    let options: Options = driver::options("scripted", options)?;
    let mut channels: Vec<Channel> = Vec::new();
    let (mut read_len, mut write_len) = (0, 0);
    for given in &options.channels {
        let channel = channel(given, &mut read_len, &mut write_len)?;
        if channels.iter().any(|c| c.name == channel.name) {
            return Err(wrong("channels", format!("'{}' is named twice", channel.name)));
        }
        channels.push(channel);
    }
    let mut loops = Vec::new();
    for (given, channel) in options.channels.iter().zip(&channels) {
        let Some(source) = &given.loop_of else { continue };
        let written = channels.iter().find(|c| &c.name == source && c.direction == Direction::Write && c.type_text == channel.type_text);
        match written {
            Some(w) if channel.direction == Direction::Read => loops.push((channel.offset, w.offset, w.len)),
            _ => return Err(wrong("loop_of", format!("'{}' cannot show '{source}': it must be a write channel of type {}", channel.name, channel.type_text))),
        }
    }
    let mut rows = Vec::new();
    for row in &options.table {
        for (name, value) in &row.values {
            let channel = channels
                .iter()
                .find(|c| &c.name == name && c.direction == Direction::Read)
                .ok_or_else(|| wrong("table", format!("no read channel '{name}'")))?;
            rows.push(Row {
                at_ns: row.at_ns,
                offset: channel.offset,
                bytes: encode(&channel.type_text, value).map_err(|e| wrong("table", format!("'{name}': {e}")))?,
            });
        }
    }
    rows.sort_by_key(|row| row.at_ns);
    let device = Scripted { channels, rows, next: 0, loops, opened_ns: 0, readings: vec![0; read_len], commands: vec![0; write_len] };
    Ok((Box::new(device), json!({ "parts": [] })))
}

fn wrong(option: &str, problem: String) -> DriverError {
    DriverError::Option { kind: "scripted".into(), option: option.into(), problem }
}

fn channel(given: &ChannelOptions, read_len: &mut usize, write_len: &mut usize) -> Result<Channel, DriverError> {
    let failed = |problem: String| wrong("channels", format!("'{}': {problem}", given.name));
    let (scalar, count) = split(&given.r#type).map_err(failed)?;
    let len = width(scalar).map_err(failed)? * count;
    let direction = match given.direction.as_str() {
        "read" => Direction::Read,
        "write" => Direction::Write,
        other => return Err(failed(format!("direction '{other}' is neither read nor write"))),
    };
    let end = if direction == Direction::Read { read_len } else { write_len };
    // Eight bytes are the widest scalar: aligned for every type.
    let offset = end.next_multiple_of(8);
    *end = offset + len;
    let safe = match (&given.safe, direction) {
        (_, Direction::Read) => vec![],
        (None, Direction::Write) => vec![0; len],
        (Some(value), Direction::Write) => encode(&given.r#type, value).map_err(failed)?,
    };
    Ok(Channel {
        name: given.name.clone(),
        direction,
        type_text: given.r#type.clone(),
        unit: given.unit.clone(),
        doc: "scripted".into(),
        offset,
        len,
        safe,
        slew_max: given.slew,
    })
}

/// `double[6]` is (`double`, 6); `double` is (`double`, 1).
fn split(type_text: &str) -> Result<(&str, usize), String> {
    match type_text.split_once('[') {
        None => Ok((type_text, 1)),
        Some((scalar, count)) => count.trim_end_matches(']').parse().map(|n| (scalar, n)).map_err(|_| format!("no type '{type_text}'")),
    }
}

fn width(scalar: &str) -> Result<usize, String> {
    match scalar {
        "bool" | "int8_t" | "uint8_t" => Ok(1),
        "int16_t" | "uint16_t" => Ok(2),
        "float" | "int32_t" | "uint32_t" => Ok(4),
        "double" | "int64_t" | "uint64_t" => Ok(8),
        _ => Err(format!("no type '{scalar}'; use double, float, bool, int8_t to int64_t or uint8_t to uint64_t")),
    }
}

/// The bytes of a number, of a truth value or of a list of them. `"nan"` and `"inf"` are values of a double.
fn encode(type_text: &str, value: &Value) -> Result<Vec<u8>, String> {
    let (scalar, count) = split(type_text)?;
    let one = [value.clone()];
    let values: &[Value] = value.as_array().map_or(&one, |list| list);
    if values.len() != count {
        return Err(format!("{} values for a {type_text}", values.len()));
    }
    let mut bytes = Vec::new();
    for value in values {
        let no = || format!("{value} is no {scalar}");
        let whole = || value.as_i64().or_else(|| value.as_bool().map(i64::from)).ok_or_else(no);
        match scalar {
            "double" => bytes.extend(real(value).ok_or_else(no)?.to_ne_bytes()),
            "float" => bytes.extend((real(value).ok_or_else(no)? as f32).to_ne_bytes()),
            "bool" => bytes.push(value.as_bool().ok_or_else(no)? as u8),
            "uint64_t" => bytes.extend(value.as_u64().ok_or_else(no)?.to_ne_bytes()),
            _ => bytes.extend(&whole()?.to_le_bytes()[..width(scalar)?]),
        }
    }
    Ok(bytes)
}

fn real(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_str()?.parse().ok())
}

impl Driver for Scripted {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn open(&mut self, now_ns: i64) -> Result<(), DeviceError> {
        self.opened_ns = now_ns;
        self.next = 0;
        Ok(())
    }

    fn read(&mut self, release_ns: i64, readings: &mut [u8]) -> Result<(), DeviceError> {
        while let Some(row) = self.rows.get(self.next).filter(|row| row.at_ns <= release_ns - self.opened_ns) {
            self.readings[row.offset..row.offset + row.bytes.len()].copy_from_slice(&row.bytes);
            self.next += 1;
        }
        for (to, from, len) in &self.loops {
            self.readings[*to..to + len].copy_from_slice(&self.commands[*from..from + len]);
        }
        readings[..self.readings.len()].copy_from_slice(&self.readings);
        Ok(())
    }

    fn write(&mut self, _: i64, commands: &[u8], _: &[bool]) -> Result<(), DeviceError> {
        let len = self.commands.len();
        self.commands.copy_from_slice(&commands[..len]);
        Ok(())
    }

    fn safe_state(&mut self) {
        for channel in self.channels.iter().filter(|c| c.direction == Direction::Write) {
            self.commands[channel.offset..channel.offset + channel.len].copy_from_slice(&channel.safe);
        }
    }

    fn close(&mut self) {
        self.safe_state();
    }
}
