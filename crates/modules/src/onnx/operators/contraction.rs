// SPDX-License-Identifier: Apache-2.0
//! `Einsum`: sums of products over named dimensions, as nested loops.
use super::{Call, OperatorResult};
use crate::onnx::value::{Value, strides};
use std::collections::BTreeMap;
use std::fmt::Write;

pub fn einsum(call: &mut Call) -> OperatorResult {
    let equation: String = call.text("equation", "").chars().filter(|c| !c.is_whitespace()).collect();
    let operands = (0..call.inputs.len()).map(|at| call.input(at)).collect::<Result<Vec<_>, _>>()?;
    let (terms, result) = read(&equation, &operands)?;
    let mut sizes: BTreeMap<char, usize> = BTreeMap::new();
    for (term, operand) in terms.iter().zip(&operands) {
        for (&name, &size) in term.iter().zip(&operand.shape) {
            let known = sizes.entry(name).or_insert(size);
            if *known == 1 {
                *known = size;
            }
            if *known != size && size != 1 {
                return Err(format!("dimension '{name}' of '{equation}' is both {known} and {size}"));
            }
        }
    }
    if let Some(unknown) = result.iter().find(|name| !sizes.contains_key(name)) {
        return Err(format!("dimension '{unknown}' of the result of '{equation}' belongs to no operand"));
    }
    let made = call.program.value(&result.iter().map(|name| sizes[name]).collect::<Vec<_>>());
    let to = call.program.name(&made)?;
    let names = operands.iter().map(|operand| call.program.name(operand)).collect::<Result<Vec<_>, _>>()?;
    let summed: Vec<char> = sizes.keys().copied().filter(|name| !result.contains(name)).collect();
    let mut text = String::from("{ ");
    let open = |text: &mut String, names: &[char]| {
        for name in names {
            let _ = write!(text, "for (int d{0} = 0; d{0} < {1}; d{0}++) ", *name as u32, sizes[name]);
        }
    };
    open(&mut text, &result);
    text.push_str("{ float sum = 0; ");
    open(&mut text, &summed);
    let product: Vec<String> =
        names.iter().zip(terms.iter().zip(&operands)).map(|(name, (term, operand))| format!("{name}[{}]", place(term, &operand.shape))).collect();
    let _ = write!(text, "sum += {}; {to}[{}] = sum; }} }}", product.join(" * "), place(&result, &made.shape));
    let touched: Vec<&Value> = [&made].into_iter().chain(&operands).collect();
    call.program.step(&touched, text);
    Ok(vec![made])
}

/// Returns the dimension names of each operand and of the result. An ellipsis represents dimensions with generated names.
fn read(equation: &str, operands: &[Value]) -> Result<(Vec<Vec<char>>, Vec<char>), String> {
    let (left, right) = equation.split_once("->").map_or((equation, None), |(left, right)| (left, Some(right)));
    let written: Vec<&str> = left.split(',').collect();
    if written.len() != operands.len() {
        return Err(format!("'{equation}' has {} terms, but its node has {} inputs", written.len(), operands.len()));
    }
    let rests: Vec<usize> = written.iter().zip(operands).map(|(term, of)| of.shape.len().saturating_sub(term.replace("...", "").len())).collect();
    let most = written.iter().zip(&rests).filter(|(term, _)| term.contains("...")).map(|(_, &rest)| rest).max().unwrap_or(0);
    // Dimensions of an ellipsis are counted from the last.
    let hidden = |rest: usize| (most - rest..most).map(|at| char::from_u32(0x100 + at as u32).unwrap_or('?'));
    let named = |term: &str, rest: usize| -> Vec<char> {
        match term.split_once("...") {
            Some((before, after)) => before.chars().chain(hidden(rest)).chain(after.chars()).collect(),
            None => term.chars().collect(),
        }
    };
    let terms: Vec<Vec<char>> = written.iter().zip(&rests).map(|(term, &rest)| named(term, rest)).collect();
    for (term, operand) in terms.iter().zip(operands) {
        if term.len() != operand.shape.len() {
            return Err(format!("a term of '{equation}' has {} dimensions, but its input has shape {:?}", term.len(), operand.shape));
        }
    }
    let all: Vec<char> = terms.concat();
    let result = right.map_or_else(
        || {
            let mut once: Vec<char> = all.iter().copied().filter(|name| name.is_ascii() && all.iter().filter(|other| *other == name).count() == 1).collect();
            once.sort_unstable();
            hidden(most).chain(once).collect()
        },
        |right| named(right, most),
    );
    if (0..result.len()).any(|i| result[..i].contains(&result[i])) {
        return Err(format!("the result of '{equation}' names a dimension more than once"));
    }
    Ok((terms, result))
}

/// Returns the index of an element as an expression in the loop variables. A dimension of 1 is broadcast.
fn place(term: &[char], shape: &[usize]) -> String {
    let parts: Vec<String> = term
        .iter()
        .zip(shape)
        .zip(strides(shape))
        .filter(|((_, size), _)| **size != 1)
        .map(|((name, _), step)| format!("d{} * {step}", *name as u32))
        .collect();
    if parts.is_empty() { "0".to_string() } else { parts.join(" + ") }
}
