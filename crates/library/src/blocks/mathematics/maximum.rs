// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Maximum: y = max(u_1, ..., u_n).
#[derive(FunctionBlock)]
pub struct Maximum {
    /// number of inputs
    #[size(1, 16)]
    n: u32,
    /// inputs
    #[input(sized)]
    u: [f64; 16],
    /// maximum of the inputs
    #[output(unit = "=u")]
    y: f64,
}

impl Step for Maximum {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let n = self.n as usize;
        // NaN propagates so that it is detected.
        self.y = self.u[1..n].iter().fold(self.u[0], |y, u| if !y.is_nan() && (*u > y || u.is_nan()) { *u } else { y });
        Outcome::Done
    }
}
