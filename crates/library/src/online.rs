// SPDX-License-Identifier: Apache-2.0
//! Motion of one coordinate from any state to rest at a goal, within limits of speed, acceleration and jerk.
//!
//! A *change of speed* has three phases: jerk, constant acceleration, and the opposite jerk; it has a closed form. A motion is a change
//! from the current speed to a speed v, a segment at v, and a change from v to rest (Haschke, Weitnauer and Ritter, *On-line planning of
//! time-optimal, jerk-limited trajectories*, 2008). If stopping immediately would end short of the goal, v is directed towards it,
//! otherwise away from it. v is the maximum that the limit and the distance allow; if there is no segment at v, it is found by bisection,
//! which works because the distance then increases with v. A motion from rest takes the shortest possible time. A motion from a moving
//! state may take longer if it is about to stop before its goal, because it never speeds up again while braking.
//!
//! The state may be beyond the limits (if a lower speed was requested): the motion then first returns to the limits, and stays within
//! them.
use crate::profile::Limits;

/// Position, velocity and acceleration of a coordinate: rad, rad/s, rad/s² (or the same in metres, or along a path).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    pub position: f64,
    pub velocity: f64,
    pub acceleration: f64,
}

/// Speed and acceleration below which a state is at rest: rad/s, rad/s² (or the same in metres).
const REST: f64 = 1e-9;

impl State {
    /// Returns true if neither speed nor acceleration differs from 0.
    pub fn is_at_rest(&self) -> bool {
        self.velocity.abs() < REST && self.acceleration.abs() < REST
    }
}

/// Returns the state after `span_s` of a motion to a velocity, which is reached in the shortest time that the acceleration and jerk
/// allow, and then kept.
pub fn towards(state: State, velocity: f64, limits: Limits, span_s: f64) -> State {
    let (mut now, mut left_s) = (state, span_s);
    for phase in change(state.velocity, state.acceleration, velocity, limits).phases {
        let span_s = left_s.min(phase.span_s);
        now = after(now, phase.jerk, span_s);
        left_s -= span_s;
    }
    if left_s > 0.0 { State { position: now.position + velocity * left_s, velocity, acceleration: 0.0 } } else { now }
}

/// Segment of constant jerk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Phase {
    span_s: f64,
    jerk: f64,
}

/// A motion that ends without acceleration, mostly at rest: seven phases. Before its start time its state is the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Profile {
    start: State,
    phases: [Phase; 7],
    end: f64,
    end_velocity: f64,
}

/// A change of speed: its phases, and the distance covered.
#[derive(Clone, Copy, Debug)]
struct Change {
    phases: [Phase; 3],
    way: f64,
}

/// Maximum number of bisections of an interval; a double has no more bits.
const HALVINGS: usize = 100;
/// Fraction of the distance within which the goal counts as reached.
const NEAR: f64 = 1e-12;

impl Profile {
    /// Returns an empty motion in the state from which a motion will start.
    pub fn beginning(state: State) -> Profile {
        // An endless phase without jerk: the state is that of its start until a motion is planned.
        let mut phases = [Phase::default(); 7];
        phases[0].span_s = f64::MAX;
        Profile { start: state, phases, end: state.position, end_velocity: 0.0 }
    }

    /// Returns the motion that brakes to rest as soon as possible.
    pub fn stop(state: State, limits: Limits) -> Profile {
        let change = change(state.velocity, state.acceleration, 0.0, limits);
        let [a, b, c] = change.phases;
        let phases = [a, b, c, Phase::default(), Phase::default(), Phase::default(), Phase::default()];
        Profile { start: state, phases, end: state.position + change.way, end_velocity: 0.0 }
    }

    /// Returns the motion that comes to rest at `goal`. The caller must have checked that all limits are positive and all numbers finite.
    pub fn to(state: State, goal: f64, limits: Limits) -> Profile {
        match Course::new(state, goal, limits) {
            None => Profile { end: goal, ..Profile::stop(state, limits) },
            Some(course) => course.profile(course.fastest()),
        }
    }

