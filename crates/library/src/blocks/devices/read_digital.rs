// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Reads a digital device channel: y = channel.
#[derive(FunctionBlock)]
pub struct ReadDigital {
    /// channel of a physical device
    #[device(read)]
    channel: bool,
    /// reading at the start of the firing
    #[output]
    y: bool,
}

impl Step for ReadDigital {
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
        let mut block = ReadDigital { channel: true, y: false };
        assert_eq!(block.step(&Invocation::default()), Outcome::Done);
        assert!(block.y);
    }
}
