// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The limit is negative.
const BAD_LIMIT: u32 = 1;

/// State feedback: effort = reference_gain r - k_1 x_1 - ... - k_n x_n within ± limit.
///
/// The gains come from pole placement or a linear-quadratic design. Source: Franklin, Powell and Workman, Digital Control of Dynamic
/// Systems, 8.1. Range: limit from 0. Faults: 1 the limit is negative or NaN.
#[derive(FunctionBlock)]
pub struct StateFeedback {
    /// number of states
    #[size(1, 16)]
    n: u32,
    /// states
    #[input(sized)]
    x: [f64; 16],
    /// reference r
    #[input(asynchronous, default = 0.0, range = "[-inf, inf)")]
    reference: f64,
    /// effort applied to the plant
    #[output]
    effort: f64,
    /// gain of each state
    #[param(default = [0.0; 16], sized, range = "[-inf, inf)")]
    k: [f64; 16],
    /// gain of the reference
    #[param(default = 1.0, range = "[-inf, inf)")]
    reference_gain: f64,
    /// maximum magnitude of the effort
    #[param(default = 1e6, range = "[0, inf)")]
    limit: f64,
}

impl Step for StateFeedback {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.limit.is_nan() || self.limit < 0.0 {
            return Outcome::Fault(BAD_LIMIT);
        }
        let n = self.n as usize;
        let wanted = self.reference_gain * self.reference - self.k[..n].iter().zip(&self.x[..n]).map(|(k, x)| k * x).sum::<f64>();
        self.effort = if wanted.is_nan() { wanted } else { wanted.clamp(-self.limit, self.limit) };
        Outcome::Done
    }
}
