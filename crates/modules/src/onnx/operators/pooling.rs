// SPDX-License-Identifier: Apache-2.0
//! Operators that reduce windows over the trailing dimensions; the elements of each window are known at translation time.
use super::{Call, OperatorResult};
use crate::onnx::value::{each, offset, strides};

/// Translates `GlobalAveragePool` and `GlobalMaxPool`: a single window over all elements.
pub fn global(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    if x.shape.len() < 3 {
        return Err(format!("its input has shape {:?}, not at least three dimensions", x.shape));
    }
    let (outer, len) = (x.shape[..2].iter().product::<usize>(), x.shape[2..].iter().product::<usize>());
    let shape = [&x.shape[..2], &vec![1; x.shape.len() - 2]].concat();
    let made = call.program.value(&shape);
    let (to, from) = (call.program.name(&made)?, call.program.name(&x)?);
    let is_mean = call.node.op_type == "GlobalAveragePool";
    let windows = (0..outer).map(|row| (row * len..(row + 1) * len).collect()).collect();
    let text = pooled(call, &to, &from, windows, is_mean.then(|| vec![len; outer]));
    call.program.step(&[&made, &x], text);
    Ok(vec![made])
}

/// Translates `MaxPool` and `AveragePool`.
pub fn pool(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let spatial = x.shape.get(2..).unwrap_or_default().to_vec();
    let is_mean = call.node.op_type == "AveragePool";
    let places = |given: Option<Vec<i64>>, default: i64| -> Result<Vec<i64>, String> {
        let found = given.unwrap_or_else(|| vec![default; spatial.len()]);
        if found.len() == spatial.len() && found.iter().all(|&n| n > 0) { Ok(found) } else { Err(format!("{found:?} is not a window of shape {spatial:?}")) }
    };
    let kernel = places(Some(call.ints("kernel_shape").ok_or("its kernel_shape is missing: the file is damaged")?), 1)?;
    let (stride, dilation) = (places(call.ints("strides"), 1)?, places(call.ints("dilations"), 1)?);
    let (ceil, counts_padding) = (call.int("ceil_mode", 0) != 0, call.int("count_include_pad", 0) != 0);
    if call.int("storage_order", 0) != 0 || call.node.output.len() > 1 {
        return Err("its indices are not supported: remove them from its outputs".to_string());
    }
    let padded = padded(call, &spatial, &kernel, &stride, &dilation, ceil)?;
    let (pads, sizes) = (padded.iter().map(|d| d.pads).collect::<Vec<_>>(), padded.iter().map(|d| d.windows).collect::<Vec<_>>());
    let outer: usize = x.shape[..2].iter().product();
    let (own, len) = (strides(&spatial), spatial.iter().product::<usize>());
    let window: Vec<usize> = kernel.iter().map(|&k| k as usize).collect();
    let (mut windows, mut counts) = (Vec::new(), Vec::new());
    for row in 0..outer {
        each(&sizes, |to| {
            let (mut taken, mut count) = (Vec::new(), 0);
            each(&window, |k| {
                let at: Vec<i64> = (0..spatial.len()).map(|d| to[d] as i64 * stride[d] - pads[d].0 + k[d] as i64 * dilation[d]).collect();
                // Elements beyond the padding, which a window may cover after rounding up, do not count.
                count += usize::from((0..spatial.len()).all(|d| at[d] < spatial[d] as i64 + pads[d].1));
                let inside: Option<Vec<usize>> = at.iter().zip(&spatial).map(|(&i, &n)| usize::try_from(i).ok().filter(|&i| i < n)).collect();
                taken.extend(inside.map(|at| row * len + offset(&at, &own)));
            });
            counts.push(if counts_padding { count } else { taken.len() });
            windows.push(taken);
        });
    }
    if windows.iter().any(Vec::is_empty) {
        return Err("one of its windows lies entirely in the padding".to_string());
    }
    let made = call.program.value(&[&x.shape[..2], &sizes].concat());
    let (to, from) = (call.program.name(&made)?, call.program.name(&x)?);
    let text = pooled(call, &to, &from, windows, is_mean.then_some(counts));
    call.program.step(&[&made, &x], text);
    Ok(vec![made])
}

/// A dimension with padding at both ends, and the number of windows along it.
struct PaddedDimension {
    pads: (i64, i64),
    windows: usize,
}

fn padded(call: &Call, spatial: &[usize], kernel: &[i64], stride: &[i64], dilation: &[i64], ceil: bool) -> Result<Vec<PaddedDimension>, String> {
    let (auto, given) = (call.text("auto_pad", "NOTSET"), call.ints("pads").unwrap_or_else(|| vec![0; 2 * spatial.len()]));
    if given.len() != 2 * spatial.len() || given.iter().any(|&pad| pad < 0) {
        return Err(format!("its pads {given:?} do not fit shape {spatial:?}"));
    }
    let mut made = Vec::new();
    for d in 0..spatial.len() {
        let (n, reach) = (spatial[d] as i64, (kernel[d] - 1) * dilation[d] + 1);
        let (before, after) = match auto.as_str() {
            "VALID" => (0, 0),
            "SAME_UPPER" | "SAME_LOWER" => {
                let all = ((n + stride[d] - 1) / stride[d] - 1) * stride[d] + reach - n;
                let (less, more) = (all.max(0) / 2, all.max(0) - all.max(0) / 2);
                if auto == "SAME_UPPER" { (less, more) } else { (more, less) }
            }
            _ => (given[d], given[d + spatial.len()]),
        };
        let room = n + before + after - reach;
        let mut size = if ceil { (room + stride[d] - 1).div_euclid(stride[d]) } else { room.div_euclid(stride[d]) } + 1;
        // A window that would begin beyond the input is dropped.
        if ceil && (size - 1) * stride[d] >= n + before {
            size -= 1;
        }
        if size < 1 {
            return Err(format!("its window {kernel:?} is larger than its input {spatial:?}"));
        }
        made.push(PaddedDimension { pads: (before, after), windows: size as usize });
    }
    Ok(made)
}

/// Adds the step that reduces windows to their maximum or, if `counts` is given, to their sum divided by it.
fn pooled(call: &mut Call, to: &str, from: &str, windows: Vec<Vec<usize>>, counts: Option<Vec<usize>>) -> String {
    let n = windows.len();
    let ends = windows.iter().scan(0, |end, window| {
        *end += window.len();
        Some(*end)
    });
    let ends = call.program.table(ends.collect());
    let elements = call.program.table(windows.concat());
    match counts {
        Some(counts) => {
            let counts = call.program.table(counts);
            format!("pool_mean({to}, {from}, {elements}, {ends}, {counts}, {n});")
        }
        None => format!("pool_max({to}, {from}, {elements}, {ends}, {n});"),
    }
}
