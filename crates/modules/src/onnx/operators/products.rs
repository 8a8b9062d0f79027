// SPDX-License-Identifier: Apache-2.0
//! Matrix products: products with constant weights, which are packed for `product` of kernels.h, and products of two values by loops.
use super::elementwise::pair;
use super::movement::{moved, transposed};
use super::{Call, OperatorResult};
use crate::onnx::program::{LANES, Program};
use crate::onnx::value::{Content, Value, broadcast, spread};

/// Packs the weights of `k` inputs and `n` outputs in the order in which `product` reads them: groups of 8, 4, 2 and 1 vectors of
/// outputs, each with the vectors of one input side by side. `at` returns the weight of an input and an output.
pub fn packed(program: &mut Program, k: usize, n: usize, at: impl Fn(usize, usize) -> f32) -> String {
    let mut floats = Vec::with_capacity(k * n.div_ceil(LANES) * LANES);
    let (mut vector, mut left) = (0, n.div_ceil(LANES));
    while left > 0 {
        let group = [8, 4, 2, 1].into_iter().find(|&g| g <= left).unwrap_or(1);
        for input in 0..k {
            floats.extend((vector * LANES..(vector + group) * LANES).map(|output| if output < n { at(input, output) } else { 0.0 }));
        }
        vector += group;
        left -= group;
    }
    program.packed(floats)
}

pub fn gemm(call: &mut Call) -> OperatorResult {
    let (alpha, beta) = (call.float("alpha", 1.0), call.float("beta", 1.0));
    let (flip_a, flip_b) = (call.int("transA", 0) != 0, call.int("transB", 0) != 0);
    let (mut a, mut b) = (call.input(0)?, call.input(1)?);
    if a.shape.len() != 2 || b.shape.len() != 2 {
        return Err(format!("its operands have shapes {:?} and {:?}, not two dimensions each", a.shape, b.shape));
    }
    if flip_a {
        a = transposed(call.program, &a, &[1, 0])?;
    }
    if flip_b {
        b = transposed(call.program, &b, &[1, 0])?;
    }
    if let (true, Content::Floats(floats)) = (alpha != 1.0, &b.content) {
        b = Value::floats(b.shape.clone(), floats.iter().map(|w| w * alpha).collect());
    }
    let bias = call.optional(2).cloned();
    let n = b.shape[1];
    let constant_bias = match &bias {
        Some(Value { shape, content: Content::Floats(floats) })
            if matches!(b.content, Content::Floats(_)) && floats.len() == shape.last().copied().unwrap_or(1) =>
        {
            let row = if shape.is_empty() { [1].to_vec() } else { shape[shape.len() - 1..].to_vec() };
            (row == [1] || row == [n]).then(|| spread(&row, &[n]).iter().map(|&i| beta * floats[i]).collect::<Vec<f32>>())
        }
        _ => None,
    };
    let done = constant_bias.is_some();
    let mut made = matrices(call, &a, &b, constant_bias)?;
    if let (true, Content::Buffer(_)) = (alpha != 1.0, &b.content) {
        made = pair(call, "Mul", &made, &Value::floats(vec![], vec![alpha]))?;
    }
    if let (Some(mut bias), false) = (bias, done) {
        if beta != 1.0 {
            bias = pair(call, "Mul", &bias, &Value::floats(vec![], vec![beta]))?;
        }
        made = pair(call, "Add", &made, &bias)?;
    }
    Ok(vec![made])
}

pub fn matmul(call: &mut Call) -> OperatorResult {
    let (a, b) = (call.input(0)?, call.input(1)?);
    let lift =
        |x: &Value, column: bool| if x.shape.len() == 1 { x.reshaped(if column { vec![x.shape[0], 1] } else { vec![1, x.shape[0]] }) } else { x.clone() };
    let (from, with) = (lift(&a, false), lift(&b, true));
    if from.shape.len() < 2 || with.shape.len() < 2 {
        return Err("an operand has no dimension".to_string());
    }
    let made = matrices(call, &from, &with, None)?;
    let mut shape = made.shape.clone();
    if b.shape.len() == 1 {
        shape.pop();
    }
    if a.shape.len() == 1 {
        shape.remove(shape.len() - if b.shape.len() == 1 { 1 } else { 2 });
    }
    Ok(vec![made.reshaped(shape)])
}

/// Translates the product over the last two dimensions, with a bias per column if it is constant.
fn matrices(call: &mut Call, a: &Value, b: &Value, bias: Option<Vec<f32>>) -> Result<Value, String> {
    let (ra, rb) = (a.shape.len(), b.shape.len());
    let (m, k, n) = (a.shape[ra - 2], a.shape[ra - 1], b.shape[rb - 1]);
    if b.shape[rb - 2] != k {
        return Err(format!("shapes {:?} and {:?} cannot be multiplied: {k} inputs meet weights of {}", a.shape, b.shape, b.shape[rb - 2]));
    }
    if let (Content::Floats(floats), 2) = (&b.content, rb) {
        let rows = a.len() / k.max(1);
        let shape = [&a.shape[..ra - 1], &[n]].concat();
        let weights = packed(call.program, k, n, |input, output| floats[input * n + output]);
        let bias = call.program.packed(bias.unwrap_or_else(|| vec![0.0; n]));
        return rows_of(call.program, a, (rows, k, n), (&weights, &bias), shape);
    }
    let outer = broadcast(&a.shape[..ra - 2], &b.shape[..rb - 2])?;
    let full = |call: &mut Call, x: &Value, rank: usize| {
        let shape = [&outer[..], &x.shape[rank - 2..]].concat();
        if x.shape == shape { Ok(x.clone()) } else { moved(call.program, x, shape.clone(), spread(&x.shape, &shape)) }
    };
    let (a, b) = (full(call, a, ra)?, full(call, b, rb)?);
    let made = call.program.value(&[&outer[..], &[m, n]].concat());
    let (y, x, w) = (call.program.name(&made)?, call.program.name(&a)?, call.program.name(&b)?);
    let count: usize = outer.iter().product();
    let text = format!(
        "for (int o = 0; o < {count}; o++) for (int i = 0; i < {m}; i++) for (int j = 0; j < {n}; j++) {y}[(o * {m} + i) * {n} + j] = inner({x} + (o * {m} + i) * {k}, 1, {w} + o * {} + j, {n}, {k});",
        k * n
    );
    call.program.step(&[&made, &a, &b], text);
    Ok(made)
}

/// Translates `rows` products with the same weights. A row whose length is not a multiple of the vector length is computed in a temporary
/// row.
pub fn rows_of(
    program: &mut Program,
    a: &Value,
    (rows, k, n): (usize, usize, usize),
    (weights, bias): (&str, &str),
    shape: Vec<usize>,
) -> Result<Value, String> {
    let made = program.value(&shape);
    let (y, x) = (program.name(&made)?, program.name(a)?);
    if rows == 1 || n.is_multiple_of(LANES) {
        program.step(&[&made, a], format!("for (int i = 0; i < {rows}; i++) product({weights}, {bias}, {x} + i * {k}, {y} + i * {n}, {k}, {n});"));
        return Ok(made);
    }
    let row = program.value(&[n]);
    let part = program.name(&row)?;
    let text = format!(
        "for (int i = 0; i < {rows}; i++) {{ product({weights}, {bias}, {x} + i * {k}, {part}, {k}, {n}); memcpy({y} + i * {n}, {part}, {}); }}",
        n * 4
    );
    program.step(&[&made, a, &row], text);
    Ok(made)
}
