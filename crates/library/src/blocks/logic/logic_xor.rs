// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Exclusive or: y = u_1 xor ... xor u_n.
///
/// True if an odd number of inputs is true.
#[derive(FunctionBlock)]
pub struct LogicXor {
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

impl Step for LogicXor {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u.iter().take(self.n as usize).fold(false, |y, u| y ^ u);
        Outcome::Done
    }
}
