// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// The time is negative.
const NEGATIVE_TIME: u32 = 1;

/// Pulse timer: q = true for the duration from a rising edge of u, whatever u does meanwhile; elapsed = time since that edge.
///
/// After the pulse, elapsed stays at the duration until u is off; an edge during the pulse is ignored. Time is running time. Source: IEC
/// 61131-3, TP. Range: duration from 0. Faults: 1 the duration is negative or NaN.
#[derive(FunctionBlock)]
pub struct Pulse {
    /// input (IN)
    #[input]
    u: bool,
    /// pulse (Q)
    #[output]
    q: bool,
    /// time since the pulse began, at most its duration (ET)
    #[output(unit = "s")]
    elapsed: f64,
    /// duration of the pulse (PT)
    #[param(default = 1.0, unit = "s", range = "[0, inf)")]
    duration: f64,
    /// the pulse has ended
    #[condition]
    done: Condition,
    /// input in the previous invocation
    #[state]
    before: bool,
    /// running time at which the pulse began, ns; -1: no pulse
    #[state(initial = -1)]
    begun_ns: i64,
}

impl Step for Pulse {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.duration.is_nan() || self.duration < 0.0 {
            return Outcome::Fault(NEGATIVE_TIME);
        }
        if self.u && !self.before && !self.q {
            (self.begun_ns, self.q) = (invocation.time_ns, true);
        }
        if self.q {
            let passed_s = (invocation.time_ns - self.begun_ns) as f64 * 1e-9;
            self.elapsed = passed_s.min(self.duration);
            if passed_s >= self.duration {
                self.q = false;
                self.done.report();
            }
        }
        if !self.q && !self.u {
            self.elapsed = 0.0;
        }
        self.before = self.u;
        Outcome::Done
    }
}
