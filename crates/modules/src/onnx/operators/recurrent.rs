// SPDX-License-Identifier: Apache-2.0
//! RNN, GRU and LSTM, forward: two products and the gates for each step of the sequence.
use super::products::packed;
use super::{Call, OperatorResult};
use crate::onnx::program::LANES;
use crate::onnx::value::Value;

/// Sizes and weights common to all recurrent operators.
struct Cell {
    x: Value,
    steps: usize,
    batch: usize,
    inputs: usize,
    hidden: usize,
    /// `hidden` rounded up to whole vectors; each gate starts at a multiple of it.
    padded: usize,
    is_batch_first: bool,
    w: Vec<f32>,
    r: Vec<f32>,
    bias: Vec<f32>,
}

impl Cell {
    fn read(call: &mut Call, gates: usize, activations: &str) -> Result<Cell, String> {
        if call.text("direction", "forward") != "forward" {
            return Err("its direction is not forward: the other directions need future values".to_string());
        }
        let given = activations_of(call);
        if !given.is_empty() && given.join(" ") != activations {
            return Err(format!("its activations are {}, but only {activations} are supported", given.join(" ")));
        }
        if call.optional(4).is_some() {
            return Err("it has sequence_lens: export the network with sequences of fixed length".to_string());
        }
        let is_batch_first = call.int("layout", 0) != 0;
        let (x, shape) = (call.input(0)?, call.input(1)?.shape);
        let (w, r) = (call.weights(1, "W")?, call.weights(2, "R")?);
        let hidden = shape.get(1).copied().unwrap_or(0) / gates;
        let [first, second, inputs] = x.shape[..] else { return Err(format!("its input has shape {:?}, not three dimensions", x.shape)) };
        let (steps, batch) = if is_batch_first { (second, first) } else { (first, second) };
        let declared = call.int("hidden_size", hidden as i64);
        if hidden == 0 || declared != hidden as i64 || w.len() != gates * hidden * inputs || r.len() != gates * hidden * hidden {
            return Err(format!("its weights W of shape {shape:?} do not fit an input of shape {:?} and a hidden_size of {declared}", x.shape));
        }
        let bias = call.known_floats(3, "B")?.unwrap_or_else(|| vec![0.0; 2 * gates * hidden]);
        if bias.len() != 2 * gates * hidden {
            return Err(format!("its bias has {} values, not {}", bias.len(), 2 * gates * hidden));
        }
        Ok(Cell { x, steps, batch, inputs, hidden, padded: hidden.div_ceil(LANES) * LANES, is_batch_first, w, r, bias })
    }

    /// Packs gates `from..to` of weights with `k` inputs.
    fn packed(&self, call: &mut Call, weights: &[f32], k: usize, (from, to): (usize, usize)) -> String {
        packed(call.program, k, (to - from) * self.padded, |input, output| {
            let (gate, unit) = (from + output / self.padded, output % self.padded);
            if unit < self.hidden { weights[(gate * self.hidden + unit) * k + input] } else { 0.0 }
        })
    }

    fn biases(&self, call: &mut Call, gates: usize, at: impl Fn(usize, usize) -> f32) -> String {
        let all = (0..gates * self.padded).map(|i| if i % self.padded < self.hidden { at(i / self.padded, i % self.padded) } else { 0.0 });
        call.program.packed(all.collect())
    }

    /// Creates a state whose rows are padded to whole vectors, from an optional input.
    fn state(&self, call: &mut Call, at: usize) -> Result<Value, String> {
        let state = call.program.value(&[self.batch, self.padded]);
        let y = call.program.name(&state)?;
        let Some(initial) = call.optional(at).cloned() else {
            call.program.step(&[&state], format!("memset({y}, 0, {});", state.len() * 4));
            return Ok(state);
        };
        if initial.len() != self.batch * self.hidden {
            return Err(format!("its initial state has shape {:?}, not {} values", initial.shape, self.batch * self.hidden));
        }
        let x = call.program.name(&initial)?;
        let (p, h) = (self.padded, self.hidden);
        let text = format!("memset({y}, 0, {}); for (int n = 0; n < {}; n++) memcpy({y} + n * {p}, {x} + n * {h}, {});", state.len() * 4, self.batch, h * 4);
        call.program.step(&[&state, &initial], text);
        Ok(state)
    }

