// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// First-order low-pass filter: y += alpha (u - y).
#[derive(FunctionBlock)]
pub struct Lowpass {
    /// raw signal
    #[input]
    u: f64,
    /// filtered signal
    #[output(unit = "=u")]
    y: f64,
    /// smoothing factor, 0 to 1
    #[param(default = 0.1, range = "[0, 1]")]
    alpha: f64,
}

impl Step for Lowpass {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y += self.alpha * (self.u - self.y);
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_step_response_is_one_minus_a_power() {
        let mut filter = Lowpass { u: 2.0, y: 0.0, alpha: 0.25 };
        for k in 1..=20 {
            assert_eq!(filter.step(&Invocation::default()), Outcome::Done);
            assert!((filter.y - 2.0 * (1.0 - 0.75f64.powi(k))).abs() < 1e-12);
        }
    }
}
