// SPDX-License-Identifier: Apache-2.0
//! Reference of a servo: approaches periodic set-points in equal steps.
//!
//! The set-points of a generator at 20 ms are a staircase for a servo at 1 ms, and a stiff servo answers each step with its maximum
//! torque. With `interpolation` 20, a new set-point is reached after 20 invocations, in equal steps, and the step size gives the rate of
//! change (the *interpolated position mode* of drives). The cost is a delay of that many invocations.

mod approach;
mod inputs;
mod lead;

pub use approach::Approach;
pub use inputs::ReferenceInputs;
pub use lead::Braking;
use lead::Lead;

/// Position and speed of a reference, and its remaining distance to a goal.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reference {
    value: f64,
    setpoint: f64,
    step: f64,
    left: u32,
    begun: bool,
}

impl Reference {
    /// Advances by one invocation. Returns the reference and its step since the previous one. The first set-point is taken as it is.
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

/// Bounds of the reference of a servo, which are the last ones before the physical device.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub position_min: f64,
    pub position_max: f64,
    /// Maximum step in one invocation.
    pub step_max: f64,
    /// Maximum change of the step from one invocation to the next when catching up.
    pub change_max: f64,
}

/// A reference whose speed has no jumps: a new set-point is reached after two times `interpolation` invocations, with the speed changing
/// uniformly over each half. Set-points at intervals of `interpolation` invocations become their quadratic B-spline, so neither speed nor
/// acceleration ever exceeds that of the set-points (the mean of the staircase over `interpolation` invocations, taken twice). It lags
/// behind them by one and a half of their periods.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spline {
    value: f64,
    /// Speed, per invocation.
    speed: f64,
    /// Change of the speed, per invocation.
    change: f64,
    setpoint: f64,
    left: u32,
    /// Set after time was lost, while the reference catches up with the missed distance.
    catching_up: Option<CatchingUp>,
    /// Number of set-points for which the change of speed is still limited to the acceleration, because they follow a braking servo.
    wary: u32,
    /// Speed declared by the set-point, per invocation; 0 if it declares none.
    declared: f64,
    /// Speed and direction declared by the current set-point, per invocation; 0 if it declares none.
    heading: f64,
    /// Number of invocations by which the set-point is younger than the previous one; 0 if that is not known.
    apart: f64,
}

/// Motion of a reference that catches up with set-points that continued while its servo was stalled: no faster than it moved before, no
/// faster than the set-points move, and within its acceleration, so that it comes to rest where they do.
#[derive(Clone, Copy, Debug, Default)]
struct CatchingUp {
    /// Maximum speed, per invocation.
    speed: f64,
    /// Number of lost invocations during which the next set-point has moved; infinite if the speed is not determined from that set-point.
    lost: f64,
    /// Number of set-points that must arrive before catching up may end. The first ones after a loss of time arrive too early, because
    /// their generator did not lose time in the same cycles.
    awaited: u32,
    /// Speed of the last set-points, per invocation.
    pace: f64,
    /// Number of successive set-points that were followed in step and without a limit. Catching up ends after several of them, because
    /// the speed of the set-points may change right after the first.
    in_step: u32,
}

impl CatchingUp {
    /// Records a new set-point at a distance of `way` from the previous one, generated `span` invocations after it, and the lost
    /// invocations.
    fn note(&mut self, way: f64, span: f64) {
        self.speed = self.speed.max(way.abs() / (span + self.lost));
        self.pace = way / span;
        self.lost = 0.0;
        self.awaited = self.awaited.saturating_sub(1);
    }
}

/// Returns true if a limit is negative or NaN.
pub fn is_bad_limit(limit: f64) -> bool {
    limit.is_nan() || limit < 0.0
}

/// Distance, and speed per invocation, below which the reference counts as having arrived.
const THERE: f64 = 1e-13;
/// Number of set-points after which a returning generator is treated like any other: the number that determine the spline followed by the
/// reference.
const WARY: u32 = 3;
/// Maximum factor on the declared speed with which the delay of a late set-point is made up for.
const MAKING_UP: f64 = 1.15;
/// Tolerance for rounding when a set-point is compared with a bound: for the position, and as a fraction of the maximum speed.
const ROUNDING: f64 = 1e-9;

impl Spline {
    /// Returns a reference at rest at `value`.
    pub fn at(value: f64) -> Spline {
        Spline { value, setpoint: value, ..Spline::default() }
    }

