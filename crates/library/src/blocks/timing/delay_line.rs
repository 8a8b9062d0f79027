// SPDX-License-Identifier: Apache-2.0
use crate::window::{WINDOW_MAX, Window};
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// The delay is too long.
const TOO_LONG: u32 = 1;

/// Delay line: y_k = u_(k-d), the input d invocations ago; `initial` until such a value exists.
///
/// Models a transport delay. It can also break an algebraic loop, if `initial` is the value of the plant at rest. Range: delay 0 to 255.
/// Faults: 1 the delay is not between 0 and 255 invocations.
#[derive(FunctionBlock)]
pub struct DelayLine {
    /// input
    #[input]
    u: f64,
    /// input d invocations ago
    #[output(unit = "=u")]
    y: f64,
    /// delay d in invocations, 0 to 255
    #[param(default = 1, range = "[0, 255]")]
    delay: u32,
    /// output until the first delayed value is available
    #[param(default = 0.0, range = "[-inf, inf)")]
    initial: f64,
    /// most recent values
    #[state(opaque)]
    past: Window,
}

impl Step for DelayLine {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let delay = self.delay as usize;
        if delay >= WINDOW_MAX {
            return Outcome::Fault(TOO_LONG);
        }
        if !self.u.is_finite() {
            // It would otherwise cause a fault `delay` invocations later, when its cause can no longer be found.
            self.y = self.u;
            return Outcome::Done;
        }
        self.past.push(self.u);
        self.y = self.past.before(delay).unwrap_or(self.initial);
        Outcome::Done
    }
}
