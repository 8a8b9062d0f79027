// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The input is not finite.
const NOT_FINITE: u32 = 1;

/// Statistics since the start or the last reset: mean += (u - mean) / k, variance = m / (k - 1) with m += (u - mean_before) (u - mean).
///
/// The values are not stored. Source: Welford, 1962. For statistics over a window, see `statistics`. After a reset, the current value
/// counts as the first. Faults: 1 the input is not finite.
#[derive(FunctionBlock)]
pub struct RunningStatistics {
    /// signal
    #[input]
    u: f64,
    /// true: restart with the current value
    #[input(asynchronous, default = false)]
    reset: bool,
    /// number of values k
    #[output]
    count: u64,
    /// mean value
    #[output]
    mean: f64,
    /// sample variance; 0 for a single value
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
    /// sum m of the squared deviations
    #[state]
    squares: f64,
}

impl Step for RunningStatistics {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if !self.u.is_finite() {
            return Outcome::Fault(NOT_FINITE);
        }
        if self.reset || self.count == 0 {
            (self.count, self.mean, self.squares) = (0, 0.0, 0.0);
            (self.least, self.greatest) = (self.u, self.u);
        }
        self.count += 1;
        let (count, before) = (self.count as f64, self.mean);
        self.mean += (self.u - before) / count;
        self.squares += (self.u - before) * (self.u - self.mean);
        self.variance = self.squares / (count - 1.0).max(1.0);
        self.rms = (self.squares / count + self.mean * self.mean).sqrt();
        self.least = self.least.min(self.u);
        self.greatest = self.greatest.max(self.u);
        Outcome::Done
    }
}
