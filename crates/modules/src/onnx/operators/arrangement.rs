// SPDX-License-Identifier: Apache-2.0
//! Operators that rearrange or repeat elements, and operators that count.
use super::movement::{moved, place, transposed};
use super::{Call, OperatorResult, axis};
use crate::onnx::value::{Content, Kind, Value, each, fixed, offset, strides};

pub fn tile(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let times = fixed(&call.known_ints(1, "repeats")?.ok_or("its repeats are missing: the file is damaged")?)?;
    if times.len() != x.shape.len() {
        return Err(format!("{} repeats do not fit shape {:?}", times.len(), x.shape));
    }
    let shape = fixed(&x.shape.iter().zip(&times).map(|(&n, &k)| n.saturating_mul(k) as i64).collect::<Vec<_>>())?;
    let own = strides(&x.shape);
    let mut indices = Vec::new();
    each(&shape, |index| indices.push(index.iter().zip(&x.shape).zip(&own).map(|((i, n), step)| i % n * step).sum()));
    Ok(vec![moved(call.program, &x, shape, indices)?])
}

pub fn range(call: &mut Call) -> OperatorResult {
    let (start, limit, delta) = (call.input(0)?, call.input(1)?, call.input(2)?);
    let count = |start: f64, limit: f64, delta: f64| -> Result<usize, String> {
        let count = ((limit - start) / delta).ceil().max(0.0);
        fixed(&[if count.is_nan() { -1 } else { count as i64 }])
            .map(|shape| shape[0])
            .map_err(|_| format!("a range from {start} to {limit} by {delta} does not end"))
    };
    match (&start.content, &limit.content, &delta.content) {
        (Content::Ints(a), Content::Ints(b), Content::Ints(d)) if [a.len(), b.len(), d.len()] == [1; 3] => {
            let n = count(a[0] as f64, b[0] as f64, d[0] as f64)?;
            Ok(vec![Value::ints(vec![n], (0..n as i64).map(|i| a[0] + i * d[0]).collect())])
        }
        (Content::Floats(a), Content::Floats(b), Content::Floats(d)) if [a.len(), b.len(), d.len()] == [1; 3] => {
            let n = count(f64::from(a[0]), f64::from(b[0]), f64::from(d[0]))?;
            Ok(vec![Value::floats(vec![n], (0..n).map(|i| a[0] + i as f32 * d[0]).collect())])
        }
        _ => Err("its start, limit and delta are not constant: the shape would be dynamic".to_string()),
    }
}

pub fn size(call: &mut Call) -> OperatorResult {
    let len = call.input(0)?.len();
    Ok(vec![Value::ints(vec![], vec![len as i64])])
}

pub fn pad(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let mode = call.text("mode", "constant");
    let given = call.known_ints(1, "pads")?.ok_or("its pads are missing: the file is damaged")?;
    let along = match call.known_ints(3, "axes")? {
        Some(given) => given.iter().map(|&a| axis(a, x.shape.len())).collect::<Result<Vec<_>, _>>()?,
        None => (0..x.shape.len()).collect(),
    };
    if given.len() != 2 * along.len() {
        return Err(format!("its pads {given:?} do not fit shape {:?}", x.shape));
    }
    let mut before = vec![0; x.shape.len()];
    let mut sizes: Vec<i64> = x.shape.iter().map(|&n| n as i64).collect();
    for (i, &at) in along.iter().enumerate() {
        before[at] = given[i];
        sizes[at] += given[i] + given[i + along.len()];
    }
    let shape = fixed(&sizes).map_err(|_| format!("its pads {given:?} leave nothing of shape {:?}", x.shape))?;
    // For each element of the result, the corresponding one of the input, or `None` in the padding.
    let own = strides(&x.shape);
    let mut sources: Vec<Option<usize>> = Vec::new();
    each(&shape, |index| {
        let at: Option<Vec<usize>> = (0..shape.len()).map(|d| source(&mode, index[d] as i64 - before[d], x.shape[d] as i64)).collect();
        sources.push(at.map(|at| offset(&at, &own)));
    });
    if let Some(all) = sources.iter().copied().collect::<Option<Vec<usize>>>() {
        return Ok(vec![moved(call.program, &x, shape, all)?]);
    }
    if mode != "constant" {
        return Err(format!("its pads {given:?} are too large for its mode '{mode}'"));
    }
    filled(call, &x, shape, &sources)
}

