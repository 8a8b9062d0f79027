// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Flag: y = value, so that a command list can set a `bool` by executing the block, for example the input `holding` of a generator.
///
/// The output is false after each start, until the block is first executed.
#[derive(FunctionBlock)]
pub struct Flag {
    /// the flag
    #[output(asynchronous)]
    y: bool,
    /// value to which the flag is set
    #[param(default = true)]
    value: bool,
}

impl Step for Flag {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.value;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_set() {
        let mut block = Flag { y: false, value: true };
        assert_eq!((block.step(&Invocation::default()), block.y), (Outcome::Done, true));
    }
}
