// SPDX-License-Identifier: Apache-2.0
//! Detection of a value that swings between two bounds: the effort of an unstable servo, or the ripple of its position.

/// Swings in a row after which a value counts as chattering: ten periods.
const SWINGS: u32 = 20;

/// Counts the swings of a value from beyond one bound to beyond the other.
#[derive(Clone, Copy, Debug, Default)]
pub struct Chatter {
    /// Sign of the bound that was passed last; 0 before the first.
    side: i8,
    /// Swings in a row, each of which came in time after the one before.
    count: u32,
    first_ns: i64,
    last_ns: i64,
    /// Sign of the value before, unless that was 0.
    sign: i8,
    /// How often the value changed its sign since `first_ns`: not each half wave of a swing passes its bound.
    crossings: u32,
}

impl Chatter {
    /// Takes the value at `time_ns`. Returns the frequency, Hz, when ten periods in a row have gone from beyond `bound` to beyond `-bound`
    /// and back, none slower than `frequency_min`. A value that stays beyond one bound (a hard stop), seldom passes them (a step, friction)
    /// or stays within them (noise) does not chatter. Off where the bound or the frequency is 0.
    pub fn look(&mut self, value: f64, bound: f64, frequency_min: f64, time_ns: i64) -> Option<f64> {
        if !(bound > 0.0 && frequency_min > 0.0) {
            *self = Chatter::default();
            return None;
        }
        let side = i8::from(value > 0.0) - i8::from(value < 0.0);
        if side == 0 {
            return None;
        }
        self.crossings = self.crossings.saturating_add(u32::from(side == -self.sign));
        self.sign = side;
        if value.abs() < bound || side == self.side {
            return None;
        }
        let is_late = (time_ns - self.last_ns) as f64 * 1e-9 > 0.5 / frequency_min;
        if self.side == 0 || is_late {
            *self = Chatter { side, count: 0, first_ns: time_ns, last_ns: time_ns, sign: side, crossings: 0 };
            return None;
        }
        *self = Chatter { side, count: self.count + 1, last_ns: time_ns, ..*self };
        if self.count < SWINGS {
            return None;
        }
        let span_s = (time_ns - self.first_ns) as f64 * 1e-9;
        let frequency = 0.5 * f64::from(self.crossings) / span_s;
        // The next report is of the next ten periods.
        (self.count, self.first_ns, self.crossings) = (0, time_ns, 0);
        Some(frequency)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is reported of a value over `ms`, looked at each ms.
    fn look(value: impl Fn(f64) -> f64, ms: i64) -> Option<f64> {
        let mut chatter = Chatter::default();
        (0..ms).find_map(|k| chatter.look(value(k as f64 * 1e-3), 1.0, 5.0, k * 1_000_000))
    }

    #[test]
    fn a_value_that_bangs_is_found_with_its_frequency() {
        for frequency in [7.0, 40.0, 125.0, 250.0] {
            let found = look(|t| 2.0 * (std::f64::consts::TAU * frequency * (t + 3e-4)).sin(), 3000).unwrap();
            assert!((found / frequency - 1.0).abs() < 0.1, "{found} Hz of {frequency}");
        }
    }

    #[test]
    fn half_waves_that_stay_within_the_bounds_count_for_the_frequency() {
        // Every third period goes to 0.8 only.
        let wave = |t: f64| if (t * 40.0) as i64 % 3 == 0 { 0.8 } else { 2.0 };
        let found = look(|t| wave(t) * (std::f64::consts::TAU * 40.0 * (t + 3e-4)).sin(), 3000).unwrap();
        assert!((found / 40.0 - 1.0).abs() < 0.05, "{found} Hz of 40");
    }

    #[test]
    fn what_is_sound_is_not_found() {
        assert_eq!(look(|t| 2.0 * (std::f64::consts::TAU * 2.0 * t).sin(), 20_000), None, "slow motions saturate both ways");
        assert_eq!(look(|_| 2.0, 5000), None, "a hard stop");
        assert_eq!(look(|t| 0.99 * (std::f64::consts::TAU * 100.0 * t).sin(), 5000), None, "noise within the bounds");
        assert_eq!(look(|t| 3.0 * (-5.0 * t).exp() * (std::f64::consts::TAU * 20.0 * t).sin(), 5000), None, "a step that settles");
    }
}
