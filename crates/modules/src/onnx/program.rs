// SPDX-License-Identifier: Apache-2.0
//! Program of a network: steps in C, constants, and buffers that share one scratch memory.
use super::value::{Content, Kind, Value};
use std::fmt::Write;
use std::rc::Rc;

/// Lanes of the vectors that kernels use: buffers and constants are padded to a multiple of this number.
pub const LANES: usize = 8;
/// Number of steps in one C function.
const STEPS_EACH: usize = 32;
/// Maximum size of the scratch memory of one invocation, which is on the stack of the processor's thread.
const SCRATCH_BYTES_MAX: usize = 256 << 10;
/// Maximum number of constants: larger networks would not fit into a firing, and would take too long to compile.
const CONSTANTS_MAX: usize = 4 << 20;

struct Buffer {
    len: usize,
    kind: Kind,
    first: usize,
    last: usize,
}

/// Steps, in order. `Program::value` creates buffers, and `step` adds the code that fills them.
#[derive(Default)]
pub struct Program {
    buffers: Vec<Buffer>,
    steps: Vec<String>,
    constants: Vec<Rc<[f32]>>,
    tables: Vec<Vec<usize>>,
}

impl Program {
    /// Creates a buffer of floats of this shape.
    pub fn value(&mut self, shape: &[usize]) -> Value {
        self.value_of(Kind::Float, shape)
    }

    /// Creates a buffer with this shape and kind of elements.
    pub fn value_of(&mut self, kind: Kind, shape: &[usize]) -> Value {
        self.buffers.push(Buffer { len: shape.iter().product(), kind, first: usize::MAX, last: 0 });
        Value { shape: shape.to_vec(), content: Content::Buffer(self.buffers.len() - 1) }
    }

    /// Returns the kind of a value's elements. Constant booleans are integers.
    pub fn kind(&self, value: &Value) -> Kind {
        match value.content {
            Content::Buffer(number) => self.buffers[number].kind,
            Content::Floats(_) => Kind::Float,
            Content::Ints(_) => Kind::Whole,
        }
    }

    /// Returns the kind of a computed value; a constant is accepted by every operator that can handle its contents.
    pub fn kind_at_run_time(&self, value: &Value) -> Kind {
        if matches!(value.content, Content::Buffer(_)) { self.kind(value) } else { Kind::Float }
    }

    /// Returns the C name of a value's elements, which are floats in C. Constant integers are converted into a constant of floats.
    pub fn name(&mut self, value: &Value) -> Result<String, String> {
        match &value.content {
            Content::Buffer(number) => Ok(format!("b{number}")),
            Content::Floats(floats) => Ok(self.constant(floats)),
            Content::Ints(ints) => Ok(self.packed(ints.iter().map(|&i| i as f32).collect())),
        }
    }

    fn constant(&mut self, floats: &Rc<[f32]>) -> String {
        let known = self.constants.iter().position(|known| Rc::ptr_eq(known, floats));
        let number = known.unwrap_or_else(|| {
            self.constants.push(floats.clone());
            self.constants.len() - 1
        });
        format!("c{number}")
    }

    /// Adds constants that are not a tensor of the file, such as packed weights; returns their name.
    pub fn packed(&mut self, floats: Vec<f32>) -> String {
        self.constant(&floats.into())
    }

    /// Adds a table of indices; returns its name.
    pub fn table(&mut self, indices: Vec<usize>) -> String {
        self.tables.push(indices);
        format!("t{}", self.tables.len() - 1)
    }

    /// Appends a step in C that reads and writes these values.
    pub fn step(&mut self, values: &[&Value], text: String) {
        let at = self.steps.len();
        for value in values {
            if let Content::Buffer(number) = value.content {
                let buffer = &mut self.buffers[number];
                buffer.first = buffer.first.min(at);
                buffer.last = buffer.last.max(at);
            }
        }
        self.steps.push(text);
    }

