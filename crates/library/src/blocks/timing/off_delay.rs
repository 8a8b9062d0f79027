// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// The time is negative.
const NEGATIVE_TIME: u32 = 1;

/// Off-delay timer: q = true while u is true and for the delay afterwards; elapsed = time since u went off, at most the delay.
///
/// The output starts off. Time is running time, which stops while the verb is suspended. Source: IEC 61131-3, TOF. Range: delay from 0.
/// Faults: 1 the delay is negative or NaN.
#[derive(FunctionBlock)]
pub struct OffDelay {
    /// input (IN)
    #[input]
    u: bool,
    /// input with its falling edge delayed (Q)
    #[output]
    q: bool,
    /// time since the input went off (ET)
    #[output(unit = "s")]
    elapsed: f64,
    /// duration of the delay (PT)
    #[param(default = 1.0, unit = "s", range = "[0, inf)")]
    delay: f64,
    /// the delay has elapsed
    #[condition]
    done: Condition,
    /// running time at which the input went off, ns; -1: the input is on
    #[state(initial = -1)]
    begun_ns: i64,
}

impl Step for OffDelay {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.delay.is_nan() || self.delay < 0.0 {
            return Outcome::Fault(NEGATIVE_TIME);
        }
        if self.u {
            (self.begun_ns, self.q, self.elapsed) = (-1, true, 0.0);
            return Outcome::Done;
        }
        if !self.q {
            return Outcome::Done;
        }
        if self.begun_ns < 0 {
            self.begun_ns = invocation.time_ns;
        }
        let passed_s = (invocation.time_ns - self.begun_ns) as f64 * 1e-9;
        self.elapsed = passed_s.min(self.delay);
        if passed_s >= self.delay {
            self.q = false;
            self.done.report();
        }
        Outcome::Done
    }
}
