// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::TAU;

/// The distribution is unknown.
const UNKNOWN_DISTRIBUTION: u32 = 1;
/// The deviation is negative.
const BAD_DEVIATION: u32 = 2;

/// Noise: y = mean + deviation w, w white, with mean 0 and variance 1, normal or uniform.
///
/// The same seed gives the same numbers on every machine: a test signal, unsuitable for cryptography. The generator is SplitMix64
/// (Steele, Lea and Flood, 2014), the normal distribution by Box and Muller, 1958. Range: deviation from 0. Faults: 1 there is no such
/// distribution: 0 normal, 1 uniform; 2 the deviation is negative or NaN.
#[derive(FunctionBlock)]
pub struct Noise {
    /// signal
    #[output]
    y: f64,
    /// 0 normal, 1 uniform
    #[param(default = 0, range = "[0, 1]")]
    distribution: u32,
    /// mean value
    #[param(default = 0.0, range = "[-inf, inf)")]
    mean: f64,
    /// standard deviation
    #[param(default = 1.0, range = "[0, inf)")]
    deviation: f64,
    /// seed of the sequence of numbers
    #[param(default = 1, range = "[0, inf)")]
    seed: u64,
    /// number of values drawn
    #[state]
    drawn: u64,
}

impl Noise {
    /// Returns the next number above 0, at most 1.
    fn draw(&mut self) -> f64 {
        self.drawn = self.drawn.wrapping_add(1);
        let mut z = self.seed.wrapping_add(self.drawn.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        ((z >> 11) + 1) as f64 / (1u64 << 53) as f64
    }
}

impl Step for Noise {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if self.deviation.is_nan() || self.deviation < 0.0 {
            return Outcome::Fault(BAD_DEVIATION);
        }
        let white = match self.distribution {
            0 => {
                let radius = (-2.0 * self.draw().ln()).sqrt();
                radius * (TAU * self.draw()).cos()
            }
            1 => 3f64.sqrt() * (2.0 * self.draw() - 1.0),
            _ => return Outcome::Fault(UNKNOWN_DISTRIBUTION),
        };
        self.y = self.mean + self.deviation * white;
        Outcome::Done
    }
}
