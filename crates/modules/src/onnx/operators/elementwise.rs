// SPDX-License-Identifier: Apache-2.0
//! Operators that compute each element from the input elements at the same position.
use super::movement::moved;
use super::{Call, Operator, OperatorResult};
use crate::onnx::proto;
use crate::onnx::value::{Content, Kind, Value, broadcast, spread};

pub fn find(operator: &str) -> Option<Operator> {
    Some(match operator {
        "Relu" | "Tanh" | "Sigmoid" | "Softplus" | "Softsign" | "Exp" | "Log" | "Sqrt" | "Abs" | "Neg" | "Reciprocal" | "Floor" | "Ceil" | "Sin" | "Cos"
        | "Erf" | "HardSwish" | "Mish" | "Swish" | "Sign" | "Round" | "Tan" => plain,
        "LeakyRelu" | "Elu" | "Selu" | "Celu" | "ThresholdedRelu" | "HardSigmoid" | "Gelu" => shaped,
        "Clip" => clip,
        "Add" | "Sub" | "Mul" | "Div" | "Pow" | "PRelu" | "Min" | "Max" | "Sum" | "Mean" => combined,
        _ => return None,
    })
}

fn plain(call: &mut Call) -> OperatorResult {
    let e = match call.node.op_type.as_str() {
        "Relu" => "relu(X)",
        "Tanh" => "hyperbolic_tangent(X)",
        "Sigmoid" => "sigmoid(X)",
        "Softplus" => "softplus(X)",
        "Softsign" => "softsign(X)",
        "Exp" => "exponential(X)",
        "Log" => "LANES(X, logf)",
        "Sqrt" => "root(X)",
        "Abs" => "magnitude(X)",
        "Neg" => "-X",
        "Reciprocal" => "1.0f / X",
        "Floor" => "LANES(X, floorf)",
        "Ceil" => "LANES(X, ceilf)",
        "Sin" => "LANES(X, sinf)",
        "Cos" => "LANES(X, cosf)",
        "Erf" => "LANES(X, erff)",
        "Sign" => "sign(X)",
        "Round" => "LANES(X, rintf)",
        "Tan" => "LANES(X, tanf)",
        "HardSwish" => "X * hard_sigmoid(X, 1.0f / 6.0f, 0.5f)",
        "Mish" => "X * hyperbolic_tangent(softplus(X))",
        _ => return shaped(call),
    };
    mapped(call, e)
}

fn shaped(call: &mut Call) -> OperatorResult {
    let alpha = |default: f32| format!("{:e}f", call.float("alpha", default));
    let e = match call.node.op_type.as_str() {
        "LeakyRelu" => format!("leaky(X, all({}))", alpha(0.01)),
        "Elu" => format!("elu(X, {})", alpha(1.0)),
        "Celu" => format!("celu(X, {})", alpha(1.0)),
        "Selu" => format!("selu(X, {}, {:e}f)", alpha(1.673_263_2), call.float("gamma", 1.050_701)),
        "ThresholdedRelu" => format!("pick(X > all({}), X, all(0))", alpha(1.0)),
        "HardSigmoid" => format!("hard_sigmoid(X, {}, {:e}f)", alpha(0.2), call.float("beta", 0.5)),
        "Swish" => format!("X * sigmoid({} * X)", alpha(1.0)),
        _ if call.text("approximate", "none") == "tanh" => "gelu_tanh(X)".to_string(),
        _ => "gelu(X)".to_string(),
    };
    mapped(call, &e)
}

fn clip(call: &mut Call) -> OperatorResult {
    let end = |at: usize, attribute: &str, default: f32| -> Result<f32, String> {
        Ok(match call.known_floats(at, attribute)? {
            Some(floats) => *floats.first().ok_or("a bound is empty")?,
            None => call.float(attribute, default),
        })
    };
    let (least, most) = (end(1, "min", f32::MIN)?, end(2, "max", f32::MAX)?);
    mapped(call, &format!("clip(X, {least:e}f, {most:e}f)"))
}

/// Applies an expression in `X` to each element.
pub fn mapped(call: &mut Call, expression: &str) -> OperatorResult {
    let x = call.input(0)?;
    if let Some(ints) = x.known_ints() {
        let operator = call.node.op_type.as_str();
        let compute: fn(i64) -> Option<i64> = match operator {
            "Neg" => i64::checked_neg,
            "Abs" => i64::checked_abs,
            "Sign" => |i| Some(i.signum()),
            _ => |_| None,
        };
        let ints: Option<Vec<i64>> = ints.iter().map(|&i| compute(i)).collect();
        return Ok(vec![Value::ints(x.shape.clone(), ints.ok_or("it computes with integers in a way that is not supported")?)]);
    }
    let kind = call.program.kind(&x);
    mapped_to(call, kind, expression)
}

pub fn cast(call: &mut Call) -> OperatorResult {
    call.attribute("saturate");
    call.attribute("round_mode");
    let (x, to) = (call.input(0)?, call.int("to", 0));
    let kind = i32::try_from(to).ok().and_then(Kind::of);
    let kind = kind.ok_or_else(|| format!("a cast to {} is not supported: export the network with floats", proto::type_name(to as i32)))?;
    Ok(vec![match (&x.content, kind) {
        (Content::Ints(ints), Kind::Float) => Value::floats(x.shape.clone(), ints.iter().map(|&i| i as f32).collect()),
        (Content::Ints(ints), Kind::Truth) => Value::ints(x.shape.clone(), ints.iter().map(|&i| i64::from(i != 0)).collect()),
        (Content::Floats(floats), Kind::Whole) => Value::ints(x.shape.clone(), floats.iter().map(|&f| f as i64).collect()),
        (Content::Floats(floats), Kind::Truth) => Value::ints(x.shape.clone(), floats.iter().map(|&f| i64::from(f != 0.0)).collect()),
        (Content::Ints(_), Kind::Whole) | (Content::Floats(_), Kind::Float) => x,
        (Content::Buffer(_), kind) if call.program.kind(&x) == kind => x,
        (Content::Buffer(_), Kind::Whole) if call.program.kind(&x) == Kind::Float => return mapped_to(call, kind, "LANES(X, truncf)"),
        (Content::Buffer(_), Kind::Truth) => return mapped_to(call, kind, "truth(X != all(0))"),
        (Content::Buffer(_), _) => return mapped_to(call, kind, "X"),
    }])
}