    /// Advances by one invocation. Returns the reference, its speed per invocation, and true if a bound limited it. A reference outside
    /// its range, because the joint was there when it was enabled, may move only towards the range.
    pub fn advance(&mut self, setpoint: f64, interpolation: u32, bounds: Bounds) -> (f64, f64, bool) {
        // A NaN passes: it is detected as a fault of the servo.
        let (least, most) = (bounds.position_min.min(self.value), bounds.position_max.max(self.value));
        let wanted = if setpoint.is_nan() { setpoint } else { setpoint.clamp(least, most) };
        let mut limited = (wanted - setpoint).abs() > ROUNDING;
        if wanted != self.setpoint || (self.left == 0 && !self.is_there()) {
            let span = f64::from(interpolation.max(1));
            if let Some(catching_up) = &mut self.catching_up
                && wanted != self.setpoint
            {
                // Set-points that were held up on their way come in bursts, and have moved for longer than a period.
                catching_up.note(wanted - self.setpoint, span.max(self.apart));
            }
            self.setpoint = wanted;
            // The next speed, from which an even change to rest ends at the set-point.
            let even = if interpolation > 1 { (wanted - self.value) / span - self.speed / 2.0 } else { wanted - self.value };
            let even_max = even.clamp(-bounds.step_max, bounds.step_max);
            let speed = if even.is_nan() { even } else { self.within(even_max, span, bounds) };
            limited |= (even - speed).abs() > ROUNDING * bounds.step_max;
            (self.change, self.left) = ((speed - self.speed) / span, interpolation.max(1));
        }
        if self.left > 0 {
            let before = self.speed;
            self.speed += self.change;
            self.value += if interpolation > 1 { before.midpoint(self.speed) } else { self.speed };
            self.left -= 1;
        }
        if self.left == 0 && self.is_there() {
            (self.value, self.speed, self.catching_up) = (self.setpoint, 0.0, None);
        }
        (self.value, self.speed, limited)
    }

    /// Handles lost time: prevents a jump over the distance that the set-points have moved in the meantime.
    fn catch_up(&mut self, lost: f64) {
        let before = self.catching_up.unwrap_or_default();
        self.catching_up = Some(CatchingUp { speed: before.speed.max(self.speed.abs()), lost: before.lost + lost, awaited: WARY, ..before });
    }

    /// Handles a generator that returns after being late for so long that the reference has braked. Its set-points, the first of which
    /// moves at `speed`, are followed no faster than they themselves move.
    fn catch_up_with(&mut self, speed: f64) {
        self.catch_up(f64::INFINITY);
        if let Some(catching_up) = &mut self.catching_up
            && speed.is_finite()
        {
            catching_up.speed = catching_up.speed.max(speed.abs());
        }
    }

    /// Returns `even`, the speed to reach over `span` invocations, limited for catching up; at the end of catching up, `even` itself.
    fn caught_up(&mut self, even: f64, span: f64, bounds: Bounds) -> f64 {
        let Some(mut catching_up) = self.catching_up else { return even };
        let towards = if self.setpoint < self.value { -1.0 } else { 1.0 };
        let (speed, wanted) = (towards * self.speed, towards * even);
        // From that speed it can still stop where the set-points can: v²/2c + (v + speed) span/2 is the distance to there.
        let c = bounds.change_max;
        let left = towards * (self.stop_of_setpoints(towards, bounds) - self.value);
        let room = (c * span / 2.0).powi(2) + 2.0 * c * (left - speed * span / 2.0);
        let stopping = if room > 0.0 { room.sqrt() - c * span / 2.0 } else { 0.0 };
        let most = catching_up.speed.min(stopping.max(0.0));
        let reached = wanted.clamp(speed - c * span, speed + c * span).min(most.max(speed - c * span));
        // In step, the speed is that of the set-points from the next one on.
        let is_in_step = (catching_up.pace - even).abs() <= c * span * (1.0 + ROUNDING);
        let is_unlimited = (wanted - reached).abs() <= ROUNDING * c * span;
        let is_over = is_unlimited && is_in_step && catching_up.lost == 0.0 && catching_up.awaited == 0;
        catching_up.in_step = if is_over { catching_up.in_step + 1 } else { 0 };
        self.catching_up = if catching_up.in_step > WARY { None } else { Some(catching_up) };
        if is_over { even } else { towards * reached }
    }

    /// Returns the position at which the set-points come to rest if they brake now within the acceleration; without a declared speed,
    /// their current position.
    fn stop_of_setpoints(&self, towards: f64, bounds: Bounds) -> f64 {
        let speed = (towards * self.heading).max(0.0);
        if speed == 0.0 {
            return self.setpoint;
        }
        let (least, most) = (bounds.position_min.min(self.setpoint), bounds.position_max.max(self.setpoint));
        (self.setpoint + towards * speed.powi(2) / (2.0 * bounds.change_max)).clamp(least, most)
    }

    /// Returns `even`, limited by the acceleration after a generator has returned and while catching up.
    fn within(&mut self, even: f64, span: f64, bounds: Bounds) -> f64 {
        let even = self.returned(even, span, bounds.change_max);
        self.caught_up(even, span, bounds)
    }

