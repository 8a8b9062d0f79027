// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// a_0 is 0.
const NO_LEADING: u32 = 1;

/// Discrete transfer function: a_0 y_k = b_0 u_k + ... + b_(n-1) u_(k-n+1) - a_1 y_(k-1) - ... - a_(n-1) y_(k-n+1).
///
/// The numerator b and the denominator a are in ascending powers of 1/z, both with n coefficients (pad the shorter one with zeros); a =
/// 1, 0, ... gives a finite impulse response. Transposed direct form II; above order 4, a `biquad_cascade` has smaller rounding errors.
/// Source: Oppenheim and Schafer, Discrete-Time Signal Processing, 6.3. Range: a_0 not 0; the poles are not checked to be inside the unit
/// circle. Faults: 1 the first coefficient of the denominator is 0.
#[derive(FunctionBlock)]
pub struct TransferFunction {
    /// number of coefficients: the order plus one
    #[size(1, 16)]
    n: u32,
    /// input
    #[input]
    u: f64,
    /// output
    #[output]
    y: f64,
    /// numerator
    #[param(default = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], sized, range = "[-inf, inf)")]
    b: [f64; 16],
    /// denominator
    #[param(default = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], sized, range = "[-inf, inf)")]
    a: [f64; 16],
    /// filter state
    #[state]
    memory: [f64; 16],
}

impl Step for TransferFunction {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let n = self.n as usize;
        let leading = self.a[0];
        if leading == 0.0 {
            return Outcome::Fault(NO_LEADING);
        }
        self.y = (self.b[0] * self.u) / leading + self.memory[0];
        for i in 1..n {
            let next = if i + 1 < n { self.memory[i] } else { 0.0 };
            self.memory[i - 1] = (self.b[i] * self.u - self.a[i] * self.y) / leading + next;
        }
        Outcome::Done
    }
}
