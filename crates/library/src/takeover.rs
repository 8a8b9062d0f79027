// SPDX-License-Identifier: Apache-2.0
//! Takeover of a motion by another one, from the position, speed and acceleration of its last set-point.
//!
//! With each set-point, a generator stores its speed, its acceleration, and the time of storing. The next generator continues from that
//! state, so neither speed nor acceleration has a step. If the last set-point is older than a cycle, no generator leads the joint: its
//! servo is at rest, or brakes by itself and reports its distance past that set-point, and its speed.
use crate::motion::Motion;
use crate::online::State;
use crate::profile::{JOINTS_MAX, Limits};
use crate::reference::Braking;
use crate::span::Span;
use opengpac::Invocation;

/// Age in cycles above which a set-point no longer leads a joint.
const CYCLES: f64 = 1.5;

/// Last set-points of the joints, one element per joint.
#[derive(Clone, Copy, Debug)]
pub struct Last<'a> {
    pub position: &'a [f64],
    /// Speed at which the servos move the joints.
    pub servo_velocity: &'a [f64],
    pub velocity: &'a [f64],
    pub acceleration: &'a [f64],
    /// Time at which the set-points were stored, ns of the system clock.
    pub time_ns: &'a [i64],
    /// State of the servos that brake joints without a generator, in the layout of [`Braking`].
    pub braking: &'a [[f64; 4]],
}

/// Returns the last set-points of the first `n` joints of a block that has the inputs of a takeover, `start` to `braking`.
macro_rules! last_setpoints {
    ($block:expr, $n:expr) => {
        $crate::takeover::Last {
            position: &$block.start[..$n],
            servo_velocity: &$block.start_velocity[..$n],
            velocity: &$block.last_velocity[..$n],
            acceleration: &$block.last_acceleration[..$n],
            time_ns: &$block.last_time[..$n],
            braking: &$block.braking[..$n],
        }
    };
}
pub(crate) use last_setpoints;

/// Time without a new set-point after which a braking servo counts as stalled.
const BRAKING_S: f64 = 0.1;

/// State of the joints when a motion begins, and the time by which its first set-point is ahead.
#[derive(Clone, Copy, Debug)]
pub struct MotionStart {
    pub motion: Motion,
    pub ahead_s: f64,
}

impl Last<'_> {
    /// Returns the state from which to continue at `now_ns`, for a generator with a cycle of `cycle_s`; `None` if a number is not finite.
    pub fn begin(&self, now_ns: i64, cycle_s: f64) -> Option<MotionStart> {
        let mut states = [State::default(); JOINTS_MAX];
        let mut ahead_s = None;
        for (i, state) in states[..self.position.len()].iter_mut().enumerate() {
            *state = self.state(i, now_ns, cycle_s);
            if !(state.position.is_finite() && state.velocity.is_finite() && state.acceleration.is_finite()) {
                return None;
            }
            if let Some(age_s) = self.age_s(i, now_ns, cycle_s)
                && !state.is_at_rest()
            {
                ahead_s = Some(age_s.max(ahead_s.unwrap_or(0.0)));
            }
        }
        // A set-point of this very instant is replaced by the one a cycle ahead; one of a servo is followed.
        let is_braking = (0..self.position.len()).any(|i| self.is_braking(i));
        let ahead_s = ahead_s.filter(|s| *s > 0.0 || is_braking).unwrap_or(cycle_s);
        Some(MotionStart { motion: Motion::of(&states[..self.position.len()]), ahead_s })
    }

    /// Returns true if a joint is moving, or is at rest away from its last set-point.
    pub fn is_moving(&self, now_ns: i64, cycle_s: f64) -> bool {
        (0..self.position.len()).any(|i| !self.state(i, now_ns, cycle_s).is_at_rest() || (self.is_braking(i) && self.braking[i][0] != 0.0))
    }

    /// Returns the state of joint `i`.
    pub fn state(&self, i: usize, now_ns: i64, cycle_s: f64) -> State {
        let is_led = self.age_s(i, now_ns, cycle_s).is_some();
        if self.is_braking(i) {
            let Braking { distance, velocity, acceleration, .. } = Braking::of(self.braking[i]);
            let there = State { position: self.position[i] + distance, velocity, acceleration };
            let servo = State { velocity: self.servo_velocity[i], acceleration: 0.0, ..there };
            return if is_led || there.is_at_rest() { there } else { servo };
        }
        let (velocity, acceleration) = if is_led { (self.velocity[i], self.acceleration[i]) } else { (self.servo_velocity[i], 0.0) };
        State { position: self.position[i], velocity, acceleration }
    }

    /// Returns true if the servo of joint `i` leads it by itself because no set-points arrived.
    fn is_braking(&self, i: usize) -> bool {
        let since_ns = Braking::of(self.braking[i]).time_ns;
        since_ns != 0 && since_ns > self.time_ns[i]
    }

    /// Returns the age of the set-point of joint `i`, if it still leads its servo.
    fn age_s(&self, i: usize, now_ns: i64, cycle_s: f64) -> Option<f64> {
        let (since_ns, most_s) = if self.is_braking(i) { (Braking::of(self.braking[i]).time_ns, BRAKING_S) } else { (self.time_ns[i], CYCLES * cycle_s) };
        let age_s = now_ns.checked_sub(since_ns)? as f64 * 1e-9;
        (0.0..=most_s).contains(&age_s).then_some(age_s)
    }
}