    /// Returns a state as an output of the node.
    fn last(&self, call: &mut Call, state: &Value) -> Result<Value, String> {
        let shape = if self.is_batch_first { [self.batch, 1, self.hidden] } else { [1, self.batch, self.hidden] };
        let made = call.program.value(&shape);
        let (y, x) = (call.program.name(&made)?, call.program.name(state)?);
        let text = format!("for (int n = 0; n < {}; n++) memcpy({y} + n * {}, {x} + n * {}, {});", self.batch, self.hidden, self.padded, self.hidden * 4);
        call.program.step(&[&made, state], text);
        Ok(made)
    }

    /// Adds the loop over steps and rows around `body`, which reads its input from `x` and writes its output to `h`; returns the whole
    /// sequence.
    fn run(&self, call: &mut Call, h: &Value, others: &[&Value], body: &str) -> Result<Value, String> {
        let shape = if self.is_batch_first { [self.batch, self.steps, 1, self.hidden] } else { [self.steps, 1, self.batch, self.hidden] };
        let all = call.program.value(&shape);
        let (y, x, state) = (call.program.name(&all)?, call.program.name(&self.x)?, call.program.name(h)?);
        let at = if self.is_batch_first { format!("(n * {} + t)", self.steps) } else { format!("(t * {} + n)", self.batch) };
        let text = format!(
            "for (int t = 0; t < {}; t++) for (int n = 0; n < {}; n++) {{ const float *x = {x} + {at} * {}; float *h = {state} + n * {}; {body} memcpy({y} + {at} * {}, h, {}); }}",
            self.steps,
            self.batch,
            self.inputs,
            self.padded,
            self.hidden,
            self.hidden * 4
        );
        call.program.step(&[&[&all, &self.x, h], others].concat(), text);
        Ok(all)
    }
}

fn activations_of(call: &Call) -> Vec<String> {
    call.attribute("activations").map(|a| a.strings.iter().map(|s| String::from_utf8_lossy(s).into_owned()).collect()).unwrap_or_default()
}

pub fn rnn(call: &mut Call) -> OperatorResult {
    let activation = activations_of(call).first().cloned().unwrap_or_else(|| "Tanh".to_string());
    let function = match activation.as_str() {
        "Tanh" => "hyperbolic_tangent",
        "Relu" => "relu",
        "Sigmoid" => "sigmoid",
        other => return Err(format!("its activation is {other}, but only Tanh, Relu and Sigmoid are supported")),
    };
    let cell = Cell::read(call, 1, &activation)?;
    let (h, p, k) = (cell.hidden, cell.padded, cell.inputs);
    let b = cell.bias.clone();
    let (w, r) = (cell.packed(call, &cell.w, k, (0, 1)), cell.packed(call, &cell.r, h, (0, 1)));
    let (bias, zero) = (cell.biases(call, 1, |_, i| b[i] + b[h + i]), cell.biases(call, 1, |_, _| 0.0));
    let state = cell.state(call, 5)?;
    let (gates, other) = (call.program.value(&[p]), call.program.value(&[p]));
    let (g, o) = (call.program.name(&gates)?, call.program.name(&other)?);
    let body = format!("product({w}, {bias}, x, {g}, {k}, {p}); product({r}, {zero}, h, {o}, {h}, {p}); EACH({p}, h, {function}(AT({g}) + AT({o})));");
    let all = cell.run(call, &state, &[&gates, &other], &body)?;
    let last = cell.last(call, &state)?;
    Ok(vec![all, last])
}

