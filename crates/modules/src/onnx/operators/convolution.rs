// SPDX-License-Identifier: Apache-2.0
//! Convolution as one product for each position: gathers the elements under the kernel, with zeros outside the input.
use super::movement::{moved, transposed};
use super::products::{packed, rows_of};
use super::{Call, OperatorResult};
use crate::onnx::value::{Value, each, offset, strides};

/// Position of the kernel on the input: one entry for each dimension after the channels.
struct Layout {
    kernel: Vec<usize>,
    step: Vec<usize>,
    spacing: Vec<usize>,
    before: Vec<usize>,
    out: Vec<usize>,
}

pub fn conv(call: &mut Call) -> OperatorResult {
    let (x, w) = (call.input(0)?, call.input(1)?);
    let weights = call.weights(1, "W")?;
    let bias = call.known_floats(2, "B")?;
    if x.shape.len() < 3 || w.shape.len() != x.shape.len() {
        return Err(format!("its input and weights have shapes {:?} and {:?}", x.shape, w.shape));
    }
    let groups = usize::try_from(call.int("group", 1)).unwrap_or(0);
    let (outputs, channels) = (w.shape[0], w.shape[1]);
    if groups == 0 || channels * groups != x.shape[1] || !outputs.is_multiple_of(groups) {
        return Err(format!("weights of shape {:?} in {groups} groups do not fit an input of shape {:?}", w.shape, x.shape));
    }
    let layout = layout(call, &x.shape[2..], &w.shape[2..])?;
    let padded = with_zero(call, &x)?;
    let (each_out, k) = (outputs / groups, w.shape[1..].iter().product::<usize>());
    let (batch, places) = (x.shape[0], layout.out.iter().product::<usize>());
    let mut parts = Vec::new();
    for group in 0..groups {
        let patches = moved(call.program, &padded, vec![batch * places, k], patches(&layout, &x.shape, group * channels, channels))?;
        let text = packed(call.program, k, each_out, |input, output| weights[(group * each_out + output) * k + input]);
        let own = bias.as_ref().map_or_else(|| vec![0.0; each_out], |b| b[group * each_out..(group + 1) * each_out].to_vec());
        let own = call.program.packed(own);
        let rows = rows_of(call.program, &patches, (batch * places, k, each_out), (&text, &own), vec![batch, places, each_out])?;
        parts.push(transposed(call.program, &rows, &[0, 2, 1])?);
    }
    let shape = [&[batch, outputs], &layout.out[..]].concat();
    if let [only] = &parts[..] {
        return Ok(vec![only.reshaped(shape)]);
    }
    let made = call.program.value(&shape);
    let row = each_out * places;
    for (group, part) in parts.iter().enumerate() {
        let (y, from) = (call.program.name(&made)?, call.program.name(part)?);
        let text = format!("for (int i = 0; i < {batch}; i++) memcpy({y} + i * {} + {}, {from} + i * {row}, {});", row * groups, group * row, row * 4);
        call.program.step(&[&made, part], text);
    }
    Ok(vec![made])
}

fn layout(call: &Call, input: &[usize], kernel: &[usize]) -> Result<Layout, String> {
    let rank = input.len();
    let sizes = |name: &str| -> Result<Vec<usize>, String> {
        let given = call.ints(name).unwrap_or_else(|| vec![1; rank]);
        let read: Option<Vec<usize>> = given.iter().map(|&i| usize::try_from(i).ok().filter(|&i| i > 0)).collect();
        read.filter(|read| read.len() == rank).ok_or_else(|| format!("its attribute '{name}' is {given:?}"))
    };
    if call.ints("kernel_shape").is_some_and(|given| !given.iter().map(|&i| i as usize).eq(kernel.iter().copied())) {
        return Err(format!("its kernel_shape is not that of its weights, {kernel:?}"));
    }
    let (step, spacing) = (sizes("strides")?, sizes("dilations")?);
    let extent: Vec<usize> = (0..rank).map(|d| (kernel[d].max(1) - 1) * spacing[d] + 1).collect();
    let given = call.ints("pads").unwrap_or_else(|| vec![0; 2 * rank]);
    let pads: Option<Vec<usize>> = given.iter().map(|&p| usize::try_from(p).ok()).collect();
    let pads = pads.filter(|pads| pads.len() == 2 * rank).ok_or_else(|| format!("its pads are {given:?}"))?;
    let (mut before, mut out) = (pads[..rank].to_vec(), Vec::new());
    let auto = call.text("auto_pad", "NOTSET");
    for d in 0..rank {
        if auto.starts_with("SAME") {
            out.push(input[d].div_ceil(step[d]));
            let all = ((out[d].max(1) - 1) * step[d] + extent[d]).saturating_sub(input[d]);
            before[d] = if auto == "SAME_LOWER" { all.div_ceil(2) } else { all / 2 };
            continue;
        }
        let room = (input[d] + before[d] + pads[rank + d]).checked_sub(extent[d]).ok_or("its kernel is larger than its input")?;
        out.push(room / step[d] + 1);
    }
    Ok(Layout { kernel: kernel.to_vec(), step, spacing, before, out })
}

/// Returns the elements of `x` with a zero appended.
fn with_zero(call: &mut Call, x: &Value) -> Result<Value, String> {
    let made = call.program.value(&[x.len() + 1]);
    let (y, from) = (call.program.name(&made)?, call.program.name(x)?);
    call.program.step(&[&made, x], format!("memcpy({y}, {from}, {}); {y}[{}] = 0;", x.len() * 4, x.len()));
    Ok(made)
}

/// Returns, for each position of the output, the elements under the kernel in the order of the weights.
fn patches(layout: &Layout, shape: &[usize], first: usize, channels: usize) -> Vec<usize> {
    let (own, zero) = (strides(shape), shape.iter().product());
    let mut indices = Vec::new();
    for batch in 0..shape[0] {
        each(&layout.out, |place| {
            for channel in first..first + channels {
                each(&layout.kernel, |tap| {
                    let at = (0..tap.len())
                        .map(|d| (place[d] * layout.step[d] + tap[d] * layout.spacing[d]).checked_sub(layout.before[d]).filter(|&i| i < shape[2 + d]));
                    let at: Option<Vec<usize>> = at.collect();
                    indices.push(at.map_or(zero, |at| batch * own[0] + channel * own[1] + offset(&at, &own[2..])));
                });
            }
        });
    }
    indices
}