/// Joints that are braked to rest before a motion that begins at rest: each on its own, from the state in which it was left.
#[derive(Clone, Copy, Debug, Default)]
pub struct Brake {
    motion: Motion,
    span: Span,
    stage: Stage,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    #[default]
    New,
    Braking,
    AtRest,
    /// No joint needs braking.
    Idle,
}

/// Set-points of one cycle, with their speeds and accelerations.
#[derive(Clone, Copy, Debug)]
pub struct BrakingSetpoints {
    pub setpoint: [f64; JOINTS_MAX],
    pub velocity: [f64; JOINTS_MAX],
    pub acceleration: [f64; JOINTS_MAX],
    pub is_at_rest: bool,
}

impl Brake {
    /// Advances by one cycle. Returns `None` if no joint is left to brake and `has_plan` is true, or if no joint had to be braked at all.
    /// Without a plan, the joints stay at rest.
    pub fn step(&mut self, last: &Last, acceleration: &[f64], jerk: &[f64], cycle_s: f64, has_plan: bool, invocation: &Invocation) -> Option<BrakingSetpoints> {
        let passed = self.span.pass(invocation);
        match self.stage {
            Stage::New => {
                let moving = last.is_moving(invocation.now_ns, cycle_s);
                let are_limits = acceleration.iter().chain(jerk).all(|limit| limit.is_finite() && *limit > 0.0);
                let begun = last.begin(invocation.now_ns, cycle_s).filter(|_| moving && are_limits);
                let Some(begun) = begun else {
                    self.stage = Stage::Idle;
                    return None;
                };
                (self.motion, self.stage) = (begun.motion, Stage::Braking);
                let limits: [Limits; JOINTS_MAX] = std::array::from_fn(|i| {
                    let (acceleration, jerk) = (acceleration.get(i).copied().unwrap_or(1.0), jerk.get(i).copied().unwrap_or(1.0));
                    Limits { speed: f64::INFINITY, acceleration, jerk }
                });
                self.motion.stop(&limits[..acceleration.len()]);
                self.motion.advance(begun.ahead_s);
            }
            Stage::Braking => self.motion.advance(passed.cycle_s()),
            Stage::AtRest if !has_plan => {}
            Stage::AtRest | Stage::Idle => {
                self.stage = Stage::Idle;
                return None;
            }
        }
        let is_at_rest = self.motion.left_s() == 0.0;
        if is_at_rest {
            self.stage = Stage::AtRest;
        }
        let states: [State; JOINTS_MAX] = std::array::from_fn(|i| if i < last.position.len() { self.motion.state(i) } else { State::default() });
        Some(BrakingSetpoints {
            setpoint: states.map(|s| s.position),
            velocity: states.map(|s| s.velocity),
            acceleration: states.map(|s| s.acceleration),
            is_at_rest,
        })
    }
}

/// Last three set-points of the joints, for generators without a closed form of speed and acceleration.
#[derive(Clone, Copy, Debug)]
pub struct Tail {
    before: [f64; JOINTS_MAX],
    step: [f64; JOINTS_MAX],
    count: u32,
}

