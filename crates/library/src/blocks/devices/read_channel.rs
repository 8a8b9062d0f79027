// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Reads a device channel: y = channel.
#[derive(FunctionBlock)]
pub struct ReadChannel {
    /// channel of a physical device
    #[device(read)]
    channel: f64,
    /// reading at the start of the firing
    #[output(unit = "=channel")]
    y: f64,
}

impl Step for ReadChannel {
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
        let mut block = ReadChannel { channel: 1.5, y: 0.0 };
        assert_eq!(block.step(&Invocation::default()), Outcome::Done);
        assert_eq!(block.y, 1.5);
    }
}
