// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Selector: y = b if select is true, else a.
///
/// Source: IEC 61131-3, SEL. For more than two inputs, see `multiplexer`.
#[derive(FunctionBlock)]
pub struct Selector {
    /// true: select the second input
    #[input(asynchronous)]
    select: bool,
    /// first input
    #[input]
    a: f64,
    /// second input
    #[input(unit = "=a")]
    b: f64,
    /// selected input
    #[output(unit = "=a")]
    y: f64,
}

impl Step for Selector {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = if self.select { self.b } else { self.a };
        Outcome::Done
    }
}
