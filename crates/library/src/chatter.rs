// SPDX-License-Identifier: Apache-2.0
//! Detection of values that swing between two bounds, such as the effort of an unstable servo or the ripple of its position.

/// Number of consecutive swings after which a value counts as chattering: ten periods.
const SWINGS: u32 = 20;

/// Counts the swings of a value from beyond one bound to beyond the other.
#[derive(Clone, Copy, Debug, Default)]
pub struct Chatter {
    /// Sign of the bound that was last passed; 0 before the first.
    side: i8,
    /// Number of consecutive swings, each within the maximum time after the previous one.
    count: u32,
    first_ns: i64,
    last_ns: i64,
    /// Half waves since `first_ns`, including those that do not pass the bounds.
    half_waves: HalfWaves,
    /// Half waves of the speed of the reference, which may be the cause of the swings.
    led: HalfWaves,
}

/// Counts the sign changes of a number.
#[derive(Clone, Copy, Debug, Default)]
struct HalfWaves {
    /// Sign of the last nonzero number.
    sign: i8,
    count: u32,
}

impl HalfWaves {
    fn look(&mut self, number: f64) {
        let sign = sign(number);
        if sign != 0 {
            self.count = self.count.saturating_add(u32::from(sign == -self.sign));
            self.sign = sign;
        }
    }
}

/// Returns 1, -1, or 0 for 0 and NaN.
fn sign(number: f64) -> i8 {
    i8::from(number > 0.0) - i8::from(number < 0.0)
}

impl Chatter {
    /// Processes the value at `time_ns`. Returns the frequency, Hz, when the value has swung from beyond `bound` to beyond `-bound` and
    /// back for ten consecutive periods, none slower than `frequency_min`. A value that stays beyond one bound (a hard stop), rarely
    /// passes the bounds (a step, friction) or stays within them (noise) does not chatter. Neither does a value whose swings are caused
    /// by its reference: `leads` is the speed of the reference, which then reverses at least half as often. Returns `None` if the bound
    /// or the frequency is 0.
    pub fn look(&mut self, value: f64, bound: f64, frequency_min: f64, leads: f64, time_ns: i64) -> Option<f64> {
        if !(bound > 0.0 && frequency_min > 0.0) {
            *self = Chatter::default();
            return None;
        }
        self.half_waves.look(value);
        self.led.look(leads);
        let side = sign(value);
        if side == 0 || value.abs() < bound || side == self.side {
            return None;
        }
        let is_late = (time_ns - self.last_ns) as f64 * 1e-9 > 0.5 / frequency_min;
        if self.side == 0 || is_late {
            *self = Chatter { side, last_ns: time_ns, ..*self };
            self.begin(time_ns);
            return None;
        }
        *self = Chatter { side, count: self.count + 1, last_ns: time_ns, ..*self };
        if self.count < SWINGS {
            return None;
        }
        let span_s = (time_ns - self.first_ns) as f64 * 1e-9;
        let is_led = 2 * self.led.count >= self.half_waves.count;
        let frequency = 0.5 * f64::from(self.half_waves.count) / span_s;
        // The next report covers the next ten periods.
        self.begin(time_ns);
        (!is_led).then_some(frequency)
    }

    fn begin(&mut self, time_ns: i64) {
        (self.count, self.first_ns, self.half_waves.count, self.led.count) = (0, time_ns, 0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the first frequency reported for a value that is checked every millisecond for `ms`.
    fn look(value: impl Fn(f64) -> f64, ms: i64) -> Option<f64> {
        let mut chatter = Chatter::default();
        (0..ms).find_map(|k| chatter.look(value(k as f64 * 1e-3), 1.0, 5.0, 0.0, k * 1_000_000))
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
        // Every third period reaches only 0.8.
        let wave = |t: f64| if (t * 40.0) as i64 % 3 == 0 { 0.8 } else { 2.0 };
        let found = look(|t| wave(t) * (std::f64::consts::TAU * 40.0 * (t + 3e-4)).sin(), 3000).unwrap();
        assert!((found / 40.0 - 1.0).abs() < 0.05, "{found} Hz of 40");
    }

    #[test]
    fn what_is_led_to_swing_is_not_found() {
        let mut chatter = Chatter::default();
        let wave = |k: i64, frequency: f64| (std::f64::consts::TAU * frequency * (k as f64 * 1e-3 + 3e-4)).sin();
        let found = |led: f64, chatter: &mut Chatter| (0..5000).find_map(|k| chatter.look(2.0 * wave(k, 20.0), 1.0, 5.0, wave(k, led), k * 1_000_000));
        assert_eq!(found(20.0, &mut chatter), None, "it follows");
        assert!(found(1.0, &mut Chatter::default()).is_some(), "it swings by itself while it is led slowly");
    }

    #[test]
    fn what_is_sound_is_not_found() {
        assert_eq!(look(|t| 2.0 * (std::f64::consts::TAU * 2.0 * t).sin(), 20_000), None, "slow motions saturate both ways");
        assert_eq!(look(|_| 2.0, 5000), None, "a hard stop");
        assert_eq!(look(|t| 0.99 * (std::f64::consts::TAU * 100.0 * t).sin(), 5000), None, "noise within the bounds");
        assert_eq!(look(|t| 3.0 * (-5.0 * t).exp() * (std::f64::consts::TAU * 20.0 * t).sin(), 5000), None, "a step that settles");
    }
}
