// SPDX-License-Identifier: Apache-2.0
//! Control law of the servo blocks.

/// Gains and limit of a PID law.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    pub kp: f64,
    pub ki: f64,
    pub kd: f64,
    /// Maximum magnitude of the effort.
    pub limit: f64,
}

impl Law {
    /// Computes effort = kp e + ki ∫e dt + kd e' + feedforward, within ± limit. The integral is held if the effort is limited and the
    /// error would drive it further (no wind-up). `integral` is ki ∫e dt and is updated.
    pub fn effort(&self, error: f64, rate: f64, feedforward: f64, span_s: f64, integral: &mut f64) -> f64 {
        let more = *integral + self.ki * error * span_s;
        let wanted = self.kp * error + more + self.kd * rate + feedforward;
        let limited = if wanted.is_nan() { wanted } else { wanted.clamp(-self.limit, self.limit) };
        if limited == wanted || (wanted - limited) * error * self.ki <= 0.0 {
            *integral = more;
        }
        limited
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_effort_is_the_sum_of_its_terms() {
        let mut integral = 1.0;
        let effort = Law { kp: 2.0, ki: 3.0, kd: 5.0, limit: 100.0 }.effort(0.5, -0.25, 7.0, 0.1, &mut integral);
        assert!((integral - 1.15).abs() < 1e-12);
        assert!((effort - (1.0 + 1.15 - 1.25 + 7.0)).abs() < 1e-12);
    }

    #[test]
    fn at_its_limit_it_does_not_wind_up_and_comes_back_at_once() {
        let law = Law { kp: 1.0, ki: 10.0, kd: 0.0, limit: 5.0 };
        let mut integral = 0.0;
        for _ in 0..1000 {
            assert_eq!(law.effort(20.0, 0.0, 0.0, 0.01, &mut integral), 5.0);
        }
        assert_eq!(integral, 0.0);
        assert!(law.effort(-0.1, 0.0, 0.0, 0.01, &mut integral) < 0.0);
    }
}