impl Default for Tail {
    fn default() -> Tail {
        Tail { before: [0.0; JOINTS_MAX], step: [0.0; JOINTS_MAX], count: 0 }
    }
}

impl Tail {
    /// Adds the set-points of one cycle. The speed and acceleration of each joint at its end are those of the parabola through the last
    /// three, or 0 if the motion `rests`. A motion that continues from that state has no larger differences than the current one.
    pub fn push(&mut self, setpoint: &[f64], cycle_s: f64, rests: bool, velocity: &mut [f64], acceleration: &mut [f64]) {
        for (i, now) in setpoint.iter().enumerate() {
            let step = if self.count == 0 { 0.0 } else { now - self.before[i] };
            let change = if self.count == 0 { 0.0 } else { step - self.step[i] };
            (self.before[i], self.step[i]) = (*now, step);
            (velocity[i], acceleration[i]) = if cycle_s > 0.0 && !rests { ((step + change / 2.0) / cycle_s, change / (cycle_s * cycle_s)) } else { (0.0, 0.0) };
        }
        self.count = self.count.saturating_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last(time_ns: &i64) -> Last<'_> {
        Last { position: &[1.0], servo_velocity: &[0.1], velocity: &[0.3], acceleration: &[-2.0], time_ns: std::slice::from_ref(time_ns), braking: &[[0.0; 4]] }
    }

    #[test]
    fn a_setpoint_of_the_cycle_before_hands_over_its_state() {
        let begun = last(&100_000_000).begin(120_000_000, 0.02).expect("finite");
        assert_eq!(begun.motion.state(0), State { position: 1.0, velocity: 0.3, acceleration: -2.0 });
        assert!((begun.ahead_s - 0.02).abs() < 1e-12);
        assert!((last(&100_000_000).begin(107_000_000, 0.02).expect("finite").ahead_s - 0.007).abs() < 1e-12, "as old as it is");
    }

    #[test]
    fn an_old_setpoint_leaves_the_speed_of_the_servo() {
        for time_ns in [i64::MIN, 0, 500_000_000] {
            let begun = last(&time_ns).begin(120_000_000, 0.02).expect("finite");
            assert_eq!((begun.motion.state(0).velocity, begun.motion.state(0).acceleration, begun.ahead_s), (0.1, 0.0, 0.02));
        }
        assert!(Last { position: &[f64::NAN], ..last(&0) }.begin(0, 0.02).is_none());
    }

    #[test]
    fn a_servo_that_brakes_hands_over_where_it_leads_to() {
        let (at, braking) = (100_000_000, [[0.25, 0.2, -5.0, 1e8]]);
        let state = State { position: 1.25, velocity: 0.2, acceleration: -5.0 };
        for (now_ns, ahead_s) in [(112_000_000, 0.012), (at, 0.0)] {
            let begun = Last { braking: &braking, ..last(&80_000_000) }.begin(now_ns, 0.02).expect("finite");
            assert_eq!(begun.motion.state(0), state);
            assert!((begun.ahead_s - ahead_s).abs() < 1e-12, "{} s", begun.ahead_s);
        }
        let rests = Last { braking: &[[0.25, 0.0, 0.0, 1e8]], ..last(&80_000_000) };
        assert!(rests.is_moving(at, 0.02), "the next motion does not begin at the last set-point");
        assert_eq!(rests.begin(i64::MAX, 0.02).expect("finite").motion.state(0), State { position: 1.25, ..State::default() });
        let newer = Last { braking: &braking, ..last(&110_000_000) }.begin(112_000_000, 0.02).expect("finite");
        assert_eq!(newer.motion.state(0).position, 1.0, "a newer set-point leads");
    }

    #[test]
    fn the_last_three_setpoints_give_speed_and_acceleration() {
        let (mut tail, mut v, mut a) = (Tail::default(), [0.0], [0.0]);
        for k in 0..5 {
            let t = 0.02 * f64::from(k);
            tail.push(&[1.0 + 0.5 * t + 1.5 * t * t], 0.02, false, &mut v, &mut a);
        }
        assert!((v[0] - (0.5 + 3.0 * 0.08)).abs() < 1e-9 && (a[0] - 3.0).abs() < 1e-9);
        tail.push(&[1.1], 0.02, true, &mut v, &mut a);
        assert_eq!((v[0], a[0]), (0.0, 0.0), "nothing is to be braked at the end");
    }
}
