// SPDX-License-Identifier: Apache-2.0
use crate::window::{WINDOW_MAX, Window};
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The window is too long.
const BAD_WINDOW: u32 = 1;
/// The input is not finite.
const NOT_FINITE: u32 = 2;

/// Statistics of the last w values: mean = Σu / w, variance = Σ(u - mean)^2 / (w - 1), rms = √(Σu^2 / w), minimum, maximum.
///
/// Until there are w values, the statistics are those of all values so far; the variance of a single value is 0. For statistics since the
/// start, see `running_statistics`. Range: window 1 to 256. Faults: 1 the window is not 1 to 256 invocations; 2 the input is not finite.
#[derive(FunctionBlock)]
pub struct Statistics {
    /// signal
    #[input]
    u: f64,
    /// mean value
    #[output]
    mean: f64,
    /// sample variance
    #[output]
    variance: f64,
    /// root mean square
    #[output]
    rms: f64,
    /// minimum value
    #[output]
    least: f64,
    /// maximum value
    #[output]
    greatest: f64,
    /// length w of the window in invocations, 1 to 256
    #[param(default = 100, range = "[1, 256]")]
    window: u32,
    /// most recent values
    #[state(opaque)]
    past: Window,
}

impl Step for Statistics {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let window = self.window as usize;
        if window == 0 || window > WINDOW_MAX {
            return Outcome::Fault(BAD_WINDOW);
        }
        if !self.u.is_finite() {
            return Outcome::Fault(NOT_FINITE);
        }
        self.past.push(self.u);
        let last = || self.past.last(window);
        let count = last().len() as f64;
        let mean = last().sum::<f64>() / count;
        // In two passes: the difference of two large sums would lose significant digits.
        self.variance = last().map(|u| (u - mean) * (u - mean)).sum::<f64>() / (count - 1.0).max(1.0);
        self.rms = (last().map(|u| u * u).sum::<f64>() / count).sqrt();
        self.least = last().fold(f64::INFINITY, f64::min);
        self.greatest = last().fold(f64::NEG_INFINITY, f64::max);
        self.mean = mean;
        Outcome::Done
    }
}
