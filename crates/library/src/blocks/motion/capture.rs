// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// Capture: captured = u at the invocation in which `level` becomes true; reports `on` and `off` when the level changes.
///
/// The initial level counts as a change to it, so that a search that begins on its switch receives the condition immediately.
#[derive(FunctionBlock)]
pub struct Capture {
    /// number of values
    #[size(1, 16)]
    n: u32,
    /// level of a switch
    #[input(asynchronous)]
    level: bool,
    /// values to capture
    #[input(asynchronous, sized, unit = "rad|m")]
    u: [f64; 16],
    /// values of u when the level last became true
    #[output(sized, unit = "rad|m")]
    captured: [f64; 16],
    /// the level has become true
    #[condition]
    on: Condition,
    /// the level has become false
    #[condition]
    off: Condition,
    /// level in the previous invocation: 0 or 1; 2: none yet
    #[state(initial = 2)]
    before: u8,
}

impl Step for Capture {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let level = u8::from(self.level);
        if level != self.before {
            if self.level {
                self.captured = self.u;
                self.on.report();
            } else {
                self.off.report();
            }
        }
        self.before = level;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_captures_when_the_level_becomes_true() {
        let mut latch = Capture { n: 1, level: false, u: [0.0; 16], captured: [0.0; 16], on: Condition::new(), off: Condition::new(), before: 2 };
        let mut seen = Vec::new();
        for (k, level) in [false, false, true, true, false, true].into_iter().enumerate() {
            (latch.level, latch.u[0]) = (level, k as f64);
            (latch.on, latch.off) = (Condition::new(), Condition::new());
            assert_eq!(latch.step(&Invocation::default()), Outcome::Done);
            seen.push((latch.on.is_reported(), latch.off.is_reported(), latch.captured[0]));
        }
        let expected = [(false, true, 0.0), (false, false, 0.0), (true, false, 2.0), (false, false, 2.0), (false, true, 2.0), (true, false, 5.0)];
        assert_eq!(seen, expected);
    }
}
