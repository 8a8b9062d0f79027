// SPDX-License-Identifier: Apache-2.0
//! Translation of each ONNX operator. An operator is a function from a [`Call`] to its outputs; `find` lists the supported ones.
mod arrangement;
mod contraction;
mod convolution;
mod elementwise;
mod logic;
mod movement;
mod normalisation;
mod pooling;
mod products;
mod recurrent;
mod reductions;

use super::program::Program;
use super::proto::{Attribute, Node};
use super::value::{Content, Kind, Value};
use std::cell::RefCell;

type OperatorResult = Result<Vec<Value>, String>;
type Operator = fn(&mut Call) -> OperatorResult;

/// A node being translated.
pub struct Call<'a> {
    pub node: &'a Node,
    pub inputs: Vec<Option<Value>>,
    pub opset: i64,
    pub program: &'a mut Program,
    asked: RefCell<Vec<String>>,
}

/// Translates a node into steps of the program; returns its outputs.
///
/// # Errors
/// Fails if the operator, or one of its attributes, shapes or inputs, is not supported.
pub fn translate(node: &Node, inputs: Vec<Option<Value>>, opset: i64, program: &mut Program) -> OperatorResult {
    let foreign = !matches!(node.domain.as_str(), "" | "ai.onnx");
    let Some(operator) = find(&node.op_type).filter(|_| !foreign) else {
        let domain = if foreign { format!(" of domain '{}'", node.domain) } else { String::new() };
        return Err(format!(
            "the operator{domain} is not supported: export the network without it, or run it in a process; docs/policies.md lists the operators"
        ));
    };
    if let Some(kind) = inputs.iter().flatten().map(|input| program.kind_at_run_time(input)).find(|kind| *kind != Kind::Float)
        && !TAKE_ANY.contains(&node.op_type.as_str())
        && !(kind == Kind::Whole && TAKE_WHOLE.contains(&node.op_type.as_str()))
    {
        let what = if kind == Kind::Whole { "integers" } else { "Booleans" };
        return Err(format!("it computes with {what}, which is not supported for this operator: cast them to floats first"));
    }
    let mut call = Call { node, inputs, opset, program, asked: RefCell::default() };
    let outputs = operator(&mut call)?;
    match node.attribute.iter().find(|attribute| !call.asked.borrow().contains(&attribute.name)) {
        Some(unknown) => Err(format!("its attribute '{}' is not supported", unknown.name)),
        None => Ok(outputs),
    }
}

/// Operators that accept elements of any kind.
const TAKE_ANY: [&str; 23] = [
    "Identity",
    "Dropout",
    "Cast",
    "Reshape",
    "Flatten",
    "Squeeze",
    "Unsqueeze",
    "Transpose",
    "Concat",
    "Slice",
    "Split",
    "Gather",
    "Expand",
    "Tile",
    "Pad",
    "Where",
    "Not",
    "And",
    "Or",
    "Xor",
    "Equal",
    "Shape",
    "Size",
];
/// Operators that accept integers known only at run time.
const TAKE_WHOLE: [&str; 12] = ["Add", "Sub", "Mul", "Min", "Max", "Sum", "Neg", "Abs", "Greater", "Less", "GreaterOrEqual", "LessOrEqual"];

