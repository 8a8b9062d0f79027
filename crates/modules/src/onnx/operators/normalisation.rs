// SPDX-License-Identifier: Apache-2.0
//! Softmax and normalisation operators.
use super::elementwise::pair;
use super::movement::transposed;
use super::{Call, OperatorResult, axis};
use crate::onnx::value::Value;

pub fn softmax(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let rank = x.shape.len();
    let old = call.opset < 13;
    let at = axis(call.int("axis", if old { 1 } else { -1 }), rank)?;
    // Up to opset 12 it applied to all dimensions from the axis on.
    let order: Vec<usize> = if old { (0..rank).collect() } else { (0..rank).filter(|&i| i != at).chain([at]).collect() };
    let len: usize = if old { x.shape[at..].iter().product() } else { x.shape[at] };
    let logarithm = u8::from(call.node.op_type == "LogSoftmax");
    let rows = transposed(call.program, &x, &order)?;
    let made = call.program.value(&rows.shape);
    let (y, from) = (call.program.name(&made)?, call.program.name(&rows)?);
    let count = x.len() / len.max(1);
    call.program.step(&[&made, &rows], format!("for (int o = 0; o < {count}; o++) softmax({y} + o * {len}, {from} + o * {len}, {len}, {logarithm});"));
    let back: Vec<usize> = (0..rank).map(|i| order.iter().position(|&o| o == i).unwrap_or(i)).collect();
    Ok(vec![transposed(call.program, &made, &back)?])
}

pub fn layer(call: &mut Call) -> OperatorResult {
    let (x, scale) = (call.input(0)?, call.input(1)?);
    let bias = call.optional(2).cloned();
    let at = axis(call.int("axis", -1), x.shape.len())?;
    let epsilon = call.float("epsilon", 1e-5);
    if call.int("stash_type", 1) != 1 {
        return Err("its stash_type is not float".to_string());
    }
    let len: usize = x.shape[at..].iter().product();
    let count = x.len() / len.max(1);
    let mut reduced = x.shape.clone();
    reduced[at..].fill(1);
    let (mut made, mean, inverse) = (call.program.value(&x.shape), call.program.value(&reduced), call.program.value(&reduced));
    let names = [&made, &x, &mean, &inverse].map(|value| call.program.name(value));
    let [y, from, m, by] = names;
    let (y, from, m, by) = (y?, from?, m?, by?);
    let text = format!("for (int o = 0; o < {count}; o++) normalise({y} + o * {len}, {from} + o * {len}, {len}, {epsilon:e}f, {m} + o, {by} + o);");
    call.program.step(&[&made, &x, &mean, &inverse], text);
    made = pair(call, "Mul", &made, &scale)?;
    if let Some(bias) = bias {
        made = pair(call, "Add", &made, &bias)?;
    }
    Ok(vec![made, mean, inverse])
}

pub fn batch(call: &mut Call) -> OperatorResult {
    call.attribute("momentum");
    call.attribute("spatial");
    if call.int("training_mode", 0) != 0 || call.node.output.len() > 1 {
        return Err("it is a normalisation for training: export the network for inference".to_string());
    }
    let x = call.input(0)?;
    let epsilon = call.float("epsilon", 1e-5);
    let [scale, bias, mean, variance] = [(1, "scale"), (2, "B"), (3, "input_mean"), (4, "input_var")].map(|(at, what)| call.weights(at, what));
    let (scale, bias, mean, variance) = (scale?, bias?, mean?, variance?);
    let channels = x.shape.get(1).copied().unwrap_or(0);
    if [scale.len(), bias.len(), mean.len(), variance.len()].iter().any(|&len| len != channels) {
        return Err(format!("it must have {channels} parameters of each kind, one for each channel of shape {:?}", x.shape));
    }
    let by: Vec<f32> = (0..channels).map(|i| scale[i] / (variance[i] + epsilon).sqrt()).collect();
    let shape = [&[channels], &vec![1; x.shape.len() - 2][..]].concat();
    let centred = pair(call, "Sub", &x, &Value::floats(shape.clone(), mean))?;
    let scaled = pair(call, "Mul", &centred, &Value::floats(shape.clone(), by))?;
    Ok(vec![pair(call, "Add", &scaled, &Value::floats(shape, bias))?])
}
