// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The value to write is not a finite number.
const NOT_FINITE: u32 = 1;

/// Writes a device channel: channel = u; fault 1 if u is not finite, so that no device ever receives such a number.
#[derive(FunctionBlock)]
pub struct WriteChannel {
    /// value to write at the end of the firing
    #[input(unit = "=channel")]
    u: f64,
    /// channel of a physical device
    #[device(write)]
    channel: f64,
}

impl Step for WriteChannel {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if !self.u.is_finite() {
            return Outcome::Fault(NOT_FINITE);
        }
        self.channel = self.u;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_finite_numbers_only() {
        let mut block = WriteChannel { u: 1.5, channel: 0.0 };
        assert_eq!(block.step(&Invocation::default()), Outcome::Done);
        assert_eq!(block.channel, 1.5);
        block.u = f64::NAN;
        assert_eq!(block.step(&Invocation::default()), Outcome::Fault(NOT_FINITE));
        assert_eq!(block.channel, 1.5);
    }
}
