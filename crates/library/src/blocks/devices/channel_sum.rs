// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Channel sum: y = channel + u, the value of a device plus a term that the device does not include.
///
/// An example is the effort that holds an arm, as reported by its plant or drive, plus the effort that holds its payload.
#[derive(FunctionBlock)]
pub struct ChannelSum {
    /// channel of the device
    #[device(read)]
    channel: f64,
    /// value to add
    #[input(asynchronous, default = 0.0, unit = "=channel", range = "[-inf, inf)")]
    u: f64,
    /// sum
    #[output(unit = "=channel")]
    y: f64,
}

impl Step for ChannelSum {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.channel + self.u;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_adds() {
        let mut block = ChannelSum { channel: 2.0, u: 0.5, y: 0.0 };
        assert_eq!((block.step(&Invocation::default()), block.y), (Outcome::Done, 2.5));
    }
}
