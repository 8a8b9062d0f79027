// SPDX-License-Identifier: Apache-2.0
use crate::section::Section;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// A pole lies on or outside the unit circle.
const UNSTABLE: u32 = 1;

/// Second-order section: y_k = b0 u_k + b1 u_(k-1) + b2 u_(k-2) - a1 y_(k-1) - a2 y_(k-2).
///
/// Any second-order digital filter, given by its coefficients (a0 = 1) as a design program outputs them; transposed direct form II. For a
/// design by frequency and quality factor, see `second_order`; for several sections in series, `biquad_cascade`. Source: Oppenheim and
/// Schafer, Discrete-Time Signal Processing, 6.3. Range: the poles inside the unit circle, |a2| < 1 and |a1| < 1 + a2. Faults: 1 the
/// filter is not stable: |a2| must be below 1 and |a1| below 1 + a2.
#[derive(FunctionBlock)]
pub struct Biquad {
    /// raw signal
    #[input]
    u: f64,
    /// filtered signal
    #[output]
    y: f64,
    /// coefficient of u_k
    #[param(default = 1.0, range = "[-inf, inf)")]
    b0: f64,
    /// coefficient of u_(k-1)
    #[param(default = 0.0, range = "[-inf, inf)")]
    b1: f64,
    /// coefficient of u_(k-2)
    #[param(default = 0.0, range = "[-inf, inf)")]
    b2: f64,
    /// coefficient of y_(k-1)
    #[param(default = 0.0, range = "[-2, 2]")]
    a1: f64,
    /// coefficient of y_(k-2)
    #[param(default = 0.0, range = "[-1, 1]")]
    a2: f64,
    /// filter state
    #[state]
    memory: [f64; 2],
}

impl Step for Biquad {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let section = Section { b0: self.b0, b1: self.b1, b2: self.b2, a1: self.a1, a2: self.a2 };
        if !section.stable() {
            return Outcome::Fault(UNSTABLE);
        }
        self.y = section.step(self.u, &mut self.memory);
        Outcome::Done
    }
}
