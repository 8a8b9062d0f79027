// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Reads a device channel of three numbers, such as a force: y = channel.
#[derive(FunctionBlock)]
pub struct ReadVector {
    /// channel of a physical device
    #[device(read)]
    channel: [f64; 3],
    /// reading at the start of the firing
    #[output(unit = "=channel")]
    y: [f64; 3],
}

impl Step for ReadVector {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.channel;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies() {
        let mut block = ReadVector { channel: [1.5, 0.0, -1.0], y: [0.0; 3] };
        assert_eq!(block.step(&Invocation::default()), Outcome::Done);
        assert_eq!(block.y, [1.5, 0.0, -1.0]);
    }
}