pub fn gru(call: &mut Call) -> OperatorResult {
    let cell = Cell::read(call, 3, "Sigmoid Tanh")?;
    let reset_after = call.int("linear_before_reset", 0) != 0;
    let (h, p, k) = (cell.hidden, cell.padded, cell.inputs);
    let b = cell.bias.clone();
    let w = cell.packed(call, &cell.w, k, (0, 3));
    let (r, r_new) = (cell.packed(call, &cell.r, h, (0, 2)), cell.packed(call, &cell.r, h, (2, 3)));
    let bias = cell.biases(call, 3, |gate, i| b[gate * h + i] + if gate < 2 || !reset_after { b[(3 + gate) * h + i] } else { 0.0 });
    let bias_new = cell.biases(call, 1, |_, i| if reset_after { b[5 * h + i] } else { 0.0 });
    let zero = cell.biases(call, 2, |_, _| 0.0);
    let state = cell.state(call, 5)?;
    let (gates, other) = (call.program.value(&[3 * p]), call.program.value(&[3 * p]));
    let (g, o) = (call.program.name(&gates)?, call.program.name(&other)?);
    let new = if reset_after {
        format!("product({r_new}, {bias_new}, h, {o}, {h}, {p}); EACH({p}, {g} + 2 * {p}, hyperbolic_tangent(AT({g} + 2 * {p}) + AT({g} + {p}) * AT({o})));")
    } else {
        format!(
            "EACH({p}, {o}, AT({g} + {p}) * AT(h)); product({r_new}, {bias_new}, {o}, {o} + {p}, {h}, {p}); EACH({p}, {g} + 2 * {p}, hyperbolic_tangent(AT({g} + 2 * {p}) + AT({o} + {p})));"
        )
    };
    let body = format!(
        "product({w}, {bias}, x, {g}, {k}, 3 * {p}); product({r}, {zero}, h, {o}, {h}, 2 * {p}); EACH(2 * {p}, {g}, sigmoid(AT({g}) + AT({o}))); {new} EACH({p}, h, AT({g} + 2 * {p}) + AT({g}) * (AT(h) - AT({g} + 2 * {p})));"
    );
    let all = cell.run(call, &state, &[&gates, &other], &body)?;
    let last = cell.last(call, &state)?;
    Ok(vec![all, last])
}

pub fn lstm(call: &mut Call) -> OperatorResult {
    let cell = Cell::read(call, 4, "Sigmoid Tanh Tanh")?;
    if call.optional(7).is_some() {
        return Err("it has peepholes, which are not supported".to_string());
    }
    if call.int("input_forget", 0) != 0 {
        return Err("its input_forget is not supported".to_string());
    }
    let (h, p, k) = (cell.hidden, cell.padded, cell.inputs);
    let b = cell.bias.clone();
    let (w, r) = (cell.packed(call, &cell.w, k, (0, 4)), cell.packed(call, &cell.r, h, (0, 4)));
    let bias = cell.biases(call, 4, |gate, i| b[gate * h + i] + b[(4 + gate) * h + i]);
    let zero = cell.biases(call, 4, |_, _| 0.0);
    let (state, memory) = (cell.state(call, 5)?, cell.state(call, 6)?);
    let (gates, other) = (call.program.value(&[4 * p]), call.program.value(&[4 * p]));
    let (g, o, c) = (call.program.name(&gates)?, call.program.name(&other)?, call.program.name(&memory)?);
    let body = format!(
        "float *c = {c} + n * {p}; product({w}, {bias}, x, {g}, {k}, 4 * {p}); product({r}, {zero}, h, {o}, {h}, 4 * {p}); EACH(3 * {p}, {g}, sigmoid(AT({g}) + AT({o}))); EACH({p}, {g} + 3 * {p}, hyperbolic_tangent(AT({g} + 3 * {p}) + AT({o} + 3 * {p}))); EACH({p}, c, AT({g} + 2 * {p}) * AT(c) + AT({g}) * AT({g} + 3 * {p})); EACH({p}, h, AT({g} + {p}) * hyperbolic_tangent(AT(c)));"
    );
    let all = cell.run(call, &state, &[&memory, &gates, &other], &body)?;
    let (last, kept) = (cell.last(call, &state)?, cell.last(call, &memory)?);
    Ok(vec![all, last, kept])
}
