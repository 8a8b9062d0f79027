// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// A number is not finite.
const NOT_FINITE: u32 = 1;

/// Set position: new offset = offset + shift, new commanded = commanded + shift, with shift = position - captured; nothing moves.
///
/// Execute it once: from then on, the position `captured` is `position`. A servo that takes `offset` and `commanded` receives both
/// changes in one publication and moves its reference by the same amount. Fault 1 if a number is not finite.
#[derive(FunctionBlock)]
pub struct SetPosition {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// captured position
    #[input(asynchronous, sized, unit = "rad|m")]
    captured: [f64; 16],
    /// new value of the captured position
    #[input(asynchronous, sized, unit = "rad|m")]
    position: [f64; 16],
    /// current offset of the readings of each joint
    #[input(asynchronous, sized, unit = "rad|m")]
    offset: [f64; 16],
    /// current commanded position of each joint
    #[input(asynchronous, sized, unit = "rad|m")]
    commanded: [f64; 16],
    /// new offset of the readings of each joint
    #[output(sized, unit = "rad|m")]
    new_offset: [f64; 16],
    /// commanded position of each joint, in the new coordinates
    #[output(sized, unit = "rad|m")]
    new_commanded: [f64; 16],
    /// true, because the joint is now homed
    #[output(sized)]
    homed: [bool; 16],
    /// change of the offset
    #[output(sized, unit = "rad|m")]
    shift: [f64; 16],
}

impl Step for SetPosition {
    fn step(&mut self, _: &Invocation) -> Outcome {
        for i in 0..self.n as usize {
            self.shift[i] = self.position[i] - self.captured[i];
            self.new_offset[i] = self.offset[i] + self.shift[i];
            self.new_commanded[i] = self.commanded[i] + self.shift[i];
            self.homed[i] = true;
            if !(self.new_offset[i].is_finite() && self.new_commanded[i].is_finite()) {
                return Outcome::Fault(NOT_FINITE);
            }
        }
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_numbers_of_a_joint_are_shifted_alike() {
        let mut block = SetPosition {
            n: 2, captured: [0.5; 16], position: [0.0; 16], offset: [0.1; 16], commanded: [0.6; 16], new_offset: [0.0; 16], new_commanded: [0.0; 16],
            homed: [false; 16], shift: [0.0; 16],
        };
        block.position[1] = 2.0;
        assert_eq!(block.step(&Invocation::default()), Outcome::Done);
        assert_eq!((block.shift[0], block.new_offset[0], block.new_offset[1]), (-0.5, -0.4, 1.6));
        assert!((block.new_commanded[0] - 0.1).abs() < 1e-15 && block.homed[1] && !block.homed[2]);
        block.captured[1] = f64::NAN;
        assert_eq!(block.step(&Invocation::default()), Outcome::Fault(NOT_FINITE));
    }
}
