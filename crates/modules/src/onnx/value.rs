// SPDX-License-Identifier: Apache-2.0
//! Values of a network while it is translated: of fixed shape, either constants or buffers that a step fills.
use super::proto::{self, Tensor};
use std::rc::Rc;

/// The most elements of one tensor: a damaged shape is refused before memory is asked for.
pub const ELEMENTS_MAX: usize = 1 << 24;

#[derive(Clone, Debug)]
pub enum Content {
    /// Buffer of this number in the scratch of an invocation.
    Buffer(usize),
    Floats(Rc<[f32]>),
    Ints(Rc<[i64]>),
}

#[derive(Clone, Debug)]
pub struct Value {
    pub shape: Vec<usize>,
    pub content: Content,
}

impl Value {
    pub fn floats(shape: Vec<usize>, floats: Vec<f32>) -> Value {
        Value { shape, content: Content::Floats(floats.into()) }
    }

    pub fn ints(shape: Vec<usize>, ints: Vec<i64>) -> Value {
        Value { shape, content: Content::Ints(ints.into()) }
    }

    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// The same elements in another shape.
    pub fn reshaped(&self, shape: Vec<usize>) -> Value {
        Value { shape, content: self.content.clone() }
    }

    /// Reads a tensor of the file.
    pub fn of(tensor: &Tensor) -> Result<Value, String> {
        let shape = fixed(&tensor.dims)?;
        let count: usize = shape.iter().product();
        if tensor.data_location != 0 {
            return Err("its values lie in another file: save the model with its weights inside".to_string());
        }
        let raw = &tensor.raw_data;
        let short = || format!("it is damaged: its shape {shape:?} needs {count} values, the file has another number");
        match tensor.data_type {
            proto::FLOAT => {
                let read = raw.as_chunks::<4>();
                let floats: Vec<f32> = if raw.is_empty() { tensor.float_data.clone() } else { read.0.iter().map(|b| f32::from_le_bytes(*b)).collect() };
                if floats.len() != count || !read.1.is_empty() {
                    return Err(short());
                }
                if floats.iter().any(|x| x.is_nan()) {
                    return Err("it has a value that is not a number: train or export the network again".to_string());
                }
                Ok(Value::floats(shape, floats))
            }
            proto::INT64 | proto::INT32 => {
                let ints: Vec<i64> = match (tensor.data_type, raw.is_empty()) {
                    (proto::INT64, true) => tensor.int64_data.clone(),
                    (proto::INT64, false) => raw.as_chunks::<8>().0.iter().map(|b| i64::from_le_bytes(*b)).collect(),
                    (_, true) => tensor.int32_data.iter().map(|&i| i64::from(i)).collect(),
                    (_, false) => raw.as_chunks::<4>().0.iter().map(|b| i64::from(i32::from_le_bytes(*b))).collect(),
                };
                if ints.len() == count { Ok(Value::ints(shape, ints)) } else { Err(short()) }
            }
            other => Err(format!("its elements are {}: export the network with 32-bit floats", proto::type_name(other))),
        }
    }
}

/// A shape whose every dimension is a number and whose size is bounded.
pub fn fixed(dims: &[i64]) -> Result<Vec<usize>, String> {
    let shape: Option<Vec<usize>> = dims.iter().map(|&d| usize::try_from(d).ok()).collect();
    let shape = shape.ok_or_else(|| format!("its shape {dims:?} is negative: the file is damaged"))?;
    match shape.iter().try_fold(1usize, |size, &d| size.checked_mul(d)).filter(|&size| size <= ELEMENTS_MAX) {
        Some(_) => Ok(shape),
        None => Err(format!("its shape {dims:?} has more than {ELEMENTS_MAX} elements")),
    }
}

/// Elements from one index of each dimension to the next.
pub fn strides(shape: &[usize]) -> Vec<usize> {
    let mut strides = vec![1; shape.len()];
    for i in (1..shape.len()).rev() {
        strides[i - 1] = strides[i] * shape[i];
    }
    strides
}

/// Calls `visit` with the indices of each element in order.
pub fn each(shape: &[usize], mut visit: impl FnMut(&[usize])) {
    let mut index = vec![0; shape.len()];
    for _ in 0..shape.iter().product::<usize>() {
        visit(&index);
        for at in (0..shape.len()).rev() {
            index[at] += 1;
            if index[at] < shape[at] {
                break;
            }
            index[at] = 0;
        }
    }
}

/// Where an element lies.
pub fn offset(index: &[usize], strides: &[usize]) -> usize {
    index.iter().zip(strides).map(|(i, s)| i * s).sum()
}

/// The shape that two operands are spread to (the rule of NumPy).
pub fn broadcast(a: &[usize], b: &[usize]) -> Result<Vec<usize>, String> {
    let rank = a.len().max(b.len());
    let at = |shape: &[usize], i: usize| if i + shape.len() < rank { 1 } else { shape[i + shape.len() - rank] };
    (0..rank)
        .map(|i| match (at(a, i), at(b, i)) {
            (x, y) if x == y || y == 1 => Ok(x),
            (1, y) => Ok(y),
            _ => Err(format!("shapes {a:?} and {b:?} do not fit together")),
        })
        .collect()
}

/// For each element of `to`, which one of a value of shape `from` is spread there.
pub fn spread(from: &[usize], to: &[usize]) -> Vec<usize> {
    let own = strides(from);
    let skip = to.len() - from.len();
    let steps: Vec<usize> = (0..to.len()).map(|i| if i < skip || from[i - skip] == 1 { 0 } else { own[i - skip] }).collect();
    let mut indices = Vec::new();
    each(to, |index| indices.push(offset(index, &steps)));
    indices
}