    /// Plans like [`Profile::to`], but takes `duration_s` if that is longer than the shortest time, by using a lower speed, so that
    /// several coordinates arrive together. From rest, it takes exactly that long. From a moving state, it may take longer if the
    /// duration lies between those of two ways of stopping, and a motion that only brakes to its goal cannot be made longer.
    pub fn to_in(state: State, goal: f64, limits: Limits, duration_s: f64) -> Profile {
        let fastest = Profile::to(state, goal, limits);
        match Course::new(state, goal, limits) {
            Some(course) if fastest.duration_s() < duration_s => course.profile(course.speed_for(duration_s)),
            _ => fastest,
        }
    }

    /// Returns the motion that passes `goal`, which lies ahead, without acceleration: at the speed `wanted`, or as near to it as the
    /// distance allows, but never above `most`. Returns `None` if the distance is too short to slow down to `most`.
    pub fn passing(state: State, goal: f64, wanted: f64, most: f64, limits: Limits) -> Option<Profile> {
        let way = goal - state.position;
        let to = |speed: f64| change(state.velocity, state.acceleration, speed, limits);
        let fits = |speed: f64| to(speed).way <= way;
        let wanted = wanted.min(most);
        let present = (state.velocity + state.acceleration * state.acceleration.abs() / (2.0 * limits.jerk)).max(0.0);
        let end = if fits(wanted) {
            wanted
        } else if present < wanted {
            fits(present).then(|| nearest(present, wanted, fits))?
        } else {
            let high = present.min(most);
            fits(high).then(|| nearest(high, wanted, fits))?
        };
        let way_by = |speed: f64| to(speed).way + change(speed, 0.0, end, limits).way;
        let speed = if end >= limits.speed { end } else { nearest(end, limits.speed, |speed| way_by(speed) <= way) };
        let (up, down) = (to(speed), change(speed, 0.0, end, limits));
        let rest = (way - up.way - down.way).max(0.0);
        let cruise = Phase { span_s: if speed > 0.0 { rest / speed } else { 0.0 }, jerk: 0.0 };
        let ([a, b, c], [d, e, f]) = (up.phases, down.phases);
        Some(Profile { start: state, phases: [a, b, c, cruise, d, e, f], end: goal, end_velocity: end })
    }

    /// Returns the duration.
    pub fn duration_s(&self) -> f64 {
        self.phases.iter().map(|phase| phase.span_s).sum()
    }

    /// Returns the end position.
    pub fn end(&self) -> f64 {
        self.end
    }

    /// Returns the speed at the end.
    pub fn end_velocity(&self) -> f64 {
        self.end_velocity
    }

    /// Returns the state at `time_s` after the start; after the duration has elapsed, this is exactly the end state.
    pub fn at(&self, time_s: f64) -> State {
        if time_s >= self.duration_s() {
            return State { position: self.end, velocity: self.end_velocity, acceleration: 0.0 };
        }
        let mut state = self.start;
        let mut left_s = time_s.max(0.0);
        for phase in &self.phases {
            let span_s = left_s.min(phase.span_s);
            state = after(state, phase.jerk, span_s);
            left_s -= span_s;
        }
        state
    }
}

/// Distance from the point where an immediate stop would end to the goal, and the direction in which it is positive.
struct Course {
    state: State,
    goal: f64,
    limits: Limits,
    /// 1 if the goal is ahead in the positive direction, -1 if in the negative one.
    sign: f64,
    velocity: f64,
    acceleration: f64,
    way: f64,
}

impl Course {
    /// Creates a course; returns `None` if stopping immediately ends at the goal.
    fn new(state: State, goal: f64, limits: Limits) -> Option<Course> {
        let way = goal - state.position;
        let rest = way - change(state.velocity, state.acceleration, 0.0, limits).way;
        if rest.abs() <= NEAR * way.abs().max(state.velocity.abs()).max(NEAR) {
            return None;
        }
        let sign = rest.signum();
        Some(Course { state, goal, limits, sign, velocity: sign * state.velocity, acceleration: sign * state.acceleration, way: sign * way })
    }

    /// Returns the distance covered by a motion that reaches this speed and then stops.
    fn way_by(&self, speed: f64) -> f64 {
        change(self.velocity, self.acceleration, speed, self.limits).way + change(speed, 0.0, 0.0, self.limits).way
    }

