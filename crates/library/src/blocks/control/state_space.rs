// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// A state or input is not finite.
const NOT_FINITE: u32 = 1;

/// State space: y_k = c x_k + d u_k, x_(k+1) = a x_k + b u_k + e w_k, a discrete model with up to 8 states.
///
/// A plant model, a compensator or, with w as the measurement, an observer: a = A - L C, b = B, e = L. The rows of `a` have 8 numbers, of
/// which only the first n are used: `library.padded(A)` pads them. x is the state before the input of this invocation takes effect.
/// Source: Franklin, Powell and Workman, Digital Control of Dynamic Systems, 4.3; discretise with `scipy.signal.cont2discrete`. Stability
/// is not checked. Faults: 1 a state for the next invocation is not finite: an input is not finite, or the system is unstable.
#[derive(FunctionBlock)]
pub struct StateSpace {
    /// number of states
    #[size(1, 8)]
    n: u32,
    /// input
    #[input]
    u: f64,
    /// second input: the measurement of an observer
    #[input(default = 0.0, range = "[-inf, inf)")]
    w: f64,
    /// output
    #[output]
    y: f64,
    /// states
    #[output(sized)]
    x: [f64; 8],
    /// weight of each state (first n columns) in the next value of each state (row)
    #[param(default = [[0.0; 8]; 8], sized, range = "[-inf, inf)")]
    a: [[f64; 8]; 8],
    /// weight of the input in the next value of each state
    #[param(default = [0.0; 8], sized, range = "[-inf, inf)")]
    b: [f64; 8],
    /// weight of each state in the output
    #[param(default = [0.0; 8], sized, range = "[-inf, inf)")]
    c: [f64; 8],
    /// weight of the input in the output
    #[param(default = 0.0, range = "[-inf, inf)")]
    d: f64,
    /// weight of the second input in the next value of each state
    #[param(default = [0.0; 8], sized, range = "[-inf, inf)")]
    e: [f64; 8],
    /// initial states
    #[param(default = [0.0; 8], sized, range = "[-inf, inf)")]
    initial: [f64; 8],
    /// states for the next invocation
    #[state]
    next: [f64; 8],
    /// true after the first invocation
    #[state]
    begun: bool,
}

impl Step for StateSpace {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let n = self.n as usize;
        self.x = if self.begun { self.next } else { self.initial };
        self.begun = true;
        let x = &self.x[..n];
        let product = |row: &[f64]| row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        self.y = product(&self.c[..n]) + self.d * self.u;
        for i in 0..n {
            self.next[i] = product(&self.a[i][..n]) + self.b[i] * self.u + self.e[i] * self.w;
            if !self.next[i].is_finite() {
                return Outcome::Fault(NOT_FINITE);
            }
        }
        Outcome::Done
    }
}
