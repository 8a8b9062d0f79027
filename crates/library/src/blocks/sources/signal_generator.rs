// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::TAU;

/// The shape of the waveform is unknown.
const UNKNOWN_SHAPE: u32 = 1;
/// The duty cycle is out of range.
const BAD_DUTY: u32 = 2;

/// Signal generator: y = offset + amplitude f(frequency t + phase), t being the running time of the verb.
///
/// Waveforms: constant, sine, square, triangle, sawtooth. For a frequency that changes with time, see `chirp`. Range: duty 0 to 1.
/// Faults: 1 the shape is not 0 (constant), 1 (sine), 2 (square), 3 (triangle) or 4 (sawtooth); 2 the duty cycle is not 0 to 1.
#[derive(FunctionBlock)]
pub struct SignalGenerator {
    /// signal
    #[output]
    y: f64,
    /// f: 0 constant 0, 1 sine, 2 square (1, then -1), 3 triangle (0 up to 1, down to -1, up to 0), 4 sawtooth (-1 up to 1)
    #[param(default = 1, range = "[0, 4]")]
    shape: u32,
    /// amplitude around the offset
    #[param(default = 1.0, range = "[-inf, inf)")]
    amplitude: f64,
    /// frequency
    #[param(default = 1.0, unit = "Hz", range = "[0, inf)")]
    frequency: f64,
    /// mean value
    #[param(default = 0.0, range = "[-inf, inf)")]
    offset: f64,
    /// phase lead as a fraction of a period, 0 to 1
    #[param(default = 0.0, range = "[-inf, inf)")]
    phase: f64,
    /// duty cycle: fraction of a period for which a square wave is 1
    #[param(default = 0.5, range = "[0, 1]")]
    duty: f64,
}

impl Step for SignalGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if !(0.0..=1.0).contains(&self.duty) {
            return Outcome::Fault(BAD_DUTY);
        }
        let turn = (self.frequency * (invocation.time_ns as f64 * 1e-9) + self.phase).rem_euclid(1.0);
        let wave = match self.shape {
            0 => 0.0,
            1 => (TAU * turn).sin(),
            2 if turn < self.duty => 1.0,
            2 => -1.0,
            3 => 1.0 - 4.0 * ((turn + 0.25).rem_euclid(1.0) - 0.5).abs(),
            4 => 2.0 * turn - 1.0,
            _ => return Outcome::Fault(UNKNOWN_SHAPE),
        };
        self.y = self.offset + self.amplitude * wave;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(shape: u32, time_s: f64) -> f64 {
        let mut block = SignalGenerator { y: 0.0, shape, amplitude: 2.0, frequency: 0.5, offset: 1.0, phase: 0.0, duty: 0.5 };
        assert_eq!(block.step(&Invocation { number: 0, time_ns: (time_s * 1e9).round() as i64, now_ns: 0 }), Outcome::Done);
        block.y
    }

    #[test]
    fn each_shape_has_its_closed_form() {
        for k in 0..200 {
            let t = k as f64 * 0.037;
            assert_eq!(at(0, t), 1.0);
            assert!((at(1, t) - (1.0 + 2.0 * (TAU * 0.5 * t).sin())).abs() < 1e-9);
            assert_eq!(at(2, t), if (t / 2.0).fract() < 0.5 { 3.0 } else { -1.0 });
            assert!((at(3, t) - (1.0 + 2.0 * (TAU * 0.5 * t).sin().asin() * 4.0 / TAU)).abs() < 1e-6, "triangle at {t}");
        }
        let mut unknown = SignalGenerator { y: 0.0, shape: 9, amplitude: 1.0, frequency: 1.0, offset: 0.0, phase: 0.0, duty: 0.5 };
        assert_eq!(unknown.step(&Invocation::default()), Outcome::Fault(UNKNOWN_SHAPE));
    }
}
