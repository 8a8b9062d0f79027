// SPDX-License-Identifier: Apache-2.0
//! Elements of a file's tensors, of all supported element types, stored in the file itself or in a separate one.
use super::proto::{self, Attribute, Model, Tensor};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Component, Path};

/// Maximum total size of tensors stored in separate files, in bytes.
const EXTERNAL_BYTES_MAX: u64 = 256 << 20;

/// Returns the elements of a tensor of floats.
pub fn floats(tensor: &Tensor) -> Vec<f32> {
    let raw = &tensor.raw_data[..];
    match (tensor.data_type, raw.is_empty()) {
        (proto::DOUBLE, true) => tensor.double_data.iter().map(|&x| x as f32).collect(),
        (proto::DOUBLE, false) => raw.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b) as f32).collect(),
        (proto::FLOAT16, true) => tensor.int32_data.iter().map(|&bits| half(bits as u16)).collect(),
        (proto::FLOAT16, false) => raw.as_chunks::<2>().0.iter().map(|b| half(u16::from_le_bytes(*b))).collect(),
        (proto::BFLOAT16, true) => tensor.int32_data.iter().map(|&bits| f32::from_bits((bits as u32) << 16)).collect(),
        (proto::BFLOAT16, false) => raw.as_chunks::<2>().0.iter().map(|b| f32::from_bits(u32::from(u16::from_le_bytes(*b)) << 16)).collect(),
        (_, true) => tensor.float_data.clone(),
        (_, false) => raw.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
    }
}

/// Returns the elements of a tensor of integers or booleans.
pub fn ints(tensor: &Tensor) -> Vec<i64> {
    let raw = &tensor.raw_data[..];
    if raw.is_empty() {
        return match tensor.data_type {
            proto::INT64 => tensor.int64_data.clone(),
            proto::UINT32 | proto::UINT64 => tensor.uint64_data.iter().map(|&i| i as i64).collect(),
            _ => tensor.int32_data.iter().map(|&i| i64::from(i)).collect(),
        };
    }
    match tensor.data_type {
        proto::INT8 => raw.iter().map(|&b| i64::from(b as i8)).collect(),
        proto::UINT8 | proto::BOOL => raw.iter().map(|&b| i64::from(b)).collect(),
        proto::INT16 => raw.as_chunks::<2>().0.iter().map(|b| i64::from(i16::from_le_bytes(*b))).collect(),
        proto::UINT16 => raw.as_chunks::<2>().0.iter().map(|b| i64::from(u16::from_le_bytes(*b))).collect(),
        proto::INT32 => raw.as_chunks::<4>().0.iter().map(|b| i64::from(i32::from_le_bytes(*b))).collect(),
        proto::UINT32 => raw.as_chunks::<4>().0.iter().map(|b| i64::from(u32::from_le_bytes(*b))).collect(),
        _ => raw.as_chunks::<8>().0.iter().map(|b| i64::from_le_bytes(*b)).collect(),
    }
}

/// Returns true if the size of a tensor is a whole number of elements.
pub fn is_whole(tensor: &Tensor) -> bool {
    let size = match tensor.data_type {
        proto::UINT8 | proto::INT8 | proto::BOOL => 1,
        proto::UINT16 | proto::INT16 | proto::FLOAT16 | proto::BFLOAT16 => 2,
        proto::INT64 | proto::UINT64 | proto::DOUBLE => 8,
        _ => 4,
    };
    tensor.raw_data.len().is_multiple_of(size)
}

/// Returns the value of a 16-bit float (IEEE 754 binary16).
fn half(bits: u16) -> f32 {
    let (sign, exponent, fraction) = (u32::from(bits >> 15) << 31, u32::from(bits >> 10 & 0x1f), u32::from(bits & 0x3ff));
    match exponent {
        0 => f32::from_bits(sign | (fraction as f32 / 16_777_216.0).to_bits()),
        31 => f32::from_bits(sign | 0x7f80_0000 | fraction << 13),
        _ => f32::from_bits(sign | (exponent + 112) << 23 | fraction << 13),
    }
}

/// Moves tensors stored in separate files into the model. Returns false if there are none.
///
/// # Errors
/// Fails if a file does not exist, is too short, or is outside `folder`.
pub fn take_in(model: &mut Model, folder: &Path) -> Result<bool, String> {
    let Some(graph) = &mut model.graph else { return Ok(false) };
    let of_nodes = graph.node.iter_mut().flat_map(|node| &mut node.attribute).filter_map(|attribute: &mut Attribute| attribute.t.as_mut());
    let (mut total, mut any) = (0, false);
    for tensor in graph.initializer.iter_mut().chain(of_nodes).filter(|tensor| tensor.data_location != 0) {
        tensor.raw_data = outside(tensor, folder, &mut total).map_err(|what| format!("initializer '{}': {what}", tensor.name))?;
        tensor.data_location = 0;
        tensor.external_data.clear();
        any = true;
    }
    Ok(any)
}

/// Returns the bytes of a tensor that is stored in a file below `folder`.
fn outside(tensor: &Tensor, folder: &Path, total: &mut u64) -> Result<Vec<u8>, String> {
    let entry = |key: &str| tensor.external_data.iter().find(|entry| entry.key == key).map(|entry| entry.value.as_str());
    let number =
        |key: &str| entry(key).map(|text| text.parse::<u64>().map_err(|_| format!("its {key} '{text}' is not a number: the file is damaged"))).transpose();
    let location = entry("location").ok_or("it names no file for its values: the file is damaged")?;
    let (start, length) = (number("offset")?.unwrap_or(0), number("length")?);
    if !Path::new(location).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
        return Err(format!("its values are in '{location}', which is outside the folder of the network"));
    }
    let unreadable =
        |error: std::io::Error| format!("its values are in '{location}', which cannot be read in the folder of the network ({error}): copy both files");
    let mut file = File::open(folder.join(location)).map_err(unreadable)?;
    let size = file.metadata().map_err(unreadable)?.len();
    let length = length.unwrap_or_else(|| size.saturating_sub(start));
    if start.checked_add(length).is_none_or(|end| end > size) {
        return Err(format!("its values end at byte {} of '{location}', which has {size}: copy or export both files again", start.saturating_add(length)));
    }
    *total += length;
    if *total > EXTERNAL_BYTES_MAX {
        return Err(format!("'{location}' has more than {} MB of values, too many for a firing: run the network in a process", EXTERNAL_BYTES_MAX >> 20));
    }
    let mut bytes = vec![0; usize::try_from(length).map_err(|_| "its values are too long for this machine")?];
    file.seek(SeekFrom::Start(start)).and_then(|_| file.read_exact(&mut bytes)).map_err(unreadable)?;
    Ok(bytes)
}
