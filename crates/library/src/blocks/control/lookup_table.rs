// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// The points are not in ascending order.
const NOT_RISING: u32 = 1;
/// The extrapolation mode is unknown.
const UNKNOWN_ENDS: u32 = 2;
/// The input is beyond the ends.
const BEYOND: u32 = 3;

/// Lookup table: y = y_i + (y_(i+1) - y_i) (u - x_i) / (x_(i+1) - x_i) for u from x_i to x_(i+1), linear between points.
///
/// Range: 2 to 32 points, x ascending; beyond the ends, the end value is held, the last segment is extrapolated, or a fault is raised.
/// Faults: 1 the points x are not in ascending order; 2 ends is not 0 (held), 1 (extrapolated) or 2 (a fault); 3 the input is beyond the
/// ends, or NaN.
#[derive(FunctionBlock)]
pub struct LookupTable {
    /// number of points
    #[size(2, 32)]
    n: u32,
    /// input
    #[input]
    u: f64,
    /// interpolated value
    #[output]
    y: f64,
    /// inputs at the points, ascending
    #[param(default = numbers(), sized, range = "[-inf, inf)")]
    xs: [f64; 32],
    /// values at the points
    #[param(default = numbers(), sized, range = "[-inf, inf)")]
    ys: [f64; 32],
    /// beyond the ends: 0 held, 1 extrapolated, 2 a fault
    #[param(default = 0, range = "[0, 2]")]
    ends: u32,
    /// the input is beyond the ends
    #[condition]
    beyond: Condition,
}

/// Returns 0, 1, 2, ...: the identity table.
fn numbers() -> [f64; 32] {
    std::array::from_fn(|i| i as f64)
}

impl Step for LookupTable {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let n = self.n as usize;
        let (xs, ys) = (&self.xs[..n], &self.ys[..n]);
        if !xs.is_sorted_by(|a, b| a < b) {
            return Outcome::Fault(NOT_RISING);
        }
        let inside = xs[0] <= self.u && self.u <= xs[n - 1];
        let u = match self.ends {
            0 if !self.u.is_nan() => self.u.clamp(xs[0], xs[n - 1]),
            1 if !self.u.is_nan() => self.u,
            2 if inside => self.u,
            0..=2 => return Outcome::Fault(BEYOND),
            _ => return Outcome::Fault(UNKNOWN_ENDS),
        };
        if !inside {
            self.beyond.report();
        }
        let i = xs[1..n - 1].partition_point(|x| *x <= u);
        self.y = ys[i] + (ys[i + 1] - ys[i]) * ((u - xs[i]) / (xs[i + 1] - xs[i]));
        Outcome::Done
    }
}
