// SPDX-License-Identifier: Apache-2.0
//! Reads an ONNX file and translates its nodes one by one.
use super::operators::translate;
use super::program::Program;
use super::proto::{self, Dimension, Graph, Model, Node, ValueInfo};
use super::value::{Kind, Value, fixed};
use prost::Message;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Supported versions of the operator set.
const OPSETS: std::ops::RangeInclusive<i64> = 7..=28;

/// A network with the steps into which it was translated.
pub struct Network {
    pub inputs: Vec<(String, Vec<usize>)>,
    pub outputs: Vec<(String, Vec<usize>)>,
    pub program: Program,
    /// Sentences about dimensions that the file leaves unspecified and that were assumed to be 1.
    pub assumed: Vec<String>,
}

/// Decodes the file and its metadata, which may contain a declaration.
///
/// # Errors
/// Fails if the bytes are not an ONNX model.
pub fn decode(bytes: &[u8]) -> Result<(Model, BTreeMap<String, String>), String> {
    let model = Model::decode(bytes).map_err(|error| format!("it is damaged, or not an ONNX file ({error}): export it again"))?;
    let metadata = model.metadata.iter().map(|entry| (entry.key.clone(), entry.value.clone())).collect();
    Ok((model, metadata))
}

/// Translates a model. `shapes` are set by the user for inputs whose shape the file leaves unspecified.
///
/// # Errors
/// Fails if a feature is not supported; the message contains the node's name and the remedy.
pub fn read(model: &Model, shapes: &BTreeMap<String, Vec<i64>>) -> Result<Network, String> {
    let graph = model.graph.as_ref().ok_or("it has no graph: it is damaged, or not an ONNX file; export it again")?;
    let opset = model.opset_import.iter().find(|opset| matches!(opset.domain.as_str(), "" | "ai.onnx")).map(|opset| opset.version);
    let opset = opset.ok_or("it does not specify an operator set version (opset): export it again")?;
    if !OPSETS.contains(&opset) {
        return Err(format!("it uses opset {opset}, but only {} to {} are supported: export it with opset_version=17", OPSETS.start(), OPSETS.end()));
    }
    let needed = needed(graph);
    let mut values: HashMap<String, Value> = HashMap::new();
    for tensor in graph.initializer.iter().filter(|tensor| needed.contains(tensor.name.as_str())) {
        let value = Value::of(tensor).map_err(|what| format!("initializer '{}': {what}", tensor.name))?;
        values.insert(tensor.name.clone(), value);
    }
    let mut program = Program::default();
    let mut assumed = Vec::new();
    let inputs = enter_inputs(graph, shapes, &mut values, &mut program, &mut assumed)?;
    for (at, node) in graph.node.iter().enumerate().filter(|(_, node)| node.output.iter().any(|name| needed.contains(name.as_str()))) {
        let named = if node.name.is_empty() { format!("node {at}") } else { format!("node '{}'", node.name) };
        enter(node, opset, &mut values, &mut program).map_err(|what| format!("{named} ({}): {what}", node.op_type))?;
    }
    let outputs = leave(graph, &values, &mut program)?;
    Ok(Network { inputs, outputs, program, assumed })
}

/// Returns the names of the values on which the outputs depend. Other nodes and weights are left out.
fn needed(graph: &Graph) -> HashSet<&str> {
    let mut needed: HashSet<&str> = graph.output.iter().map(|output| output.name.as_str()).collect();
    for node in graph.node.iter().rev() {
        if node.output.iter().any(|name| needed.contains(name.as_str())) {
            needed.extend(node.input.iter().map(String::as_str));
        }
    }
    needed.remove("");
    needed
}

fn enter_inputs(
    graph: &Graph,
    shapes: &BTreeMap<String, Vec<i64>>,
    values: &mut HashMap<String, Value>,
    program: &mut Program,
    assumed: &mut Vec<String>,
) -> Result<Vec<(String, Vec<usize>)>, String> {
    let mut inputs = Vec::new();
    let is_weight = |input: &&ValueInfo| graph.initializer.iter().any(|tensor| tensor.name == input.name);
    let open: Vec<&ValueInfo> = graph.input.iter().filter(|input| !is_weight(input)).collect();
    if let Some(unknown) = shapes.keys().find(|name| open.iter().all(|input| input.name != **name)) {
        return Err(format!("it has no input '{unknown}', for which a shape is given; its inputs are {}", names(open.iter().map(|i| i.name.as_str()))));
    }
    let batches: HashSet<&str> = open.iter().filter(|input| !shapes.contains_key(&input.name)).filter_map(|input| batch_symbol(input)).collect();
    for input in open {
        let (kind, shape) = shape_of(input, shapes.get(&input.name), &batches, assumed).map_err(|what| format!("input '{}': {what}", input.name))?;
        let value = program.value_of(kind, &shape);
        let (name, at) = (program.name(&value)?, inputs.len());
        program.step(&[&value], format!("memcpy({name}, in{at}, {});", value.len() * 4));
        match kind {
            Kind::Float => {}
            Kind::Whole => program.step(&[&value], format!("EACH({}, {name}, LANES(AT({name}), rintf));", value.len())),
            Kind::Truth => program.step(&[&value], format!("EACH({}, {name}, truth(AT({name}) != all(0)));", value.len())),
        }
        values.insert(input.name.clone(), value);
        inputs.push((input.name.clone(), shape));
    }
    Ok(inputs)
}