/// Returns the input index for index `at` of the result.
fn source(mode: &str, at: i64, n: i64) -> Option<usize> {
    let found = match mode {
        "edge" => at.clamp(0, n - 1),
        "wrap" => at.rem_euclid(n.max(1)),
        "reflect" if n == 1 => 0,
        "reflect" => {
            let round = at.rem_euclid(2 * (n - 1));
            round.min(2 * (n - 1) - round)
        }
        _ => at,
    };
    usize::try_from(found).ok().filter(|&i| (i as i64) < n)
}

/// Returns the elements of the input at `sources`, with a fill value where there is no source.
fn filled(call: &mut Call, x: &Value, shape: Vec<usize>, sources: &[Option<usize>]) -> OperatorResult {
    if let Content::Ints(ints) = &x.content {
        let value = call.known_ints(2, "value")?.and_then(|v| v.first().copied()).unwrap_or(0);
        return Ok(vec![Value::ints(shape, sources.iter().map(|at| at.map_or(value, |at| ints[at])).collect())]);
    }
    let value = match call.known_floats(2, "value")? {
        Some(floats) => floats.first().copied().unwrap_or(0.0),
        None => call.float("value", 0.0),
    };
    if let Content::Floats(floats) = &x.content {
        return Ok(vec![Value::floats(shape, sources.iter().map(|at| at.map_or(value, |at| floats[at])).collect())]);
    }
    let kind = call.program.kind(x);
    let made = call.program.value_of(kind, &shape);
    let to = call.program.name(&made)?;
    let number = if value.is_finite() { format!("{value:e}f") } else { format!("{}__builtin_inff()", if value > 0.0 { "" } else { "-" }) };
    call.program.step(&[&made], format!("EACH({}, {to}, all({number}));", made.len()));
    let mut start = 0;
    while start < sources.len() {
        let len = sources[start..].iter().take_while(|at| at.is_some()).count();
        place(call.program, &made, start, x, sources[start..start + len].iter().flatten().copied().collect())?;
        start += len + sources[start + len..].iter().take_while(|at| at.is_none()).count();
    }
    Ok(vec![made])
}

/// Translates `ArgMax` and `ArgMin`.
pub fn extreme(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    let at = axis(call.int("axis", 0), x.shape.len())?;
    let (keeps, last) = (call.int("keepdims", 1) != 0, call.int("select_last_index", 0) != 0);
    let len = x.shape[at];
    if len == 0 {
        return Err("it searches no elements".to_string());
    }
    let mut order: Vec<usize> = (0..x.shape.len()).filter(|&d| d != at).collect();
    let mut shape: Vec<usize> = order.iter().map(|&d| x.shape[d]).collect();
    order.push(at);
    if keeps {
        shape.insert(at, 1);
    }
    let rows = transposed(call.program, &x, &order)?;
    let made = call.program.value_of(Kind::Whole, &shape);
    let (to, from) = (call.program.name(&made)?, call.program.name(&rows)?);
    let sign = if call.node.op_type == "ArgMin" { "-" } else { "" };
    let wins = if last { ">=" } else { ">" };
    let text = format!(
        "for (int r = 0; r < {}; r++) {{ int best = 0; for (int i = 1; i < {len}; i++) if ({sign}{from}[r * {len} + i] {wins} {sign}{from}[r * {len} + best]) best = i; {to}[r] = (float)best; }}",
        made.len()
    );
    call.program.step(&[&made, &rows], text);
    Ok(vec![made])
}
