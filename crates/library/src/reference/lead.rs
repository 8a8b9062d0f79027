// SPDX-License-Identifier: Apache-2.0
//! Set-points that lead the reference of a servo: those of a generator or, if no new one arrives in time, those of the servo itself,
//! which brakes.
//!
//! A generator may be removed while its joint moves, because another part of a composition has ended it, its processor has been lost, or
//! its block has faulted. Its last set-point includes its speed and acceleration. From that state, the servo itself generates set-points,
//! at the same pace, until they are at rest, within the acceleration and jerk of the joint. They continue the curve of the earlier
//! set-points, so the reference has no step. A set-point without a speed is a position to hold: the reference comes to rest there.
//!
//! After a gap that exceeds the maximum, the servo brakes from the current position of the joint and ignores the set-points of motions
//! from before the gap. When the joint is at rest, a motion that begins from there is followed immediately, but any other set-point is
//! followed only after some time.
use super::ReferenceInputs;
use crate::online::{State, towards};
use crate::profile::Limits;

/// State of a servo that brakes by itself: its distance past the last set-point, and its motion there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Braking {
    pub distance: f64,
    pub velocity: f64,
    pub acceleration: f64,
    /// Time at which the servo generated this set-point, ns of the system clock; 0 if the set-points of a generator lead.
    pub time_ns: i64,
}

impl Braking {
    /// Returns the numbers in the format of a port. A double can represent clock times only to within 256 ns.
    pub fn numbers(self) -> [f64; 4] {
        [self.distance, self.velocity, self.acceleration, self.time_ns as f64]
    }

    /// Parses the numbers of a port.
    pub fn of([distance, velocity, acceleration, time_ns]: [f64; 4]) -> Braking {
        Braking { distance, velocity, acceleration, time_ns: time_ns as i64 }
    }
}

/// Source of the set-points that a reference follows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lead {
    /// Last set-point as it was stored, and its time.
    seen: f64,
    seen_ns: i64,
    /// Current set-point, with its speed and acceleration.
    now: State,
    /// Number of invocations until the next set-point is due.
    left: u32,
    /// Time at which the servo itself generated the set-point `now`.
    braked_ns: Option<i64>,
    /// Set while the servo brakes by itself because of a gap.
    alone: Option<Alone>,
}

/// State of a servo that brakes to rest by itself after a gap in time.
#[derive(Clone, Copy, Debug)]
struct Alone {
    lost_s: f64,
    /// Time since the servo came to rest.
    rested_s: f64,
    is_told: bool,
}

/// A set-point for the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Next {
    pub position: f64,
    /// Declared speed, per second; 0 if none is declared.
    pub velocity: f64,
    /// True if the set-point is the first one of a generator after the servo has braked.
    pub is_return: bool,
    /// True if the set-point does not continue the servo's own: the generator was late, and the time is lost.
    pub is_late: bool,
    /// Time by which the set-point is younger than the previous one, if both are from the generator, s; 0 if that is not known.
    pub apart_s: f64,
}

/// Maximum difference between a declared speed and the speed of the reference, which lags by one and a half cycles, expressed as a change
/// of speed over this number of cycles.
const LAG: f64 = 3.0;
/// Time for which a joint at rest after a gap ignores set-points that do not continue its own, s. The motions that stored them end in the
/// meantime.
const REST_S: f64 = 0.5;

impl Lead {
    /// Starts with the stored set-point, as a position to hold.
    pub fn begin(&mut self, led: &ReferenceInputs) {
        *self = Lead { seen: led.setpoint, seen_ns: led.time_ns, now: State { position: led.setpoint, ..State::default() }, ..Lead::default() };
    }

    /// Shifts the origin of positions; the set-point is shifted from this invocation on.
    pub fn shift(&mut self, by: f64, led: &ReferenceInputs) {
        self.seen = led.setpoint;
        self.now.position = if self.braked_ns.is_some() { self.now.position + by } else { led.setpoint };
    }

