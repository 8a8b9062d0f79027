// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Logical and: y = u_1 and ... and u_n.
///
/// True if every input is true.
#[derive(FunctionBlock)]
pub struct LogicAnd {
    /// number of inputs
    #[size(1, 16)]
    n: u32,
    /// inputs
    #[input(sized)]
    u: [bool; 16],
    /// result
    #[output]
    y: bool,
}

impl Step for LogicAnd {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u.iter().take(self.n as usize).all(|u| *u);
        Outcome::Done
    }
}
