// SPDX-License-Identifier: Apache-2.0
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// Counter: value += 1 at a rising edge of up, -= 1 at a rising edge of down; full = value >= preset, empty = value <= 0.
///
/// Counts up (CTU), down (CTD) or both (CTUD); leave unused inputs unbound. reset sets the value to 0 and takes precedence over load,
/// which sets it to the preset; simultaneous edges cancel. Source: IEC 61131-3, CTU, CTD, CTUD. Range: the value saturates at the limits
/// of a 32-bit integer.
#[derive(FunctionBlock)]
pub struct Counter {
    /// counts up at a rising edge (CU)
    #[input(default = false)]
    up: bool,
    /// counts down at a rising edge (CD)
    #[input(default = false)]
    down: bool,
    /// sets the value to 0 (R)
    #[input(asynchronous, default = false)]
    reset: bool,
    /// sets the value to the preset (LD)
    #[input(asynchronous, default = false)]
    load: bool,
    /// count (CV)
    #[output]
    value: i32,
    /// true if the value has reached the preset (QU)
    #[output]
    full: bool,
    /// true if the value has reached 0 (QD)
    #[output]
    empty: bool,
    /// count at which `full` becomes true (PV)
    #[param(default = 10, range = "[-inf, inf)")]
    preset: i32,
    /// the value has reached the preset
    #[condition]
    reached: Condition,
    /// `up` in the previous invocation
    #[state]
    up_before: bool,
    /// `down` in the previous invocation
    #[state]
    down_before: bool,
}

impl Step for Counter {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let (up, down) = (self.up && !self.up_before, self.down && !self.down_before);
        let was_full = self.full;
        self.value = match (self.reset, self.load) {
            (true, _) => 0,
            (false, true) => self.preset,
            (false, false) => self.value.saturating_add(i32::from(up) - i32::from(down)),
        };
        (self.full, self.empty) = (self.value >= self.preset, self.value <= 0);
        if self.full && !was_full {
            self.reached.report();
        }
        (self.up_before, self.down_before) = (self.up, self.down);
        Outcome::Done
    }
}
