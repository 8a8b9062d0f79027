// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// A pulse: y = value for `width` from the first invocation, then y = not value; reports `done` when that has been written too. Suspended
/// time does not count.
#[derive(FunctionBlock)]
pub struct PulseDigital {
    /// value most recently written to the output
    #[input]
    written: bool,
    /// pulse
    #[output]
    y: bool,
    /// duration of the pulse
    #[param(default = 0.1, unit = "s", range = "[0, inf)")]
    width: f64,
    /// value during the pulse
    #[param(default = true)]
    value: bool,
    /// the pulse has ended
    #[condition]
    done: Condition,
    /// running time at the first invocation, ns
    #[state(initial = -1)]
    begun_ns: i64,
}

impl Step for PulseDigital {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if self.begun_ns < 0 {
            self.begun_ns = invocation.time_ns;
        }
        // The half nanosecond is for rounding: a width in decimal seconds ends in the intended firing.
        let is_over = (invocation.time_ns - self.begun_ns) as f64 + 0.5 >= self.width * 1e9;
        self.y = self.value != is_over;
        if is_over && self.written != self.value {
            self.done.report();
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lasts_as_long_as_its_width() {
        let mut block = PulseDigital { written: false, y: false, width: 0.003, value: true, done: Condition::new(), begun_ns: -1 };
        let mut at = |time_ms: i64| {
            block.written = block.y;
            assert_eq!(block.step(&Invocation { number: 0, time_ns: time_ms * 1_000_000, now_ns: 0 }), Outcome::Done);
            (block.y, block.done.is_reported())
        };
        assert_eq!([at(5), at(6), at(7)], [(true, false); 3]);
        assert_eq!([at(8), at(9)], [(false, false), (false, true)]);
    }
}