    /// Returns `even`, limited for a generator that returns after the reference has braked. If its set-points are far from the reference,
    /// the reference catches up with them as after lost time.
    fn returned(&mut self, even: f64, span: f64, change_max: f64) -> f64 {
        if self.wary == 0 {
            return even;
        }
        let (most, change) = (change_max * span, (even - self.speed).abs());
        if change > 2.0 * most && self.catching_up.is_none() {
            // As fast as the set-points say that they move: the distance may be that of a burst.
            let speed = if self.declared > 0.0 { self.declared } else { even.abs() };
            (self.catching_up, self.wary) = (Some(CatchingUp { speed: speed.max(self.speed.abs()), ..CatchingUp::default() }), 0);
            return even;
        }
        // A change that is held back now is left to the next set-points.
        let within = even.clamp(self.speed - most, self.speed + most);
        let limit = if self.declared > 0.0 { (MAKING_UP * self.declared).max(self.speed.abs()) } else { f64::INFINITY };
        self.wary = if change > most || within.abs() > limit { WARY } else { self.wary - 1 };
        within.clamp(-limit, limit)
    }

    /// Shifts the origin of positions: all positions increase by `by`, and no joint moves.
    pub fn shift(&mut self, by: f64) {
        self.value += by;
        self.setpoint += by;
    }

    fn is_there(&self) -> bool {
        (self.value - self.setpoint).abs() <= THERE * self.setpoint.abs().max(1.0) && self.speed.abs() <= THERE
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

    const WIDE: Bounds = Bounds { position_min: -1e6, position_max: 1e6, step_max: 1e6, change_max: 1e6 };

    #[test]
    fn a_spline_has_neither_more_speed_nor_more_acceleration_than_its_setpoints() {
        // From rest at 1 rad/s² to 0.4 rad/s and on, a set-point every 20 ms, one of them late.
        let mut spline = Spline::default();
        let (mut value, mut speed, _) = spline.advance(0.0, 20, WIDE);
        let (mut setpoint, mut most_speed, mut most_change) = (0.0, 0.0f64, 0.0f64);
        for k in 1..=2000 {
            if k % 20 == 0 && k <= 1000 {
                let t = f64::from(k) * 1e-3;
                setpoint = if t < 0.4 { t * t / 2.0 } else { 0.08 + 0.4 * (t - 0.4) };
            }
            let (now, rate, limited) = spline.advance(setpoint, 20, WIDE);
            assert!(!limited && (now - value - speed.midpoint(rate)).abs() < 1e-15, "the speed is that of the reference");
            most_speed = most_speed.max(rate);
            most_change = most_change.max((rate - speed).abs());
            if k == 960 {
                let behind_s = (setpoint - now) / 0.4;
                assert!((behind_s - 0.03).abs() < 1.1e-3, "one and a half periods behind: {behind_s} s");
            }
            (value, speed) = (now, rate);
            if k < 1000 {
                assert!((rate - spline.speed).abs() < 1e-15 && most_change <= 1e-6 * (1.0 + 1e-9), "acceleration {} at {k}", most_change * 1e6);
            }
        }
        assert!(most_speed <= 0.4e-3 * (1.0 + 1e-9));
        assert_eq!((value, speed), (setpoint, 0.0), "it ends at the last set-point, at rest");
    }

    #[test]
    fn a_spline_keeps_to_its_bounds_and_says_so() {
        let mut spline = Spline::default();
        let bounds = Bounds { position_min: -1.0, position_max: 0.5, step_max: 0.002, change_max: 1e6 };
        assert_eq!(spline.advance(0.0, 20, bounds), (0.0, 0.0, false));
        let (mut value, mut held) = (0.0, 0);
        for _ in 0..1000 {
            let (now, speed, limited) = spline.advance(3.0, 20, bounds);
            assert!(speed.abs() <= 0.002 + 1e-15 && now <= 0.5 + 1e-12);
            (value, held) = (now, held + i32::from(limited));
        }
        assert_eq!((value, held), (0.5, 1000));
        // Starting outside its range: it stays until it is commanded back, and moves no further out.
        let mut outside = Spline::at(0.7);
        assert_eq!(outside.advance(0.7, 20, bounds), (0.7, 0.0, false));
        assert_eq!(outside.advance(0.9, 20, bounds), (0.7, 0.0, true));
        assert!(outside.advance(0.6, 20, bounds).0 < 0.7);
    }

    #[test]
    fn a_shift_moves_nothing() {
        let mut spline = Spline::at(1.0);
        spline.advance(1.0, 20, WIDE);
        spline.shift(-0.25);
        assert_eq!(spline.advance(0.75, 20, WIDE), (0.75, 0.0, false));
        assert_eq!(spline.advance(1.0, 1, WIDE).0, 1.0, "without interpolation it is the set-point");
    }

    #[test]
    fn without_interpolation_it_is_the_setpoint() {
        let mut reference = Reference::default();
        reference.advance(0.0, 1);
        assert_eq!(reference.advance(2.0, 1).0, 2.0);
        assert_eq!(reference.advance(3.0, 0).0, 3.0);
    }
}
