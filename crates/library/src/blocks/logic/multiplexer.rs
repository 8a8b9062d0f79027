// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The index is out of range.
const NO_SUCH_INPUT: u32 = 1;

/// Multiplexer: y = u_index, where the first input has index 0.
///
/// Source: IEC 61131-3, MUX. Range: index 0 to n - 1. Faults: 1 the index is out of range.
#[derive(FunctionBlock)]
pub struct Multiplexer {
    /// number of inputs
    #[size(1, 16)]
    n: u32,
    /// inputs
    #[input(sized)]
    u: [f64; 16],
    /// index of the selected input, from 0
    #[input(asynchronous, default = 0, range = "[0, 15]")]
    index: u32,
    /// selected input
    #[output(unit = "=u")]
    y: f64,
}

impl Step for Multiplexer {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.index >= self.n {
            return Outcome::Fault(NO_SUCH_INPUT);
        }
        self.y = self.u[self.index as usize];
        Outcome::Done
    }
}
