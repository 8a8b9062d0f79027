// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Offset: y = u + offset.
#[derive(FunctionBlock)]
pub struct Offset {
    /// input
    #[input]
    u: f64,
    /// value to add
    #[input(asynchronous, default = 0.0, unit = "=u", range = "[-inf, inf)")]
    offset: f64,
    /// input plus offset
    #[output(unit = "=u")]
    y: f64,
}

impl Step for Offset {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u + self.offset;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_adds() {
        let mut block = Offset { u: 0.5, offset: -2.0, y: 0.0 };
        assert_eq!(block.step(&Invocation::default()), Outcome::Done);
        assert_eq!(block.y, -1.5);
    }
}
