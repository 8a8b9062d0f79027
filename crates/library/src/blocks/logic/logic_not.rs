// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Logical not: y = not u.
#[derive(FunctionBlock)]
pub struct LogicNot {
    /// input
    #[input]
    u: bool,
    /// negated input
    #[output]
    y: bool,
}

impl Step for LogicNot {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = !self.u;
        Outcome::Done
    }
}
