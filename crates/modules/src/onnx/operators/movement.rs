// SPDX-License-Identifier: Apache-2.0
//! Operators that move elements without computing. With fixed shapes, each is a list of indices known at translation time.
use super::{Call, OperatorResult, axes, axis};
use crate::onnx::program::Program;
use crate::onnx::value::{Content, Kind, Value, each, fixed, offset, spread, strides};

/// Maximum number of separate copies; above it, a table of indices is used.
const RUNS_MAX: usize = 16;

/// Returns a value whose element i is element `indices[i]` of `source`.
pub fn moved(program: &mut Program, source: &Value, shape: Vec<usize>, indices: Vec<usize>) -> Result<Value, String> {
    match &source.content {
        Content::Floats(floats) => Ok(Value::floats(shape, indices.iter().map(|&i| floats[i]).collect())),
        Content::Ints(ints) => Ok(Value::ints(shape, indices.iter().map(|&i| ints[i]).collect())),
        Content::Buffer(_) if indices.len() == source.len() && indices.iter().enumerate().all(|(i, &at)| i == at) => Ok(source.reshaped(shape)),
        Content::Buffer(_) => {
            let made = program.value_of(program.kind(source), &shape);
            place(program, &made, 0, source, indices)?;
            Ok(made)
        }
    }
}

/// Copies elements of `source` to `into`, starting at element `start`.
pub fn place(program: &mut Program, into: &Value, start: usize, source: &Value, indices: Vec<usize>) -> Result<(), String> {
    let (y, x) = (program.name(into)?, program.name(source)?);
    let mut runs: Vec<(usize, usize, usize)> = Vec::new();
    for (i, &at) in indices.iter().enumerate() {
        match runs.last_mut() {
            Some((_, from, len)) if *from + *len == at => *len += 1,
            _ => runs.push((start + i, at, 1)),
        }
    }
    let text = if runs.len() <= RUNS_MAX {
        runs.iter().map(|(to, from, len)| format!("memcpy({y} + {to}, {x} + {from}, {});", len * 4)).collect::<Vec<_>>().join(" ")
    } else {
        let count = indices.len();
        format!("gather({y} + {start}, {x}, {}, {count});", program.table(indices))
    };
    program.step(&[into, source], text);
    Ok(())
}

pub fn constant(call: &mut Call) -> OperatorResult {
    let int = |i: i64| Value::ints(vec![], vec![i]);
    let made = if let Some(tensor) = call.attribute("value").and_then(|a| a.t.as_ref()) {
        Value::of(tensor)?
    } else if let Some(floats) = call.attribute("value_floats") {
        Value::floats(vec![floats.floats.len()], floats.floats.clone())
    } else if let Some(ints) = call.attribute("value_ints") {
        Value::ints(vec![ints.ints.len()], ints.ints.clone())
    } else if let Some(x) = call.attribute("value_float") {
        Value::floats(vec![], vec![x.f])
    } else {
        int(call.attribute("value_int").ok_or("it has no value of floats or integers")?.i)
    };
    Ok(vec![made])
}

pub fn constant_of_shape(call: &mut Call) -> OperatorResult {
    let shape = fixed(&call.known_ints(0, "shape")?.unwrap_or_default())?;
    let len = shape.iter().product();
    let value = call.attribute("value").and_then(|a| a.t.as_ref()).map(Value::of).transpose()?;
    Ok(vec![match value.map(|v| v.content) {
        Some(Content::Ints(ints)) if ints.len() == 1 => Value::ints(shape, vec![ints[0]; len]),
        Some(Content::Floats(floats)) if floats.len() == 1 => Value::floats(shape, vec![floats[0]; len]),
        None => Value::floats(shape, vec![0.0; len]),
        _ => return Err("its value is not a single number".to_string()),
    }])
}

pub fn shape(call: &mut Call) -> OperatorResult {
    let of = call.input(0)?.shape;
    let rank = i64::try_from(of.len()).unwrap_or(i64::MAX);
    let end = |at: i64| usize::try_from(if at < 0 { at + rank } else { at }.clamp(0, rank)).unwrap_or(0);
    let (start, stop) = (end(call.int("start", 0)), end(call.int("end", rank)));
    let ints: Vec<i64> = of.get(start..stop).unwrap_or_default().iter().map(|&d| d as i64).collect();
    Ok(vec![Value::ints(vec![ints.len()], ints)])
}

pub fn identity(call: &mut Call) -> OperatorResult {
    if call.node.op_type == "Dropout" {
        call.attribute("seed");
        call.attribute("ratio");
        if call.inputs.len() > 2 || call.node.output.len() > 1 {
            return Err("it is a Dropout for training: export the network for inference".to_string());
        }
    }
    Ok(vec![call.input(0)?])
}