    /// Returns the set-point of this invocation. `interpolation` is the number of invocations between two set-points, `cycle_s` the time
    /// between two invocations; the reference moves at `velocity`.
    pub fn next(&mut self, led: &ReferenceInputs, interpolation: u32, cycle_s: f64, velocity: f64, now_ns: i64) -> Next {
        let (mut is_return, mut is_late, mut apart_s) = (false, false, 0.0);
        let span_s = f64::from(interpolation) * cycle_s;
        let is_new = led.setpoint != self.seen || led.time_ns != self.seen_ns;
        if is_new && self.passes_over(led, span_s) {
            // Ignored. The servo's own set-point remains the newer of the two.
            (self.seen, self.seen_ns) = (led.setpoint, led.time_ns);
            self.braked_ns = Some(now_ns.max(led.time_ns.saturating_add(1)));
        } else if is_new {
            self.alone = None;
            is_return = self.braked_ns.is_some();
            is_late = is_return && !self.is_near(led, span_s);
            if self.seen_ns > 0 {
                apart_s = led.time_ns.saturating_sub(self.seen_ns).max(0) as f64 * 1e-9;
            }
            self.now = declared(led, velocity, LAG * span_s * led.acceleration_max, led.time_ns != self.seen_ns);
            (self.seen, self.seen_ns, self.left, self.braked_ns) = (led.setpoint, led.time_ns, interpolation, None);
        }
        if self.left == 0 && !self.now.is_at_rest() {
            self.brake(led, span_s);
            (self.left, self.braked_ns) = (interpolation, Some(now_ns.max(self.seen_ns.saturating_add(1))));
        } else if self.left == 0
            && let Some(alone) = &mut self.alone
        {
            alone.rested_s += cycle_s;
        }
        self.left = self.left.saturating_sub(1);
        Next { position: self.now.position, velocity: self.now.velocity, is_return, is_late, apart_s }
    }

    /// Makes the servo brake by itself from a state, because `lost_s` was lost.
    pub fn leave(&mut self, led: &ReferenceInputs, from: State, interpolation: u32, lost_s: f64, now_ns: i64) {
        *self = Lead {
            seen: led.setpoint,
            seen_ns: led.time_ns,
            now: from,
            left: interpolation,
            braked_ns: Some(now_ns.max(led.time_ns.saturating_add(1))),
            alone: Some(Alone { lost_s, rested_s: 0.0, is_told: false }),
        };
    }

    /// Returns true if the current set-point is at rest.
    pub fn is_at_rest(&self) -> bool {
        self.now.is_at_rest()
    }

    /// Returns true if the servo brakes by itself because of a gap.
    pub fn is_alone(&self) -> bool {
        self.alone.is_some()
    }

    /// Returns the lost time, s, only once: when the reference is at rest after the gap, and the joint is stationary or has failed to
    /// become so in time.
    pub fn rested(&mut self, stands_still: bool) -> Option<f64> {
        let is_due = |alone: &&mut Alone| alone.rested_s > 0.0 && (stands_still || alone.rested_s >= REST_S) && !alone.is_told;
        let alone = self.alone.as_mut().filter(is_due)?;
        alone.is_told = true;
        Some(alone.lost_s)
    }

    /// Returns true if a set-point is ignored because it may belong to a motion from before the gap: until the joint has come to rest,
    /// and for a further [`REST_S`] if the set-point does not continue the servo's own.
    fn passes_over(&self, led: &ReferenceInputs, span_s: f64) -> bool {
        self.alone.is_some_and(|alone| alone.rested_s < REST_S && !(alone.is_told && self.is_near(led, span_s)))
    }

