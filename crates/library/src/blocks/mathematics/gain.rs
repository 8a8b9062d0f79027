// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Gain: y = k u.
#[derive(FunctionBlock)]
pub struct Gain {
    /// input
    #[input]
    u: f64,
    /// k times the input
    #[output(unit = "=k.u")]
    y: f64,
    /// gain
    #[param(default = 1.0, range = "[-inf, inf)")]
    k: f64,
}

impl Step for Gain {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.k * self.u;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiplies() {
        let mut gain = Gain { u: 3.0, y: 0.0, k: -2.0 };
        assert_eq!(gain.step(&Invocation::default()), Outcome::Done);
        assert_eq!(gain.y, -6.0);
    }
}
