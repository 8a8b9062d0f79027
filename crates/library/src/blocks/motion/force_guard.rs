// SPDX-License-Identifier: Apache-2.0
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// The force is not a finite vector.
const NOT_FINITE: u32 = 1;

/// Force guard: reports the magnitude |force| if it exceeds the preset of `above`; fault 1 if the force is not finite.
#[derive(FunctionBlock)]
pub struct ForceGuard {
    /// monitored force
    #[input(asynchronous, unit = "N")]
    force: [f64; 3],
    /// |force|
    #[output(unit = "N")]
    magnitude: f64,
    /// |force| exceeds the preset; the value is |force|
    #[condition(preset = 50.0, unit = "N", range = "[0, inf)")]
    above: ConditionOf<f64>,
}

impl Step for ForceGuard {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.magnitude = self.force.iter().map(|f| f * f).sum::<f64>().sqrt();
        if !self.magnitude.is_finite() {
            // A lost sensor must not look like a small force.
            return Outcome::Fault(NOT_FINITE);
        }
        if self.magnitude > self.above.preset {
            self.above.report(self.magnitude);
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(force: [f64; 3]) -> (Outcome, Option<f64>) {
        let mut block = ForceGuard { force, magnitude: 0.0, above: ConditionOf::new(10.0) };
        let outcome = block.step(&Invocation::default());
        (outcome, block.above.is_reported().then_some(block.above.value))
    }

    #[test]
    fn reports_only_above_its_preset() {
        assert_eq!(guard([0.0, 6.0, 8.0]), (Outcome::Done, None), "10 N is not above 10 N");
        assert_eq!(guard([3.0, 4.0, 12.0]), (Outcome::Done, Some(13.0)));
        assert_eq!(guard([f64::NAN, 0.0, 0.0]).0, Outcome::Fault(NOT_FINITE));
    }
}
