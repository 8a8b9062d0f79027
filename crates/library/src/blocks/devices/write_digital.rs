// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Writes a digital device channel: channel = u, and y = u for further use.
#[derive(FunctionBlock)]
pub struct WriteDigital {
    /// value to write at the end of the firing
    #[input(asynchronous)]
    u: bool,
    /// written value
    #[output]
    y: bool,
    /// channel of a physical device
    #[device(write)]
    channel: bool,
}

impl Step for WriteDigital {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.channel = self.u;
        self.y = self.u;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies() {
        let mut block = WriteDigital { u: true, y: false, channel: false };
        assert_eq!(block.step(&Invocation::default()), Outcome::Done);
        assert!(block.channel && block.y);
    }
}