pub fn reshape(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let zero_is_zero = call.int("allowzero", 0) != 0;
    let mut wanted = call.known_ints(1, "shape")?.ok_or("its shape is missing: the file is damaged")?;
    for (i, dim) in wanted.iter_mut().enumerate() {
        if *dim == 0 && !zero_is_zero {
            *dim = x.shape.get(i).map(|&d| d as i64).ok_or("a 0 in its shape matches no dimension")?;
        }
    }
    let known: i64 = wanted.iter().filter(|&&d| d >= 0).product();
    for dim in wanted.iter_mut().filter(|dim| **dim == -1) {
        *dim = if known > 0 { x.len() as i64 / known } else { 0 };
    }
    let shape = fixed(&wanted)?;
    if shape.iter().product::<usize>() != x.len() {
        return Err(format!("shape {:?} cannot become {shape:?}", x.shape));
    }
    Ok(vec![x.reshaped(shape)])
}

pub fn flatten(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let rank = x.shape.len();
    let given = call.int("axis", 1);
    let at = if given == rank as i64 { rank } else { axis(given, rank)? };
    Ok(vec![x.reshaped(vec![x.shape[..at].iter().product(), x.shape[at..].iter().product()])])
}

pub fn squeeze(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let gone = match call.known_ints(1, "axes")? {
        Some(given) => axes(&given, x.shape.len())?,
        None => (0..x.shape.len()).filter(|&i| x.shape[i] == 1).collect(),
    };
    if let Some(i) = gone.iter().find(|&&i| x.shape[i] != 1) {
        return Err(format!("dimension {i} of shape {:?} is not 1", x.shape));
    }
    Ok(vec![x.reshaped((0..x.shape.len()).filter(|i| !gone.contains(i)).map(|i| x.shape[i]).collect())])
}

pub fn unsqueeze(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let given = call.known_ints(1, "axes")?.ok_or("its axes are missing: the file is damaged")?;
    let rank = x.shape.len() + given.len();
    let new = axes(&given, rank)?;
    let mut old = x.shape.iter();
    let shape = (0..rank).map(|i| if new.contains(&i) { Some(1) } else { old.next().copied() }).collect::<Option<Vec<_>>>();
    Ok(vec![x.reshaped(shape.ok_or("an axis appears more than once")?)])
}

pub fn transpose(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let rank = x.shape.len();
    let order = match call.ints("perm") {
        Some(given) => given.iter().map(|&a| axis(a, rank)).collect::<Result<Vec<_>, _>>()?,
        None => (0..rank).rev().collect(),
    };
    Ok(vec![transposed(call.program, &x, &order)?])
}

/// Returns the value with its dimensions in this order.
pub fn transposed(program: &mut Program, x: &Value, order: &[usize]) -> Result<Value, String> {
    let mut sorted = order.to_vec();
    sorted.sort_unstable();
    if !sorted.iter().copied().eq(0..x.shape.len()) {
        return Err(format!("{order:?} is not a permutation of the dimensions of shape {:?}", x.shape));
    }
    let own = strides(&x.shape);
    let shape: Vec<usize> = order.iter().map(|&i| x.shape[i]).collect();
    let steps: Vec<usize> = order.iter().map(|&i| own[i]).collect();
    let mut indices = Vec::new();
    each(&shape, |index| indices.push(offset(index, &steps)));
    moved(program, x, shape, indices)
}

pub fn concat(call: &mut Call) -> OperatorResult {
    let parts = (0..call.inputs.len()).map(|i| call.input(i)).collect::<Result<Vec<_>, _>>()?;
    let first = parts.first().ok_or("it has no input: the file is damaged")?;
    let at = axis(call.int("axis", 0), first.shape.len())?;
    let mut shape = first.shape.clone();
    for part in &parts {
        let fits = part.shape.len() == shape.len() && (0..shape.len()).all(|i| i == at || part.shape[i] == shape[i]);
        if !fits {
            return Err(format!("shapes {:?} and {:?} cannot be joined along axis {at}", first.shape, part.shape));
        }
    }
    shape[at] = parts.iter().map(|part| part.shape[at]).sum();
    let outer: usize = shape[..at].iter().product();
    let row: usize = shape[at..].iter().product();
    let width = |part: &Value| part.shape[at..].iter().product::<usize>();
    if let Some(all) = parts.iter().map(Value::known_floats).collect::<Option<Vec<_>>>() {
        let rows = (0..outer).flat_map(|o| all.iter().zip(&parts).flat_map(move |(x, part)| x[o * width(part)..(o + 1) * width(part)].iter().copied()));
        return Ok(vec![Value::floats(shape, rows.collect())]);
    }
    if let Some(all) = parts.iter().map(Value::known_ints).collect::<Option<Vec<_>>>() {
        let rows = (0..outer).flat_map(|o| all.iter().zip(&parts).flat_map(move |(x, part)| x[o * width(part)..(o + 1) * width(part)].iter().copied()));
        return Ok(vec![Value::ints(shape, rows.collect())]);
    }
    let kind = parts.iter().find(|part| matches!(part.content, Content::Buffer(_))).map_or(Kind::Float, |part| call.program.kind(part));
    let made = call.program.value_of(kind, &shape);
    let mut start = 0;
    for part in &parts {
        let len = width(part);
        for o in 0..outer {
            place(call.program, &made, o * row + start, part, (o * len..(o + 1) * len).collect())?;
        }
        start += len;
    }
    Ok(vec![made])
}

