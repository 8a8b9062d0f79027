// SPDX-License-Identifier: Apache-2.0
use crate::window::Window;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

const MEDIAN_MAX: usize = 31;

/// The window is empty or too long.
const BAD_WINDOW: u32 = 1;
/// The input is not finite.
const NOT_FINITE: u32 = 2;

/// Median filter: y = median of the last w values, or of all values so far if there are fewer; for an even number of values, the mean of
/// the middle two.
///
/// Removes single outliers without rounding the edges of a signal. Source: Tukey, Exploratory Data Analysis, 7. Range: window 1 to 31,
/// usually odd; the delay is half the window. Faults: 1 the window is not 1 to 31 invocations; 2 the input is not finite.
#[derive(FunctionBlock)]
pub struct Median {
    /// raw signal
    #[input]
    u: f64,
    /// median of the most recent values
    #[output(unit = "=u")]
    y: f64,
    /// length w of the window in invocations, 1 to 31
    #[param(default = 5, range = "[1, 31]")]
    window: u32,
    /// most recent values
    #[state(opaque)]
    past: Window,
}

impl Step for Median {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let window = self.window as usize;
        if window == 0 || window > MEDIAN_MAX {
            return Outcome::Fault(BAD_WINDOW);
        }
        if !self.u.is_finite() {
            // Sorting would place it at an end, where it would go unnoticed.
            return Outcome::Fault(NOT_FINITE);
        }
        self.past.push(self.u);
        let mut sorted = [0.0; MEDIAN_MAX];
        let last = self.past.last(window);
        let count = last.len();
        for (slot, value) in sorted.iter_mut().zip(last) {
            *slot = value;
        }
        let sorted = &mut sorted[..count];
        sorted.sort_unstable_by(f64::total_cmp);
        let middle = count / 2;
        self.y = if count % 2 == 1 { sorted[middle] } else { 0.5 * (sorted[middle - 1] + sorted[middle]) };
        Outcome::Done
    }
}
