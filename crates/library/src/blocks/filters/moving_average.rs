// SPDX-License-Identifier: Apache-2.0
use crate::window::{WINDOW_MAX, Window};
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The window is empty or too long.
const BAD_WINDOW: u32 = 1;

/// Moving average: y_k = (u_k + ... + u_(k-w+1)) / w over the last w invocations, or over all so far if there are fewer.
///
/// The sum is recomputed each time, so rounding errors do not accumulate. A window equal to the period of a disturbance removes that
/// disturbance. Range: window 1 to 256. Faults: 1 the window is not 1 to 256 invocations.
#[derive(FunctionBlock)]
pub struct MovingAverage {
    /// raw signal
    #[input]
    u: f64,
    /// mean of the most recent values
    #[output(unit = "=u")]
    y: f64,
    /// length w of the window in invocations, 1 to 256
    #[param(default = 10, range = "[1, 256]")]
    window: u32,
    /// most recent values
    #[state(opaque)]
    past: Window,
}

impl Step for MovingAverage {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let window = self.window as usize;
        if window == 0 || window > WINDOW_MAX {
            return Outcome::Fault(BAD_WINDOW);
        }
        self.past.push(self.u);
        let last = self.past.last(window);
        let count = last.len() as f64;
        self.y = last.sum::<f64>() / count;
        Outcome::Done
    }
}
