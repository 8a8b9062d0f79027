// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::TAU;

/// The kind of sweep is unknown.
const UNKNOWN_SWEEP: u32 = 1;
/// The duration or a frequency is out of range.
const BAD_RANGE: u32 = 2;

/// Chirp, a swept sine: y = offset + amplitude sin(2 pi ∫f dt), f from first to last over the duration, linearly or exponentially.
///
/// Use a chirp to measure a frequency response. t is the running time since the first invocation; after the duration, y = offset. An
/// exponential sweep spends the same time in each octave. Source: Farina, 2000. Range: duration above 0; for an exponential sweep, both
/// frequencies above 0. Faults: 1 the sweep is not 0 (linear) or 1 (exponential); 2 the duration is not above 0, or a frequency is
/// negative, or 0 in an exponential sweep.
#[derive(FunctionBlock)]
pub struct Chirp {
    /// signal
    #[output]
    y: f64,
    /// current frequency
    #[output(unit = "Hz")]
    frequency: f64,
    /// 0 linear, 1 exponential
    #[param(default = 0, range = "[0, 1]")]
    sweep: u32,
    /// frequency at the start
    #[param(default = 0.1, unit = "Hz", range = "[0, inf)")]
    first: f64,
    /// frequency at the end
    #[param(default = 10.0, unit = "Hz", range = "[0, inf)")]
    last: f64,
    /// duration of the sweep
    #[param(default = 10.0, unit = "s", range = "(0, inf)")]
    duration: f64,
    /// amplitude around the offset
    #[param(default = 1.0, range = "[-inf, inf)")]
    amplitude: f64,
    /// mean value
    #[param(default = 0.0, range = "[-inf, inf)")]
    offset: f64,
    /// the last frequency has been reached
    #[condition]
    finished: Condition,
    /// running time at the first invocation, ns; -1: not started
    #[state(initial = -1)]
    begun_ns: i64,
}

impl Chirp {
    /// Returns the number of cycles completed by time `t`, and the frequency at `t`.
    fn turns(&self, t: f64) -> (f64, f64) {
        let ratio = self.last / self.first;
        if self.sweep == 0 || ratio == 1.0 {
            let rise = (self.last - self.first) / self.duration;
            return ((self.first + 0.5 * rise * t) * t, self.first + rise * t);
        }
        let growth = ratio.ln() / self.duration;
        (self.first * (growth * t).exp_m1() / growth, self.first * (growth * t).exp())
    }
}

impl Step for Chirp {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let least = if self.sweep == 1 { f64::MIN_POSITIVE } else { 0.0 };
        if self.sweep > 1 {
            return Outcome::Fault(UNKNOWN_SWEEP);
        }
        if !(self.duration > 0.0 && self.first >= least && self.last >= least) {
            return Outcome::Fault(BAD_RANGE);
        }
        if self.begun_ns < 0 {
            self.begun_ns = invocation.time_ns;
        }
        let t = (invocation.time_ns - self.begun_ns) as f64 * 1e-9;
        let (turns, frequency) = self.turns(t.min(self.duration));
        self.frequency = frequency;
        if t < self.duration {
            self.y = self.offset + self.amplitude * (TAU * turns).sin();
        } else {
            self.y = self.offset;
            self.finished.report();
        }
        Outcome::Done
    }
}
