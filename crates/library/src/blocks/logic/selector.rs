// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Selector: y = b where select is true, else a.
///
/// Source: IEC 61131-3, SEL. From more than two: `multiplexer`.
#[derive(FunctionBlock)]
pub struct Selector {
    /// true: the second input is taken
    #[input(asynchronous)]
    select: bool,
    /// first input
    #[input]
    a: f64,
    /// second input
    #[input(unit = "=a")]
    b: f64,
    /// the one that is selected
    #[output(unit = "=a")]
    y: f64,
}

impl Step for Selector {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = if self.select { self.b } else { self.a };
        Outcome::Done
    }
}
