// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// Weighted sum: y = w_1 u_1 + ... + w_n u_n.
#[derive(FunctionBlock)]
pub struct Sum {
    /// number of inputs
    #[size(1, 16)]
    n: u32,
    /// inputs
    #[input(sized)]
    u: [f64; 16],
    /// weighted sum of the inputs
    #[output(unit = "=w.u")]
    y: f64,
    /// weights: 1 to add, -1 to subtract
    #[param(default = [1.0; 16], sized, range = "[-inf, inf)")]
    w: [f64; 16],
}

impl Step for Sum {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let n = self.n as usize;
        self.y = self.u[..n].iter().zip(&self.w[..n]).map(|(u, w)| w * u).sum();
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adds_the_first_n_only() {
        let mut u = [100.0; 16];
        (u[0], u[1]) = (5.0, 3.0);
        let mut w = [1.0; 16];
        w[1] = -1.0;
        let mut sum = Sum { n: 2, u, y: 0.0, w };
        assert_eq!(sum.step(&Invocation::default()), Outcome::Done);
        assert_eq!(sum.y, 2.0);
    }
}