/// Applies an expression to each element, with a result of another kind.
pub fn mapped_to(call: &mut Call, kind: Kind, expression: &str) -> OperatorResult {
    let x = call.input(0)?;
    let made = call.program.value_of(kind, &x.shape);
    let (to, from) = (call.program.name(&made)?, call.program.name(&x)?);
    let e = expression.replace('X', &format!("AT({from})"));
    call.program.step(&[&made, &x], format!("EACH({}, {to}, {e});", x.len()));
    Ok(vec![made])
}

fn combined(call: &mut Call) -> OperatorResult {
    let operator = call.node.op_type.clone();
    if call.opset < 7 && call.node.attribute.iter().any(|a| a.name == "broadcast") {
        return Err("it broadcasts its operands by the rule before opset 7: export the network with a newer opset".to_string());
    }
    let mut made = call.input(0)?;
    for at in 1..call.inputs.len() {
        let next = call.input(at)?;
        made = pair(call, &operator, &made, &next)?;
    }
    if operator == "Mean" {
        let share = Value::floats(vec![], vec![call.inputs.len() as f32]);
        made = pair(call, "Div", &made, &share)?;
    }
    Ok(vec![made])
}

/// Translates an operator of two operands, broadcast to a common shape.
pub fn pair(call: &mut Call, operator: &str, a: &Value, b: &Value) -> Result<Value, String> {
    let shape = broadcast(&a.shape, &b.shape)?;
    if let (Content::Ints(x), Content::Ints(y)) = (&a.content, &b.content) {
        return integers(operator, x, y, (&a.shape, &b.shape), shape);
    }
    let (a, b) = (full(call, a, &shape)?, full(call, b, &shape)?);
    if let (Content::Floats(x), Content::Floats(y)) = (&a.content, &b.content)
        && let Some(known) = floats(operator, x, y)
    {
        return Ok(Value::floats(shape, known));
    }
    let kind = call.program.kind(if matches!(a.content, Content::Buffer(_)) { &a } else { &b });
    let made = call.program.value_of(kind, &shape);
    let (to, x, y) = (call.program.name(&made)?, call.program.name(&a)?, call.program.name(&b)?);
    let (x, y) = (format!("AT({x})"), format!("AT({y})"));
    let e = match operator {
        "Add" | "Sum" | "Mean" => format!("{x} + {y}"),
        "Sub" => format!("{x} - {y}"),
        "Mul" => format!("{x} * {y}"),
        "Div" => format!("{x} / {y}"),
        "Pow" => format!("LANES2({x}, {y}, powf)"),
        "PRelu" => format!("leaky({x}, {y})"),
        "Min" => format!("smaller({x}, {y})"),
        _ => format!("larger({x}, {y})"),
    };
    call.program.step(&[&made, &a, &b], format!("EACH({}, {to}, {e});", made.len()));
    Ok(made)
}

/// Broadcasts a value to a shape.
pub fn full(call: &mut Call, x: &Value, shape: &[usize]) -> Result<Value, String> {
    if x.shape == shape { Ok(x.clone()) } else { moved(call.program, x, shape.to_vec(), spread(&x.shape, shape)) }
}

/// Evaluates arithmetic on constants whose result is bit-identical at translation time and at run time.
fn floats(operator: &str, x: &[f32], y: &[f32]) -> Option<Vec<f32>> {
    let compute: fn(f32, f32) -> f32 = match operator {
        "Add" | "Sum" | "Mean" => |a, b| a + b,
        "Sub" => |a, b| a - b,
        "Mul" => |a, b| a * b,
        "Div" => |a, b| a / b,
        _ => return None,
    };
    let made: Vec<f32> = x.iter().zip(y).map(|(&a, &b)| compute(a, b)).collect();
    made.iter().all(|x| !x.is_nan()).then_some(made)
}

/// Evaluates arithmetic on shapes at translation time.
fn integers(operator: &str, x: &[i64], y: &[i64], from: (&[usize], &[usize]), shape: Vec<usize>) -> Result<Value, String> {
    let (at_x, at_y) = (spread(from.0, &shape), spread(from.1, &shape));
    let compute = |(&i, &j): (&usize, &usize)| match (operator, x[i], y[j]) {
        ("Add", a, b) => a.checked_add(b),
        ("Sub", a, b) => a.checked_sub(b),
        ("Mul", a, b) => a.checked_mul(b),
        ("Div", a, b) => a.checked_div(b),
        ("Min", a, b) => Some(a.min(b)),
        ("Max", a, b) => Some(a.max(b)),
        ("Mod", a, b) => a.checked_rem_euclid(b),
        _ => None,
    };
    let ints: Option<Vec<i64>> = at_x.iter().zip(&at_y).map(compute).collect();
    Ok(Value::ints(shape, ints.ok_or("it computes with integers in a way that is not supported")?))
}
