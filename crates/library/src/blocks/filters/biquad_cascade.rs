// SPDX-License-Identifier: Apache-2.0
use crate::section::Section;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// A pole of a section lies on or outside the unit circle.
const UNSTABLE: u32 = 1;
/// A row is not normalised.
const NOT_NORMALISED: u32 = 2;

/// Cascade of second-order sections: Y(z) = H_1(z) ... H_n(z) U(z), each row b0, b1, b2, 1, a1, a2.
///
/// A filter of any order up to 16, given by the rows that a design program outputs ("sos"). Source: Oppenheim and Schafer, Discrete-Time
/// Signal Processing, 6.4. Faults: 1 a section is not stable: |a2| must be below 1 and |a1| below 1 + a2; 2 the fourth number of a row is
/// not 1.
#[derive(FunctionBlock)]
pub struct BiquadCascade {
    /// number of sections
    #[size(1, 8)]
    n: u32,
    /// raw signal
    #[input]
    u: f64,
    /// filtered signal
    #[output]
    y: f64,
    /// one row for each section: b0, b1, b2, 1, a1, a2
    #[param(default = [[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]; 8], sized, range = "[-inf, inf)")]
    sections: [[f64; 6]; 8],
    /// filter state of each section
    #[state]
    memory: [[f64; 2]; 8],
}

impl Step for BiquadCascade {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let mut y = self.u;
        for (row, memory) in self.sections.iter().zip(&mut self.memory).take(self.n as usize) {
            let [b0, b1, b2, a0, a1, a2] = *row;
            let section = Section { b0, b1, b2, a1, a2 };
            if a0 != 1.0 {
                return Outcome::Fault(NOT_NORMALISED);
            }
            if !section.stable() {
                return Outcome::Fault(UNSTABLE);
            }
            y = section.step(y, memory);
        }
        self.y = y;
        Outcome::Done
    }
}
