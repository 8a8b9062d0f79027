// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// In position: reports `done` when error = max |goal_i - sensed_i| <= tolerance in `dwell` consecutive invocations, and `complete` is
/// true.
///
/// Bind `complete` to the set-point generator's output of the same name: `done` is then never reported before the generator has stored
/// its last set-point. If it is left unbound, only the dwell prevents a slow final phase of a motion from being taken for its end.
#[derive(FunctionBlock)]
pub struct InPosition {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// measured positions
    #[input(asynchronous, sized, unit = "rad|m")]
    sensed: [f64; 16],
    /// commanded positions of the joints
    #[input(asynchronous, sized, unit = "rad|m")]
    goal: [f64; 16],
    /// true if the motion is complete
    #[input(asynchronous, default = true)]
    complete: bool,
    /// maximum distance of a joint from its goal
    #[output(unit = "rad|m")]
    error: f64,
    /// maximum distance at which a joint counts as in position
    #[param(default = 0.002, unit = "rad|m", range = "(0, 1000]")]
    tolerance: f64,
    /// number of consecutive invocations in which all joints must be in position
    #[param(default = 5, range = "[0, 1000000]")]
    dwell: u32,
    /// all joints are at their goals
    #[condition]
    done: Condition,
    /// number of consecutive invocations in which all joints have been in position
    #[state]
    there: u32,
}

impl Step for InPosition {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let n = self.n as usize;
        let far = |(goal, sensed): (&f64, &f64)| (goal - sensed).abs();
        // A NaN must not be lost in a maximum.
        self.error = self.goal[..n].iter().zip(&self.sensed[..n]).map(far).fold(0.0, |most: f64, e| if e > most || e.is_nan() { e } else { most });
        let there = self.complete && self.error <= self.tolerance;
        self.there = if there { self.there.saturating_add(1) } else { 0 };
        if there && self.there >= self.dwell {
            self.done.report();
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block() -> InPosition {
        let mut goal = [9.0; 16];
        (goal[0], goal[1]) = (1.0, 2.0);
        let mut sensed = [0.0; 16];
        (sensed[0], sensed[1]) = (1.0, 2.0005);
        InPosition { n: 2, sensed, goal, complete: true, error: 0.0, tolerance: 0.001, dwell: 3, done: Condition::new(), there: 0 }
    }

    /// Returns the number of invocations until the block reports, at most 20.
    fn invocations(mut block: InPosition, mut before: impl FnMut(u64, &mut InPosition)) -> Option<u64> {
        (1..=20).find(|k| {
            before(*k, &mut block);
            block.done = Condition::new();
            assert_eq!(block.step(&Invocation::default()), Outcome::Done);
            block.done.is_reported()
        })
    }

    #[test]
    fn reports_after_its_dwell() {
        assert_eq!(invocations(block(), |_, _| ()), Some(3));
        assert_eq!(invocations(block(), |k, b| b.sensed[0] = if k == 2 { 1.5 } else { 1.0 }), Some(5), "the dwell begins again");
    }

    #[test]
    fn waits_for_the_last_setpoint() {
        assert_eq!(invocations(block(), |k, b| b.complete = k >= 7), Some(9));
        assert_eq!(invocations(block(), |_, b| b.complete = false), None);
    }

    #[test]
    fn a_joint_elsewhere_or_nowhere_is_not_there() {
        assert_eq!(invocations(block(), |_, b| b.sensed[1] = 2.002), None);
        assert_eq!(invocations(block(), |_, b| b.sensed[0] = f64::NAN), None);
    }
}
