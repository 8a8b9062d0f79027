// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Logical or: y = u_1 or ... or u_n.
///
/// True if any input is true.
#[derive(FunctionBlock)]
pub struct LogicOr {
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

impl Step for LogicOr {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u.iter().take(self.n as usize).any(|u| *u);
        Outcome::Done
    }
}