    /// Returns true if a set-point continues the servo's own: it lies on the path of the next `span_s`, or can be reached within the
    /// acceleration.
    fn is_near(&self, led: &ReferenceInputs, span_s: f64) -> bool {
        let (from, to) = (self.now.position, self.now.position + self.now.velocity * span_s);
        let room = led.acceleration_max * span_s * span_s;
        (from.min(to) - room..=from.max(to) + room).contains(&led.setpoint)
    }

    /// Returns the state from which the next motion takes over.
    pub fn braking(&self) -> Braking {
        match self.braked_ns {
            Some(time_ns) => Braking { distance: self.now.position - self.seen, velocity: self.now.velocity, acceleration: self.now.acceleration, time_ns },
            None => Braking::default(),
        }
    }

    /// Advances by one set-point towards rest, within the range.
    fn brake(&mut self, led: &ReferenceInputs, span_s: f64) {
        let next = towards(self.now, 0.0, Limits { speed: led.speed_max, acceleration: led.acceleration_max, jerk: led.jerk_max }, span_s);
        let (least, most) = led.range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let kept = next.position.clamp(least.min(self.now.position), most.max(self.now.position));
        let rests = kept != next.position || next.is_at_rest();
        self.now = if rests { State { position: kept, ..State::default() } } else { next };
    }
}