    /// Returns the offset of each buffer in the scratch memory, and the size of that memory: each buffer is placed in the first gap among
    /// the buffers that are alive at the same time.
    fn placed(&self) -> Result<(Vec<usize>, usize), String> {
        let mut offsets: Vec<usize> = Vec::new();
        let mut size = 0;
        for (i, buffer) in self.buffers.iter().enumerate() {
            let padded = |len: usize| len.div_ceil(LANES) * LANES;
            let mut taken: Vec<(usize, usize)> = (0..i)
                .filter(|&j| self.buffers[j].first <= buffer.last && buffer.first <= self.buffers[j].last)
                .map(|j| (offsets[j], offsets[j] + padded(self.buffers[j].len)))
                .collect();
            taken.sort_unstable();
            let mut at = 0;
            for (start, end) in taken {
                if at + padded(buffer.len) <= start {
                    break;
                }
                at = at.max(end);
            }
            offsets.push(at);
            size = size.max(at + padded(buffer.len));
        }
        if size * 4 > SCRATCH_BYTES_MAX {
            return Err(format!(
                "it needs {} kB of scratch memory, but at most {} kB are possible: run a network of this size in a process",
                size * 4 / 1024,
                SCRATCH_BYTES_MAX / 1024
            ));
        }
        Ok((offsets, size.max(LANES)))
    }

    /// Returns the C code of constants and tables.
    ///
    /// # Errors
    /// Fails if there are too many weights.
    pub fn constants(&self) -> Result<String, String> {
        let all: usize = self.constants.iter().map(|floats| floats.len()).sum();
        if all > CONSTANTS_MAX {
            return Err(format!("it has {all} weights, but at most {CONSTANTS_MAX} are possible in a firing: run a network of this size in a process"));
        }
        let mut text = String::new();
        for (i, floats) in self.constants.iter().enumerate() {
            let _ = write!(text, "static const float c{i}[{}] __attribute__((aligned(64))) = {{", floats.len().max(1).div_ceil(LANES) * LANES);
            floats.iter().for_each(|x| literal(&mut text, *x));
            text.push_str(if floats.is_empty() { "0};\n" } else { "};\n" });
        }
        for (i, table) in self.tables.iter().enumerate() {
            let _ = write!(text, "static const uint32_t t{i}[{}] = {{", table.len().max(1));
            for index in table {
                let _ = write!(text, "{index},");
            }
            text.push_str(if table.is_empty() { "0};\n" } else { "};\n" });
        }
        Ok(text)
    }

    /// Returns the C code of the function `network`. Its steps are split into functions of `STEPS_EACH`, because compilation time more
    /// than doubles when the length of a function doubles.
    ///
    /// # Errors
    /// Fails if it needs too much scratch memory.
    pub fn function(&self, parameters: &str, arguments: &str) -> Result<String, String> {
        let (offsets, size) = self.placed()?;
        let mut text = String::new();
        for (part, steps) in self.steps.chunks(STEPS_EACH).enumerate() {
            let _ = writeln!(text, "TARGET void PART({part})({parameters}, float *scratch) {{");
            for (i, (buffer, at)) in self.buffers.iter().zip(&offsets).enumerate() {
                if buffer.first < (part + 1) * STEPS_EACH && buffer.last >= part * STEPS_EACH {
                    let _ = writeln!(text, "    float *const b{i} = scratch + {at};");
                }
            }
            for step in steps {
                let _ = writeln!(text, "    {step}");
            }
            text.push_str("}\n");
        }
        let _ = writeln!(text, "TARGET void network({parameters}) {{\n    float scratch[{size}] __attribute__((aligned(64))) = {{0}};");
        for part in 0..self.steps.len().div_ceil(STEPS_EACH) {
            let _ = writeln!(text, "    PART({part})({arguments}, scratch);");
        }
        text.push_str("}\n");
        Ok(text)
    }
}

fn literal(text: &mut String, x: f32) {
    let _ = match x {
        _ if x == f32::INFINITY => write!(text, "__builtin_inff(),"),
        _ if x == f32::NEG_INFINITY => write!(text, "-__builtin_inff(),"),
        _ => write!(text, "{x:e}f,"),
    };
}