fn find(operator: &str) -> Option<Operator> {
    Some(match operator {
        "Constant" => movement::constant,
        "ConstantOfShape" => movement::constant_of_shape,
        "Shape" => movement::shape,
        "Identity" | "Dropout" => movement::identity,
        "Cast" => elementwise::cast,
        "Reshape" => movement::reshape,
        "Flatten" => movement::flatten,
        "Squeeze" => movement::squeeze,
        "Unsqueeze" => movement::unsqueeze,
        "Transpose" => movement::transpose,
        "Concat" => movement::concat,
        "Slice" => movement::slice,
        "Split" => movement::split,
        "Gather" => movement::gather,
        "Expand" => movement::expand,
        "Gemm" => products::gemm,
        "MatMul" => products::matmul,
        "Conv" => convolution::conv,
        "Softmax" | "LogSoftmax" => normalisation::softmax,
        "LayerNormalization" => normalisation::layer,
        "BatchNormalization" => normalisation::batch,
        "ReduceMean" | "ReduceSum" | "ReduceProd" | "ReduceMax" | "ReduceMin" | "ReduceSumSquare" | "ReduceL2" => reductions::reduce,
        "Tile" => arrangement::tile,
        "Range" => arrangement::range,
        "Size" => arrangement::size,
        "Pad" => arrangement::pad,
        "ArgMax" | "ArgMin" => arrangement::extreme,
        "Equal" | "Greater" | "Less" | "GreaterOrEqual" | "LessOrEqual" | "And" | "Or" | "Xor" => logic::compare,
        "Not" => logic::not,
        "Where" => logic::choose,
        "MaxPool" | "AveragePool" => pooling::pool,
        "GlobalMaxPool" | "GlobalAveragePool" => pooling::global,
        "Einsum" => contraction::einsum,
        "RNN" => recurrent::rnn,
        "GRU" => recurrent::gru,
        "LSTM" => recurrent::lstm,
        _ => return elementwise::find(operator),
    })
}

impl Call<'_> {
    fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.asked.borrow_mut().push(name.to_string());
        self.node.attribute.iter().find(|attribute| attribute.name == name)
    }

    fn int(&self, name: &str, default: i64) -> i64 {
        self.attribute(name).map_or(default, |attribute| attribute.i)
    }

    fn float(&self, name: &str, default: f32) -> f32 {
        self.attribute(name).map_or(default, |attribute| attribute.f)
    }

    fn ints(&self, name: &str) -> Option<Vec<i64>> {
        self.attribute(name).map(|attribute| attribute.ints.clone())
    }

    fn text(&self, name: &str, default: &str) -> String {
        self.attribute(name).map_or(default.to_string(), |attribute| String::from_utf8_lossy(&attribute.s).into_owned())
    }

    fn optional(&self, at: usize) -> Option<&Value> {
        self.inputs.get(at).and_then(Option::as_ref)
    }

    fn input(&self, at: usize) -> Result<Value, String> {
        self.optional(at).cloned().ok_or_else(|| format!("its input {at} is missing: the file is damaged"))
    }

    /// Returns integers known at translation time, from an input or, in older opsets, from an attribute; `None` if neither is present.
    fn known_ints(&self, at: usize, attribute: &str) -> Result<Option<Vec<i64>>, String> {
        match self.optional(at) {
            None => Ok(self.ints(attribute)),
            Some(Value { content: Content::Ints(ints), .. }) => Ok(Some(ints.to_vec())),
            Some(_) => Err(format!("its input '{attribute}' is not constant: the shape would be dynamic; export the network with fixed shapes")),
        }
    }

    /// Returns floats known at translation time.
    fn known_floats(&self, at: usize, what: &str) -> Result<Option<Vec<f32>>, String> {
        match self.optional(at) {
            None => Ok(None),
            Some(Value { content: Content::Floats(floats), .. }) => Ok(Some(floats.to_vec())),
            Some(_) => Err(format!("its input '{what}' is not constant: export the network with its weights as initializers")),
        }
    }

    fn weights(&self, at: usize, what: &str) -> Result<Vec<f32>, String> {
        self.known_floats(at, what)?.ok_or_else(|| format!("its input '{what}' is missing: the file is damaged"))
    }
}

/// Resolves a dimension index, which may be counted from the end.
fn axis(axis: i64, rank: usize) -> Result<usize, String> {
    let from_start = if axis < 0 { axis.checked_add(i64::try_from(rank).unwrap_or(0)) } else { Some(axis) };
    let found = from_start.and_then(|axis| usize::try_from(axis).ok()).filter(|&axis| axis < rank);
    found.ok_or_else(|| format!("a value of {rank} dimensions has no axis {axis}"))
}

fn axes(given: &[i64], rank: usize) -> Result<Vec<usize>, String> {
    let mut found = given.iter().map(|&a| axis(a, rank)).collect::<Result<Vec<_>, _>>()?;
    found.sort_unstable();
    found.dedup();
    Ok(found)
}
