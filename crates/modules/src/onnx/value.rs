// SPDX-License-Identifier: Apache-2.0
//! Values of a network during translation: they have a fixed shape, and are either constants or buffers that a step fills.
use super::proto::{self, Tensor};
use super::tensors;
use std::rc::Rc;

/// Maximum number of elements of one tensor, so that an invalid shape is refused before memory is allocated.
pub const ELEMENTS_MAX: usize = 1 << 24;

#[derive(Clone, Debug)]
pub enum Content {
    /// Buffer with this number in the scratch of an invocation.
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

    /// Returns the elements of a constant of floats.
    pub fn known_floats(&self) -> Option<&[f32]> {
        if let Content::Floats(floats) = &self.content { Some(floats) } else { None }
    }

    /// Returns the elements of a constant of integers.
    pub fn known_ints(&self) -> Option<&[i64]> {
        if let Content::Ints(ints) = &self.content { Some(ints) } else { None }
    }

    /// Returns the same elements in another shape.
    pub fn reshaped(&self, shape: Vec<usize>) -> Value {
        Value { shape, content: self.content.clone() }
    }

    /// Reads a tensor of the file. Floats of other widths are converted to 32 bits; integers and booleans become integers.
    pub fn of(tensor: &Tensor) -> Result<Value, String> {
        let shape = fixed(&tensor.dims)?;
        let count: usize = shape.iter().product();
        if tensor.data_location != 0 {
            let file = tensor.external_data.iter().find(|entry| entry.key == "location").map_or("another file", |entry| entry.value.as_str());
            return Err(format!("its values are in '{file}': load the network from the folder that contains both, or save it with its weights inside"));
        }
        let made = match Kind::of(tensor.data_type) {
            Some(Kind::Float) => Value::floats(shape.clone(), tensors::floats(tensor)),
            Some(Kind::Whole | Kind::Truth) => Value::ints(shape.clone(), tensors::ints(tensor)),
            None => return Err(format!("its elements are {}: export the network with floats", proto::type_name(tensor.data_type))),
        };
        let (len, is_whole) = match &made.content {
            Content::Floats(floats) => (floats.len(), tensors::is_whole(tensor)),
            Content::Ints(ints) => (ints.len(), tensors::is_whole(tensor)),
            Content::Buffer(_) => (0, false),
        };
        if len != count || !is_whole {
            return Err(format!("it is damaged: its shape {shape:?} needs {count} values, but the file has a different number"));
        }
        if let Content::Floats(floats) = &made.content
            && floats.iter().any(|x| x.is_nan())
        {
            return Err("it has a value that is not a number: train or export the network again".to_string());
        }
        Ok(made)
    }
}

/// Kind of a value's elements. All kinds are computed as 32-bit floats, so integers beyond 2^24 are not exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Float,
    Whole,
    Truth,
}

impl Kind {
    /// Returns the kind of an ONNX element type; `None` if it is not supported.
    pub fn of(element: i32) -> Option<Kind> {
        match element {
            proto::FLOAT | proto::FLOAT16 | proto::DOUBLE | proto::BFLOAT16 => Some(Kind::Float),
            proto::UINT8..=proto::INT64 | proto::UINT32 | proto::UINT64 => Some(Kind::Whole),
            proto::BOOL => Some(Kind::Truth),
            _ => None,
        }
    }
}

/// Checks that every dimension is a number and that the size is within the limit; returns the shape.
pub fn fixed(dims: &[i64]) -> Result<Vec<usize>, String> {
    let shape: Option<Vec<usize>> = dims.iter().map(|&d| usize::try_from(d).ok()).collect();
    let shape = shape.ok_or_else(|| format!("its shape {dims:?} is negative: the file is damaged"))?;
    match shape.iter().try_fold(1usize, |size, &d| size.checked_mul(d)).filter(|&size| size <= ELEMENTS_MAX) {
        Some(_) => Ok(shape),
        None => Err(format!("its shape {dims:?} has more than {ELEMENTS_MAX} elements")),
    }
}

/// Returns, for each dimension, the distance in elements between consecutive indices.
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

/// Returns the offset of an element.
pub fn offset(index: &[usize], strides: &[usize]) -> usize {
    index.iter().zip(strides).map(|(i, s)| i * s).sum()
}

/// Returns the shape to which two operands are broadcast (the rule of NumPy).
pub fn broadcast(a: &[usize], b: &[usize]) -> Result<Vec<usize>, String> {
    let rank = a.len().max(b.len());
    let at = |shape: &[usize], i: usize| if i + shape.len() < rank { 1 } else { shape[i + shape.len() - rank] };
    (0..rank)
        .map(|i| match (at(a, i), at(b, i)) {
            (x, y) if x == y || y == 1 => Ok(x),
            (1, y) => Ok(y),
            _ => Err(format!("shapes {a:?} and {b:?} cannot be broadcast")),
        })
        .collect()
}

/// Returns, for each element of `to`, the index of the element of a value of shape `from` that is broadcast there.
pub fn spread(from: &[usize], to: &[usize]) -> Vec<usize> {
    let own = strides(from);
    let skip = to.len() - from.len();
    let steps: Vec<usize> = (0..to.len()).map(|i| if i < skip || from[i - skip] == 1 { 0 } else { own[i - skip] }).collect();
    let mut indices = Vec::new();
    each(to, |index| indices.push(offset(index, &steps)));
    indices
}
