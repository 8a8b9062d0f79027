// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Product: y = u_1 u_2 ... u_n.
#[derive(FunctionBlock)]
pub struct Product {
    /// number of inputs
    #[size(1, 16)]
    n: u32,
    /// inputs
    #[input(sized)]
    u: [f64; 16],
    /// product of the inputs
    #[output]
    y: f64,
}

impl Step for Product {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u[..self.n as usize].iter().product();
        Outcome::Done
    }
}