pub fn slice(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let need = |given: Option<Vec<i64>>| given.ok_or("its starts or ends are missing: the file is damaged".to_string());
    let (starts, ends) = (need(call.known_ints(1, "starts")?)?, need(call.known_ints(2, "ends")?)?);
    let along = call.known_ints(3, "axes")?.unwrap_or_else(|| (0..starts.len() as i64).collect());
    let steps = call.known_ints(4, "steps")?.unwrap_or_else(|| vec![1; starts.len()]);
    if [ends.len(), along.len(), steps.len()].iter().any(|&len| len != starts.len()) {
        return Err("its starts, ends, axes and steps are of different lengths".to_string());
    }
    let mut taken: Vec<Vec<usize>> = x.shape.iter().map(|&d| (0..d).collect()).collect();
    for i in 0..starts.len() {
        let at = axis(along[i], x.shape.len())?;
        let (dim, step) = (x.shape[at] as i64, steps[i]);
        let clamp = |v: i64, least: i64, most: i64| (if v < 0 { v.saturating_add(dim) } else { v }).clamp(least, most);
        let mut list = Vec::new();
        let (mut j, end) =
            if step > 0 { (clamp(starts[i], 0, dim), clamp(ends[i], 0, dim)) } else { (clamp(starts[i], 0, dim - 1), clamp(ends[i], -1, dim - 1)) };
        if step == 0 {
            return Err("a step of 0".to_string());
        }
        while if step > 0 { j < end } else { j > end } {
            list.push(j as usize);
            j = j.saturating_add(step);
        }
        taken[at] = list;
    }
    let shape: Vec<usize> = taken.iter().map(Vec::len).collect();
    let own = strides(&x.shape);
    let mut indices = Vec::new();
    each(&shape, |index| indices.push(index.iter().enumerate().map(|(d, &i)| taken[d][i] * own[d]).sum()));
    Ok(vec![moved(call.program, &x, shape, indices)?])
}

pub fn split(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let at = axis(call.int("axis", 0), x.shape.len())?;
    let parts = call.int("num_outputs", call.node.output.len() as i64).max(1) as usize;
    let sizes = match call.known_ints(1, "split")? {
        Some(given) => fixed(&given)?,
        None => {
            let size = x.shape[at].div_ceil(parts);
            (0..parts).map(|i| size.min(x.shape[at].saturating_sub(i * size))).collect()
        }
    };
    if sizes.iter().sum::<usize>() != x.shape[at] {
        return Err(format!("parts of {sizes:?} do not add up to dimension {at} of shape {:?}", x.shape));
    }
    let own = strides(&x.shape);
    let mut start = 0;
    let mut made = Vec::new();
    for size in sizes {
        let mut shape = x.shape.clone();
        shape[at] = size;
        let mut indices = Vec::new();
        each(&shape, |index| indices.push(offset(index, &own) + start * own[at]));
        made.push(moved(call.program, &x, shape, indices)?);
        start += size;
    }
    Ok(made)
}

pub fn gather(call: &mut Call) -> OperatorResult {
    let (x, which) = (call.input(0)?, call.input(1)?);
    let at = axis(call.int("axis", 0), x.shape.len())?;
    if let Content::Buffer(_) = which.content {
        return gather_at_run_time(call, &x, &which, at);
    }
    let given = call.known_ints(1, "indices")?.unwrap_or_default();
    let rows = given.iter().map(|&i| axis(i, x.shape[at])).collect::<Result<Vec<_>, _>>().map_err(|_| "an index is out of range".to_string())?;
    let (before, after) = (x.shape[..at].to_vec(), x.shape[at + 1..].to_vec());
    let inner: usize = after.iter().product();
    let mut indices = Vec::new();
    for o in 0..before.iter().product() {
        for &row in &rows {
            indices.extend((0..inner).map(|i| (o * x.shape[at] + row) * inner + i));
        }
    }
    let shape = [before, which.shape, after].concat();
    Ok(vec![moved(call.program, &x, shape, indices)?])
}

/// Gathers rows whose indices are known only at run time (an embedding table). An index out of range yields NaN, which is a fault of the
/// block.
fn gather_at_run_time(call: &mut Call, x: &Value, which: &Value, at: usize) -> OperatorResult {
    let (before, after): (usize, usize) = (x.shape[..at].iter().product(), x.shape[at + 1..].iter().product());
    let kind = call.program.kind(x);
    let made = call.program.value_of(kind, &[&x.shape[..at], &which.shape, &x.shape[at + 1..]].concat());
    let (to, from, numbers) = (call.program.name(&made)?, call.program.name(x)?, call.program.name(which)?);
    let text = format!("gather_rows({to}, {from}, {numbers}, {before}, {}, {after}, {});", x.shape[at], which.len());
    call.program.step(&[&made, x, which], text);
    Ok(vec![made])
}

pub fn expand(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let wanted = fixed(&call.known_ints(1, "shape")?.ok_or("its shape is missing: the file is damaged")?)?;
    let shape = crate::onnx::value::broadcast(&x.shape, &wanted)?;
    let indices = spread(&x.shape, &shape);
    Ok(vec![moved(call.program, &x, shape, indices)?])
}