/// Returns the state declared by a set-point. If it declares none, or a state that cannot be braked, the state is at rest. The declared
/// speed may differ from the reference's by at most `most`, so that a speed in a wrong unit has no effect.
fn declared(led: &ReferenceInputs, velocity: f64, most: f64, is_declared: bool) -> State {
    let rest = State { position: led.setpoint, ..State::default() };
    let limits = [led.acceleration_max, led.jerk_max];
    let numbers = [led.velocity, led.acceleration, led.setpoint, velocity, most];
    if !is_declared || !limits.iter().all(|limit| limit.is_finite() && *limit > 0.0) || !numbers.iter().all(|x| x.is_finite()) {
        return rest;
    }
    let acceleration = led.acceleration.clamp(-led.acceleration_max, led.acceleration_max);
    State { velocity: led.velocity.clamp(velocity - most, velocity + most), acceleration, ..rest }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn led(position: f64, velocity: f64, acceleration: f64, time_ns: i64) -> ReferenceInputs {
        ReferenceInputs {
            setpoint: position,
            velocity,
            acceleration,
            time_ns,
            position: 0.0,
            offset: 0.0,
            range: Some((-1.0, 1.0)),
            speed_max: 3.0,
            acceleration_max: 5.0,
            jerk_max: 50.0,
            ..ReferenceInputs::default()
        }
    }

    /// Runs a lead whose set-point at 1 ms is the last one, `last`. Returns the lead, and its position in each of 2000 invocations.
    fn left_alone(last: ReferenceInputs) -> (Lead, Vec<f64>) {
        let mut lead = Lead::default();
        lead.begin(&led(0.0, 0.0, 0.0, 0));
        let ways = (0..2000).map(|k| lead.next(&last, 20, 1e-3, last.velocity, k).position).collect();
        (lead, ways)
    }

    #[test]
    fn a_setpoint_that_moves_and_is_the_last_is_braked_within_its_limits() {
        let (lead, ways) = left_alone(led(0.0, 0.5, 2.0, 1));
        assert!(ways[..20].iter().all(|q| *q == 0.0), "the next one is due after 20 invocations");
        let knots: Vec<f64> = ways.iter().copied().step_by(20).collect();
        for three in knots.windows(3) {
            let acceleration = (three[2] - 2.0 * three[1] + three[0]) / 4e-4;
            assert!((-5.0 - 1e-9..=2.0 + 1.0).contains(&acceleration), "{acceleration} rad/s²");
        }
        let braking = lead.braking();
        assert!(braking.distance > 0.05 && braking.distance < 0.1, "{braking:?}");
        assert_eq!((braking.velocity, braking.acceleration, *ways.last().expect("many")), (0.0, 0.0, braking.distance));
    }

    #[test]
    fn one_that_rests_says_nothing_or_cannot_be_braked_is_where_it_leads() {
        let ends = |last: ReferenceInputs| *left_alone(last).1.last().expect("many");
        assert_eq!(ends(led(0.3, 0.0, 0.0, 1)), 0.3);
        assert_eq!(ends(led(0.3, 0.5, 0.0, 0)), 0.3, "its time is that of another one");
        assert_eq!(ends(led(0.3, f64::NAN, 0.0, 1)), 0.3);
        assert_eq!(ends(ReferenceInputs { jerk_max: 0.0, ..led(0.3, 0.5, 0.0, 1) }), 0.3);
        assert_eq!(ends(led(0.99, 1.0, 0.0, 1)), 1.0, "the range is kept");
    }

    #[test]
    fn a_speed_in_another_unit_leads_nowhere() {
        let mut lead = Lead::default();
        lead.begin(&led(0.0, 0.0, 0.0, 0));
        let ends = (0..3000).map(|k| lead.next(&led(0.1, 57.0, 0.0, 1), 20, 1e-3, 0.0, k).position).fold(0.0, f64::max);
        assert!(ends < 0.15, "{ends} rad");
    }

    #[test]
    fn the_next_setpoint_leads_again_and_a_new_origin_moves_nothing() {
        let (mut lead, ways) = left_alone(led(0.2, 0.5, 0.0, 1));
        let end = *ways.last().expect("many");
        let moved = led(0.7, 0.5, 0.0, 1);
        lead.shift(0.5, &moved);
        assert_eq!(lead.next(&moved, 20, 1e-3, 0.0, 9), Next { position: end + 0.5, velocity: 0.0, is_return: false, is_late: false, apart_s: 0.0 });
        assert!((lead.braking().distance - (end - 0.2)).abs() < 1e-15);
        assert_eq!(lead.next(&led(0.6, 0.0, 0.0, 1), 20, 1e-3, 0.0, 10), Next { position: 0.6, velocity: 0.0, is_return: true, is_late: true, apart_s: 0.0 });
        assert_eq!(lead.braking(), Braking::default());
    }

    #[test]
    fn after_a_gap_it_passes_over_setpoints_that_lead_elsewhere_until_it_has_rested() {
        let mut lead = Lead::default();
        lead.begin(&led(0.0, 0.3, 0.0, 1));
        lead.leave(&led(0.0, 0.3, 0.0, 1), State { position: 0.4, velocity: 0.3, acceleration: 0.0 }, 20, 0.7, 1_000);
        let mut told = Vec::new();
        for k in 0..300i64 {
            let others = led(1e-3 * k as f64, 0.3, 0.0, 1_000 + k);
            assert!(lead.next(&others, 20, 1e-3, 0.3, 1_000 + k).position > 0.399, "it goes on from where the joint was");
            let braking = lead.braking();
            assert!(braking.time_ns > others.time_ns && braking.distance + others.setpoint > 0.399, "a motion that begins takes over from the servo");
            told.extend(lead.rested(k > 250));
        }
        assert_eq!(told, [0.7], "once, when the joint stands still");
        let near = led(lead.now.position + 1e-3, 0.05, 0.0, 2_000);
        let next = lead.next(&near, 20, 1e-3, 0.0, 2_001);
        assert_eq!((next.position, next.is_return, next.is_late), (near.setpoint, true, false), "a motion that begins there leads");
        lead.leave(&near, State { position: 0.4, ..State::default() }, 20, 0.7, 3_000);
        let far = |k: i64| led(0.1, 0.0, 0.0, 3_000 + k);
        assert!((0..500).all(|k| lead.next(&far(k), 20, 1e-3, 0.0, 3_000 + k).position == 0.4));
        assert_eq!((500..600).map(|k| lead.next(&far(k), 20, 1e-3, 0.0, 3_000 + k).position).last(), Some(0.1), "what goes on for so long leads again");
    }
}
