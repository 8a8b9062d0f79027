// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// The time is negative.
const NEGATIVE_TIME: u32 = 1;

/// On-delay timer: q = true once u has been true for the delay; elapsed = time for which u has been true, at most the delay.
///
/// Time is running time, which stops while the verb is suspended. Source: IEC 61131-3, TON. Range: delay from 0. Faults: 1 the delay is
/// negative or NaN.
#[derive(FunctionBlock)]
pub struct OnDelay {
    /// input (IN)
    #[input]
    u: bool,
    /// input with its rising edge delayed (Q)
    #[output]
    q: bool,
    /// time since the input went on (ET)
    #[output(unit = "s")]
    elapsed: f64,
    /// duration of the delay (PT)
    #[param(default = 1.0, unit = "s", range = "[0, inf)")]
    delay: f64,
    /// the delay has elapsed
    #[condition]
    done: Condition,
    /// running time at which the input turned on, ns; -1: the input is off
    #[state(initial = -1)]
    begun_ns: i64,
}

impl Step for OnDelay {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.delay.is_nan() || self.delay < 0.0 {
            return Outcome::Fault(NEGATIVE_TIME);
        }
        if !self.u {
            (self.begun_ns, self.q, self.elapsed) = (-1, false, 0.0);
            return Outcome::Done;
        }
        if self.begun_ns < 0 {
            self.begun_ns = invocation.time_ns;
        }
        let passed_s = (invocation.time_ns - self.begun_ns) as f64 * 1e-9;
        self.elapsed = passed_s.min(self.delay);
        if passed_s >= self.delay && !self.q {
            self.q = true;
            self.done.report();
        }
        Outcome::Done
    }
}
