// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Sets a digital value: y = value.
#[derive(FunctionBlock)]
pub struct SetDigital {
    /// value that is set
    #[output]
    y: bool,
    /// value to set
    #[param(default = true)]
    value: bool,
}

impl Step for SetDigital {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.value;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets() {
        let mut block = SetDigital { y: false, value: true };
        assert_eq!(block.step(&Invocation::default()), Outcome::Done);
        assert!(block.y);
    }
}
