// SPDX-License-Identifier: Apache-2.0
//! The reference of a servo: a set-point that is given every so often, approached in even steps.
//!
//! A generator at 20 ms gives a servo at 1 ms a staircase, and a stiff servo answers each stair with its greatest torque. With
//! `interpolation` 20, a new set-point is reached after 20 invocations, in equal steps, and the step gives the rate at which it moves
//! (the *interpolated position mode* of drives). It costs that many invocations of delay.

/// Where the reference is and where it goes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reference {
    value: f64,
    setpoint: f64,
    step: f64,
    left: u32,
    begun: bool,
}

impl Reference {
    /// Advances by one invocation: the reference and its step since the one before. The first set-point is taken as it is.
    pub fn advance(&mut self, setpoint: f64, interpolation: u32) -> (f64, f64) {
        if !self.begun {
            *self = Reference { value: setpoint, setpoint, step: 0.0, left: 0, begun: true };
        } else if setpoint != self.setpoint {
            self.setpoint = setpoint;
            self.left = interpolation.max(1);
            self.step = (setpoint - self.value) / f64::from(self.left);
        }
        match self.left {
            0 => self.step = 0.0,
            1 => (self.value, self.left) = (self.setpoint, 0),
            _ => {
                self.value += self.step;
                self.left -= 1;
            }
        }
        (self.value, self.step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_staircase_becomes_a_ramp() {
        let mut reference = Reference::default();
        assert_eq!(reference.advance(5.0, 4), (5.0, 0.0), "the first is taken as it is");
        let ramp: Vec<_> = [6.0, 6.0, 6.0, 6.0, 6.0].iter().map(|s| reference.advance(*s, 4)).collect();
        assert_eq!(ramp, [(5.25, 0.25), (5.5, 0.25), (5.75, 0.25), (6.0, 0.25), (6.0, 0.0)]);
    }

    #[test]
    fn without_interpolation_it_is_the_setpoint() {
        let mut reference = Reference::default();
        reference.advance(0.0, 1);
        assert_eq!(reference.advance(2.0, 1).0, 2.0);
        assert_eq!(reference.advance(3.0, 0).0, 3.0);
    }
}
