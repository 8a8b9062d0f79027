// SPDX-License-Identifier: Apache-2.0
use opengpac::{FunctionBlock, Invocation, Outcome, Step};

/// A gain or the maximum force is negative or NaN.
const BAD_PARAMETER: u32 = 1;

/// Compliant servo: effort = k (setpoint - position) - d velocity + bias, the spring term within ± force_max; fault 1 if k, d or
/// force_max is below 0.
///
/// For a compliant finger or joint: an object in contact feels a spring of stiffness k, and never a force above `force_max`, however far
/// away the set-point is. `force_max` is an input, so that a verb can close gently and then grip. The concept is from Hogan, Impedance
/// Control, 1985.
#[derive(FunctionBlock)]
pub struct CompliantServo {
    /// commanded position
    #[input(asynchronous)]
    setpoint: f64,
    /// position
    #[input]
    position: f64,
    /// velocity
    #[input(asynchronous, default = 0.0, range = "[-inf, inf)")]
    velocity: f64,
    /// effort that compensates gravity
    #[input(asynchronous, default = 0.0, range = "[-inf, inf)")]
    bias: f64,
    /// maximum magnitude of the spring's effort
    #[input(asynchronous, default = 1e6, range = "[0, inf)")]
    force_max: f64,
    /// effort
    #[output]
    effort: f64,
    /// setpoint - position
    #[output]
    deflection: f64,
    /// stiffness k, effort per unit of position
    #[param(default = 100.0, range = "[0, inf)")]
    k: f64,
    /// damping d, effort per unit of velocity
    #[param(default = 10.0, range = "[0, inf)")]
    d: f64,
}

impl Step for CompliantServo {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if ![self.k, self.d, self.force_max].iter().all(|x| *x >= 0.0) {
            return Outcome::Fault(BAD_PARAMETER);
        }
        self.deflection = self.setpoint - self.position;
        self.effort = (self.k * self.deflection).clamp(-self.force_max, self.force_max) - self.d * self.velocity + self.bias;
        Outcome::Done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn servo() -> CompliantServo {
        CompliantServo { setpoint: 0.0, position: 0.0, velocity: 0.0, bias: 0.0, force_max: 5.0, effort: 0.0, deflection: 0.0, k: 100.0, d: 10.0 }
    }

    #[test]
    fn it_is_a_spring_of_limited_force() {
        let effort = |setpoint: f64, velocity: f64| {
            let mut servo = CompliantServo { setpoint, velocity, bias: 1.0, ..servo() };
            assert_eq!(servo.step(&Invocation::default()), Outcome::Done);
            servo.effort
        };
        assert_eq!(effort(0.02, 0.0), 3.0);
        assert_eq!(effort(0.02, 0.1), 2.0);
        assert_eq!((effort(9.0, 0.0), effort(-9.0, 0.0)), (6.0, -4.0));
    }

    #[test]
    fn a_load_deflects_it_by_the_load_over_the_stiffness() {
        // A mass of 2 kg under 3 N, at 1 kHz.
        let (mut x, mut v) = (0.0, 0.0);
        let mut servo = servo();
        for _ in 0..10_000 {
            (servo.position, servo.velocity) = (x, v);
            assert_eq!(servo.step(&Invocation::default()), Outcome::Done);
            v += (servo.effort + 3.0) / 2.0 * 1e-3;
            x += v * 1e-3;
        }
        assert!((x - 0.03).abs() < 1e-6, "{x}");
    }

    #[test]
    fn what_is_no_stiffness_is_a_fault() {
        assert_eq!(CompliantServo { k: -1.0, ..servo() }.step(&Invocation::default()), Outcome::Fault(BAD_PARAMETER));
        assert_eq!(CompliantServo { force_max: f64::NAN, ..servo() }.step(&Invocation::default()), Outcome::Fault(BAD_PARAMETER));
    }
}
