// SPDX-License-Identifier: Apache-2.0
//! Detection of a joint that oscillates about its commanded position although it is commanded to be at rest.

/// Minimum number of consecutive swings of a ripple, ten periods, and their minimum total duration. Over fewer samples, noise may look
/// regular by chance.
const SWINGS: u32 = 20;
const SPAN_S: f64 = 0.1;
/// Fraction of the largest earlier swing below which a swing indicates a joint that is settling.
const SETTLING: f64 = 0.5;
/// Maximum ratio of the longest swing to the shortest one, ignoring one sample, because noise and pushes are less uniform than an
/// oscillating servo.
const EVEN: f64 = 1.5;

/// Counts the swings of a value from one turning point to the next, about any mean.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ripple {
    /// 1 when rising, -1 when falling, 0 before the first swing.
    side: i8,
    /// Extreme value of the current swing, and of the previous one.
    farthest: f64,
    before: f64,
    /// Samples since the last swing.
    samples: u32,
    swings: Swings,
    last_ns: i64,
}

/// Consecutive swings.
#[derive(Clone, Copy, Debug, Default)]
struct Swings {
    count: u32,
    first_ns: i64,
    /// Number of samples of the shortest and the longest swing.
    shortest: u32,
    longest: u32,
    /// Height of the highest swing.
    largest: f64,
}

impl Ripple {
    /// Processes the value at `time_ns`. Returns the frequency, Hz, when for ten consecutive periods, over at least a tenth of a second,
    /// each swing has been at least `height` from peak to peak, none slower than `frequency_min`, all of about equal length, and none
    /// much lower than the earlier ones. Restarts if `is_still` is false. Returns `None` if `height` or `frequency_min` is 0.
    pub fn look(&mut self, value: f64, height: f64, frequency_min: f64, is_still: bool, time_ns: i64) -> Option<f64> {
        if !(height > 0.0 && frequency_min > 0.0 && is_still && value.is_finite()) {
            *self = Ripple::default();
            return None;
        }
        self.samples = self.samples.saturating_add(1);
        let swing = self.turn(value, height)?;
        let samples = std::mem::take(&mut self.samples);
        let is_late = (time_ns - self.last_ns) as f64 * 1e-9 > 0.5 / frequency_min;
        self.last_ns = time_ns;
        let swings = self.swings.and(samples, swing);
        if is_late || !swings.is_even() || swing < SETTLING * swings.largest {
            self.swings = Swings { first_ns: time_ns, ..Swings::default() };
            return None;
        }
        self.swings = swings;
        let span_s = (time_ns - swings.first_ns) as f64 * 1e-9;
        if swings.count < SWINGS || span_s < SPAN_S {
            return None;
        }
        // The next report covers the next ten periods.
        self.swings = Swings { first_ns: time_ns, ..Swings::default() };
        Some(0.5 * f64::from(swings.count) / span_s)
    }

    /// Returns the height of the swing that ends with this value, which has come back by `height` from the extreme value.
    fn turn(&mut self, value: f64, height: f64) -> Option<f64> {
        if self.side == 0 {
            if self.samples == 1 {
                (self.farthest, self.before) = (value, value);
            }
            // Until the first swing, these are the highest and the lowest value.
            (self.farthest, self.before) = (self.farthest.max(value), self.before.min(value));
            if self.farthest - self.before < height {
                return None;
            }
            if value == self.farthest {
                self.side = 1;
            } else {
                (self.side, self.before, self.farthest) = (-1, self.farthest, value);
            }
            return Some(height);
        }
        let up = f64::from(self.side);
        if (value - self.farthest) * up >= 0.0 {
            self.farthest = value;
            return None;
        }
        if (self.farthest - value) * up < height {
            return None;
        }
        let swing = (self.farthest - self.before).abs();
        (self.side, self.before, self.farthest) = (-self.side, self.farthest, value);
        Some(swing)
    }
}

impl Swings {
    /// Returns these swings with one more added.
    fn and(self, samples: u32, height: f64) -> Swings {
        let shortest = if self.count == 0 { samples } else { self.shortest.min(samples) };
        Swings { count: self.count + 1, shortest, longest: self.longest.max(samples), largest: self.largest.max(height), ..self }
    }

    fn is_even(&self) -> bool {
        f64::from(self.longest) <= EVEN * f64::from(self.shortest) + 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const HEIGHT: f64 = 1e-3;

    /// Returns the first frequency reported for a value that is checked every millisecond for `ms`.
    fn look(mut value: impl FnMut(f64) -> f64, ms: i64) -> Option<f64> {
        let mut ripple = Ripple::default();
        (0..ms).find_map(|k| ripple.look(value(k as f64 * 1e-3), HEIGHT, 5.0, true, k * 1_000_000))
    }

    /// Returns a generator of uniform pseudo-random numbers from -1 to 1 with a fixed seed.
    fn noise() -> impl FnMut() -> f64 {
        let mut state = 0x9E37_79B9_7F4A_7C15_u64;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn a_ripple_about_any_mean_is_found_with_its_frequency() {
        for (frequency, mean) in [(7.0, 0.0), (40.0, 0.02), (125.0, -0.3), (230.0, 0.0), (500.0, 0.001)] {
            let found = look(|t| mean + 0.6e-3 * (TAU * frequency * (t + 3e-4)).sin() / (TAU * frequency * 3e-4).sin().abs().max(0.8), 5000);
            let found = found.unwrap_or_else(|| panic!("{frequency} Hz about {mean}"));
            assert!((found / frequency - 1.0).abs() < 0.1, "{found} Hz of {frequency}");
        }
    }

    #[test]
    fn what_is_sound_is_not_found() {
        assert_eq!(look(|t| 0.49e-3 * (TAU * 40.0 * t).sin(), 20_000), None, "lower than the bound");
        assert_eq!(look(|t| 5e-3 * (TAU * 2.0 * t).sin(), 60_000), None, "slow hunting");
        assert_eq!(look(|t| 20e-3 * (-3.0 * t).exp() * (TAU * 20.0 * t).sin(), 20_000), None, "a step that settles, damping ratio 0.024");
        assert_eq!(look(|t| if (t * 0.4) as i64 % 2 == 0 { 0.0 } else { 5e-3 }, 60_000), None, "steps");
        let mut noise = noise();
        // A 12-bit encoder whose last bit is noise.
        let mut counts = || (1.5 * noise()).round() * TAU / 4096.0;
        assert_eq!(look(|_| 0.3 * counts(), 600_000), None, "noise within the bound");
        assert_eq!(look(|_| counts(), 60_000), None, "noise beyond it, uneven");
    }

    #[test]
    fn pushes_at_random_are_no_ripple() {
        // A soft servo, damped by 0.3 at 6 Hz, with a push every 20 ms.
        let (mut noise, mut q, mut v, mut push) = (noise(), 0.0, 0.0, 0.0);
        let mut k = 0;
        let found = look(
            |_| {
                if k % 20 == 0 {
                    push = 20.0 * noise();
                }
                k += 1;
                v += 1e-3 * (push - 1421.0 * q - 22.6 * v);
                q += 1e-3 * v;
                q
            },
            600_000,
        );
        assert_eq!(found, None);
    }

    #[test]
    fn a_joint_that_is_led_is_not_looked_at() {
        let mut ripple = Ripple::default();
        let found = (0..5000).find_map(|k| ripple.look((TAU * 0.02 * k as f64).sin(), HEIGHT, 5.0, k % 100 > 0, k * 1_000_000));
        assert_eq!(found, None);
    }
}