    /// Returns the maximum speed from which the motion can still stop at the goal.
    fn fastest(&self) -> f64 {
        let most = self.limits.speed;
        if self.way_by(most) <= self.way {
            return most;
        }
        // The speed after the acceleration is reduced to 0.
        let present = (self.velocity + self.acceleration * self.acceleration.abs() / (2.0 * self.limits.jerk)).clamp(0.0, most);
        let (mut low, mut high) = if self.way_by(present) <= self.way { (present, most) } else { (0.0, present) };
        for _ in 0..HALVINGS {
            let middle = low.midpoint(high);
            if middle <= low || middle >= high {
                break;
            }
            if self.way_by(middle) <= self.way { low = middle } else { high = middle }
        }
        low
    }

    /// Returns the speed at which the motion takes `duration_s`; at the maximum speed, it takes less.
    fn speed_for(&self, duration_s: f64) -> f64 {
        let (mut low, mut high): (f64, f64) = (0.0, self.fastest());
        for _ in 0..HALVINGS {
            let middle = low.midpoint(high);
            if middle <= low || middle >= high {
                break;
            }
            let is_slow = self.way_by(middle) <= self.way && self.profile(middle).duration_s() >= duration_s;
            if is_slow { low = middle } else { high = middle }
        }
        if low > 0.0 { low } else { high }
    }

    fn profile(&self, speed: f64) -> Profile {
        let (up, down) = (change(self.velocity, self.acceleration, speed, self.limits), change(speed, 0.0, 0.0, self.limits));
        let rest = (self.way - up.way - down.way).max(0.0);
        let cruise = Phase { span_s: if speed > 0.0 { rest / speed } else { 0.0 }, jerk: 0.0 };
        let [a, b, c] = up.phases;
        let [d, e, f] = down.phases;
        let phases = [a, b, c, cruise, d, e, f].map(|phase| Phase { jerk: self.sign * phase.jerk, ..phase });
        Profile { start: self.state, phases, end: self.goal, end_velocity: 0.0 }
    }
}

/// Returns the speed nearest to `ideal` that fits, by bisection from `sure`, which fits.
fn nearest(sure: f64, ideal: f64, fits: impl Fn(f64) -> bool) -> f64 {
    if fits(ideal) {
        return ideal;
    }
    let (mut good, mut bad) = (sure, ideal);
    for _ in 0..HALVINGS {
        let middle = good.midpoint(bad);
        if middle == good || middle == bad {
            break;
        }
        if fits(middle) { good = middle } else { bad = middle }
    }
    good
}

/// Computes the fastest change from a speed and acceleration to the speed `to` with zero acceleration. An acceleration beyond the limit
/// is first brought back to it.
fn change(velocity: f64, acceleration: f64, to: f64, limits: Limits) -> Change {
    let (most, jerk) = (limits.acceleration, limits.jerk);
    // Remaining change of speed after the acceleration is reduced to 0 as fast as possible.
    let left = to - (velocity + acceleration * acceleration.abs() / (2.0 * jerk));
    let sign = if left < 0.0 { -1.0 } else { 1.0 };
    let (present, rise) = (sign * acceleration, sign * (to - velocity));
    // Without a phase of constant acceleration the peak has jerk * rise = peak² - present² / 2.
    let free = (jerk * rise + present * present / 2.0).max(0.0).sqrt();
    let peak = free.min(most);
    let first_s = (peak - present).abs() / jerk;
    let gained = first_s * (present + peak) / 2.0 + peak * peak / (2.0 * jerk);
    let hold_s = if free > most { ((rise - gained) / peak).max(0.0) } else { 0.0 };
    let first = Phase { span_s: first_s, jerk: sign * jerk * (peak - present).signum() };
    let phases = [first, Phase { span_s: hold_s, jerk: 0.0 }, Phase { span_s: peak / jerk, jerk: -sign * jerk }];
    let start = State { position: 0.0, velocity, acceleration };
    let way = phases.iter().fold(start, |state, phase| after(state, phase.jerk, phase.span_s)).position;
    Change { phases, way }
}

/// Returns the state after a time of constant jerk.
fn after(state: State, jerk: f64, span_s: f64) -> State {
    let State { position, velocity, acceleration } = state;
    let t = span_s;
    State {
        position: position + t * (velocity + t * (acceleration / 2.0 + t * jerk / 6.0)),
        velocity: velocity + t * (acceleration + t * jerk / 2.0),
        acceleration: acceleration + t * jerk,
    }
}

#[cfg(test)]
mod tests;
