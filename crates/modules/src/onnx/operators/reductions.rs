// SPDX-License-Identifier: Apache-2.0
//! Operators that reduce elements along some dimensions.
use super::movement::transposed;
use super::{Call, OperatorResult, axes};
use crate::onnx::value::Value;

pub fn reduce(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let rank = x.shape.len();
    let keep = call.int("keepdims", 1) != 0;
    let nothing = call.int("noop_with_empty_axes", 0) != 0;
    let given = call.known_ints(1, "axes")?.unwrap_or_default();
    if given.is_empty() && nothing {
        return Ok(vec![x]);
    }
    let gone = if given.is_empty() { (0..rank).collect() } else { axes(&given, rank)? };
    let kept: Vec<usize> = (0..rank).filter(|i| !gone.contains(i)).collect();
    let len: usize = gone.iter().map(|&i| x.shape[i]).product();
    let count: usize = kept.iter().map(|&i| x.shape[i]).product();
    if len == 0 {
        return Err("it reduces no elements".to_string());
    }
    let shape =
        if keep { (0..rank).map(|i| if gone.contains(&i) { 1 } else { x.shape[i] }).collect() } else { kept.iter().map(|&i| x.shape[i]).collect::<Vec<_>>() };
    let rows = transposed(call.program, &x, &[kept, gone].concat())?;
    if let Some(ints) = rows.known_ints() {
        let reduced: Option<Vec<i64>> = ints.chunks(len).map(|row| reduce_known(&call.node.op_type, row)).collect();
        return Ok(vec![Value::ints(shape, reduced.ok_or("it computes with integers in a way that is not supported")?)]);
    }
    let made = call.program.value(&shape);
    let (y, from) = (call.program.name(&made)?, call.program.name(&rows)?);
    let (start, add, end) = match call.node.op_type.as_str() {
        "ReduceMean" => ("0", "a += v", format!("a / {len}.0f")),
        "ReduceProd" => ("1", "a *= v", "a".to_string()),
        "ReduceSum" => ("0", "a += v", "a".to_string()),
        "ReduceSumSquare" => ("0", "a += v * v", "a".to_string()),
        "ReduceL2" => ("0", "a += v * v", "sqrtf(a)".to_string()),
        "ReduceMax" => ("-__builtin_inff()", "a = v > a ? v : a", "a".to_string()),
        _ => ("__builtin_inff()", "a = v < a ? v : a", "a".to_string()),
    };
    let text = format!(
        "for (int o = 0; o < {count}; o++) {{ float a = {start}; for (int j = 0; j < {len}; j++) {{ float v = {from}[o * {len} + j]; {add}; }} {y}[o] = {end}; }}"
    );
    call.program.step(&[&made, &rows], text);
    Ok(vec![made])
}

/// Evaluates a reduction of a shape at translation time.
fn reduce_known(operator: &str, row: &[i64]) -> Option<i64> {
    match operator {
        "ReduceProd" => row.iter().try_fold(1i64, |product, &i| product.checked_mul(i)),
        "ReduceSum" => row.iter().try_fold(0i64, |sum, &i| sum.checked_add(i)),
        "ReduceMax" => row.iter().copied().max(),
        "ReduceMin" => row.iter().copied().min(),
        _ => None,
    }
}
