// SPDX-License-Identifier: Apache-2.0
//! Comparison and boolean operators, and `Where`. A boolean is 1 or 0; operators on constants are evaluated at translation time.
use super::elementwise::{full, mapped_to};
use super::{Call, OperatorResult};
use crate::onnx::value::{Content, Kind, Value, broadcast};

/// Translates a comparison, or a logical operator on two booleans.
pub fn compare(call: &mut Call) -> OperatorResult {
    let (a, b) = (call.input(0)?, call.input(1)?);
    let shape = broadcast(&a.shape, &b.shape)?;
    let (a, b) = (full(call, &a, &shape)?, full(call, &b, &shape)?);
    let operator = call.node.op_type.clone();
    if let (Some(x), Some(y)) = (numbers(&a), numbers(&b)) {
        let ints = x.iter().zip(&y).map(|(&x, &y)| i64::from(holds(&operator, x, y))).collect();
        return Ok(vec![Value::ints(shape, ints)]);
    }
    let made = call.program.value_of(Kind::Truth, &shape);
    let (to, x, y) = (call.program.name(&made)?, call.program.name(&a)?, call.program.name(&b)?);
    let (x, y) = (format!("AT({x})"), format!("AT({y})"));
    let mask = match operator.as_str() {
        "Greater" => format!("{x} > {y}"),
        "Less" => format!("{x} < {y}"),
        "GreaterOrEqual" => format!("{x} >= {y}"),
        "LessOrEqual" => format!("{x} <= {y}"),
        "And" => format!("({x} != all(0)) & ({y} != all(0))"),
        "Or" => format!("({x} != all(0)) | ({y} != all(0))"),
        "Xor" => format!("({x} != all(0)) ^ ({y} != all(0))"),
        _ => format!("{x} == {y}"),
    };
    call.program.step(&[&made, &a, &b], format!("EACH({}, {to}, truth({mask}));", made.len()));
    Ok(vec![made])
}

fn holds(operator: &str, x: f64, y: f64) -> bool {
    match operator {
        "Greater" => x > y,
        "Less" => x < y,
        "GreaterOrEqual" => x >= y,
        "LessOrEqual" => x <= y,
        "And" => x != 0.0 && y != 0.0,
        "Or" => x != 0.0 || y != 0.0,
        "Xor" => (x != 0.0) != (y != 0.0),
        _ => x == y,
    }
}

/// Returns the elements of a constant.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    match &value.content {
        Content::Ints(ints) => Some(ints.iter().map(|&i| i as f64).collect()),
        Content::Floats(floats) => Some(floats.iter().map(|&x| f64::from(x)).collect()),
        Content::Buffer(_) => None,
    }
}

pub fn not(call: &mut Call) -> OperatorResult {
    let x = call.input(0)?;
    if let Content::Ints(ints) = &x.content {
        return Ok(vec![Value::ints(x.shape.clone(), ints.iter().map(|&i| i64::from(i == 0)).collect())]);
    }
    mapped_to(call, Kind::Truth, "truth(X == all(0))")
}

/// Translates `Where`: takes elements of the second input where the first is true, and of the third elsewhere.
pub fn choose(call: &mut Call) -> OperatorResult {
    let (which, a, b) = (call.input(0)?, call.input(1)?, call.input(2)?);
    let shape = broadcast(&broadcast(&which.shape, &a.shape)?, &b.shape)?;
    let (which, a, b) = (full(call, &which, &shape)?, full(call, &a, &shape)?, full(call, &b, &shape)?);
    match (numbers(&which), &a.content, &b.content) {
        (Some(which), Content::Ints(x), Content::Ints(y)) => {
            let ints = which.iter().zip(x.iter().zip(y.iter())).map(|(&w, (&x, &y))| if w != 0.0 { x } else { y }).collect();
            return Ok(vec![Value::ints(shape, ints)]);
        }
        (Some(which), Content::Floats(x), Content::Floats(y)) => {
            let floats = which.iter().zip(x.iter().zip(y.iter())).map(|(&w, (&x, &y))| if w != 0.0 { x } else { y }).collect();
            return Ok(vec![Value::floats(shape, floats)]);
        }
        // With a constant condition, one side is used as it is.
        (Some(which), ..) if which.iter().all(|&w| w != 0.0) => return Ok(vec![a]),
        (Some(which), ..) if which.iter().all(|&w| w == 0.0) => return Ok(vec![b]),
        _ => {}
    }
    let kind = call.program.kind(if matches!(a.content, Content::Buffer(_)) { &a } else { &b });
    let made = call.program.value_of(kind, &shape);
    let names = [&made, &which, &a, &b].map(|value| call.program.name(value));
    let [to, w, x, y] = names;
    let text = format!("EACH({}, {}, pick(AT({}) != all(0), AT({}), AT({})));", made.len(), to?, w?, x?, y?);
    call.program.step(&[&made, &which, &a, &b], text);
    Ok(vec![made])
}