fn dims_of(input: &ValueInfo) -> Option<&[Dimension]> {
    input.r#type.as_ref()?.tensor.as_ref()?.shape.as_ref().map(|shape| &shape.dim[..])
}

/// Returns the symbol of an input's leading dimension, which is 1 wherever it occurs.
fn batch_symbol(input: &ValueInfo) -> Option<&str> {
    dims_of(input)?.first().map(|dim| dim.symbol.as_str()).filter(|symbol| !symbol.is_empty())
}

fn shape_of(input: &ValueInfo, given: Option<&Vec<i64>>, batches: &HashSet<&str>, assumed: &mut Vec<String>) -> Result<(Kind, Vec<usize>), String> {
    let tensor = input.r#type.as_ref().and_then(|of| of.tensor.as_ref()).ok_or("it is not a tensor: only tensors are supported")?;
    let kind = Kind::of(tensor.element);
    let kind = kind.ok_or_else(|| format!("its elements are {}: export the network with 32-bit floats", proto::type_name(tensor.element)))?;
    let dims = dims_of(input);
    if let Some(given) = given {
        let fits = dims.is_none_or(|dims| dims.len() == given.len() && dims.iter().zip(given).all(|(d, g)| d.is_open() || d.value == *g));
        if !fits {
            return Err(format!("the given shape {given:?} does not match the shape in the file"));
        }
        return Ok((kind, fixed(given)?));
    }
    let dims = dims.ok_or_else(|| format!("it has no shape: give it, shapes={{'{}': (1, ...)}}", input.name))?;
    let mut shape = Vec::new();
    for (at, dim) in dims.iter().enumerate() {
        if !dim.is_open() {
            shape.push(dim.value);
        } else if at == 0 || batches.contains(dim.symbol.as_str()) {
            let name = if dim.symbol.is_empty() { String::new() } else { format!(" '{}'", dim.symbol) };
            assumed.push(format!("dimension {at}{name} of input '{}' is 1", input.name));
            shape.push(1);
        } else {
            let (of, rank) = (if dim.symbol.is_empty() { "without a name" } else { &dim.symbol }, dims.len());
            return Err(format!(
                "its dimension {at} of {rank} is dynamic ('{of}'): export the network with fixed shapes, or give them, shapes={{'{}': (1, ...)}}",
                input.name
            ));
        }
    }
    Ok((kind, fixed(&shape)?))
}

fn enter(node: &Node, opset: i64, values: &mut HashMap<String, Value>, program: &mut Program) -> Result<(), String> {
    let find = |name: &String| match (name.as_str(), values.get(name)) {
        ("", _) => Ok(None),
        (_, Some(value)) => Ok(Some(value.clone())),
        _ => Err(format!("it reads '{name}', which no earlier node produces: the file is damaged")),
    };
    let inputs = node.input.iter().map(find).collect::<Result<Vec<_>, _>>()?;
    let outputs = translate(node, inputs, opset, program)?;
    if outputs.len() < node.output.len() {
        return Err(format!("it has {} outputs, but {} are supported", node.output.len(), outputs.len()));
    }
    values.extend(node.output.iter().cloned().zip(outputs).filter(|(name, _)| !name.is_empty()));
    Ok(())
}

fn leave(graph: &Graph, values: &HashMap<String, Value>, program: &mut Program) -> Result<Vec<(String, Vec<usize>)>, String> {
    let mut outputs = Vec::new();
    for output in &graph.output {
        let value = values.get(&output.name).ok_or_else(|| format!("no node produces its output '{}': the file is damaged", output.name))?;
        if value.len() == 0 {
            return Err(format!("its output '{}' has no elements (shape {:?})", output.name, value.shape));
        }
        let name = program.name(value)?;
        program.step(&[value], format!("memcpy(out{}, {name}, {});", outputs.len(), value.len() * 4));
        outputs.push((output.name.clone(), value.shape.clone()));
    }
    if outputs.is_empty() {
        return Err("it has no output: the file is damaged".to_string());
    }
    Ok(outputs)
}

/// Formats names for a sentence.
pub fn names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ")
}
