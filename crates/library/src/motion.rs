// SPDX-License-Identifier: Apache-2.0
//! Motion of several joints from any state, shared by the motion generators.
//!
//! From rest, the joints move along a straight line in joint space: one coordinate runs from 0 to 1, with the highest speed, acceleration
//! and jerk that the limits of all joints allow. From a moving state, each joint has its own motion, and joints that would arrive earlier
//! are slowed down, so that all arrive together if they can. Either motion can be replanned at any time from its current state: for a new
//! goal, a different speed, or a stop.
use crate::online::{Profile, State};
use crate::profile::{JOINTS_MAX, Limits};

/// Motion of the joints.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    joints: usize,
    /// Profile of each joint; for a motion along a line, only the first one is used, for the line.
    profiles: [Profile; JOINTS_MAX],
    /// True if the motion is along a line between these positions.
    is_line: bool,
    from: [f64; JOINTS_MAX],
    to: [f64; JOINTS_MAX],
    /// Time since planning, s.
    time_s: f64,
}

impl Motion {
    /// Creates a motion with the joints in these states; they are not braked until a motion is planned.
    pub fn of(states: &[State]) -> Motion {
        let mut motion = Motion { joints: states.len(), ..Motion::default() };
        for (profile, state) in motion.profiles.iter_mut().zip(states) {
            *profile = Profile::beginning(if state.is_at_rest() { State { position: state.position, ..State::default() } } else { *state });
        }
        motion
    }

    /// Returns the state of joint `i`.
    pub fn state(&self, i: usize) -> State {
        if !self.is_line {
            return self.profiles[i].at(self.time_s);
        }
        let s = self.profiles[0].at(self.time_s);
        let way = self.to[i] - self.from[i];
        let position = if s.position == 1.0 { self.to[i] } else { self.from[i] + way * s.position };
        State { position, velocity: way * s.velocity, acceleration: way * s.acceleration }
    }

    /// Advances the time.
    pub fn advance(&mut self, span_s: f64) {
        self.time_s += span_s;
    }

    /// Returns the time until the end of the motion.
    pub fn left_s(&self) -> f64 {
        let count = if self.is_line { 1 } else { self.joints };
        let most_s = self.profiles[..count].iter().map(Profile::duration_s).fold(0.0, f64::max);
        (most_s - self.time_s).max(0.0)
    }

    /// Plans a motion to `goals` from the current state. The slices have one element per joint; the caller ensures that numbers are
    /// finite and limits positive.
    pub fn go(&mut self, goals: &[f64], limits: &[Limits]) {
        let states = self.states();
        let n = self.joints;
        if self.is_line && self.to[..n] == *goals {
            let s = self.profiles[0].at(self.time_s);
            self.begin_line(s, limits);
        } else if states[..n].iter().all(State::is_at_rest) {
            self.is_line = true;
            for i in 0..n {
                (self.from[i], self.to[i]) = (states[i].position, goals[i]);
            }
            self.begin_line(State::default(), limits);
        } else {
            self.is_line = false;
            let fastest = |i: usize| Profile::to(states[i], goals[i], limits[i]).duration_s();
            let longest_s = (0..n).map(fastest).fold(0.0, f64::max);
            for i in 0..n {
                self.profiles[i] = Profile::to_in(states[i], goals[i], limits[i], longest_s);
            }
        }
        self.time_s = 0.0;
    }

    /// Plans a motion of each joint on its own; `profile` receives the joint's number and state.
    pub fn each(&mut self, mut profile: impl FnMut(usize, State) -> Profile) {
        let states = self.states();
        self.is_line = false;
        for (i, state) in states[..self.joints].iter().enumerate() {
            self.profiles[i] = profile(i, *state);
        }
        self.time_s = 0.0;
    }

    /// Brakes to rest as quickly as the limits of acceleration and jerk allow; a motion along a line stays on it.
    pub fn stop(&mut self, limits: &[Limits]) {
        if self.is_line {
            let s = self.profiles[0].at(self.time_s);
            // At its end there is nothing to stop, and the end stays exact.
            if s.position < 1.0 {
                self.profiles[0] = Profile::stop(s, self.line_limits(limits));
                self.time_s = 0.0;
            }
        } else {
            self.each(|i, state| Profile::stop(state, limits[i]));
        }
    }

    fn states(&self) -> [State; JOINTS_MAX] {
        std::array::from_fn(|i| if i < self.joints { self.state(i) } else { State::default() })
    }

    fn begin_line(&mut self, s: State, limits: &[Limits]) {
        self.profiles[0] = Profile::to(s, 1.0, self.line_limits(limits));
    }

    /// Returns the limits of the coordinate along the line. If the line has zero length, they are arbitrary.
    fn line_limits(&self, limits: &[Limits]) -> Limits {
        let mut most = Limits { speed: f64::INFINITY, acceleration: f64::INFINITY, jerk: f64::INFINITY };
        for (i, limit) in limits.iter().enumerate() {
            let way = (self.to[i] - self.from[i]).abs();
            if way > 0.0 {
                most.speed = most.speed.min(limit.speed / way);
                most.acceleration = most.acceleration.min(limit.acceleration / way);
                most.jerk = most.jerk.min(limit.jerk / way);
            }
        }
        if most.speed.is_finite() { most } else { Limits { speed: 1e6, acceleration: 1e9, jerk: 1e12 } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(positions: &[f64], velocities: &[f64]) -> Motion {
        let states: Vec<State> =
            positions.iter().zip(velocities).map(|(position, velocity)| State { position: *position, velocity: *velocity, acceleration: 0.0 }).collect();
        Motion::of(&states)
    }

    const LIMITS: [Limits; 2] = [Limits { speed: 1.0, acceleration: 2.0, jerk: 20.0 }, Limits { speed: 0.5, acceleration: 4.0, jerk: 10.0 }];

    /// Advances to the end in steps of 1 ms, checking that neither position nor speed jumps. Returns the duration.
    fn run(motion: &mut Motion) -> f64 {
        let mut steps = 0;
        let mut before: Vec<State> = (0..2).map(|i| motion.state(i)).collect();
        while motion.left_s() > 0.0 {
            motion.advance(1e-3);
            steps += 1;
            for i in 0..2 {
                let now = motion.state(i);
                assert!((now.position - before[i].position).abs() <= 1.01e-3 * LIMITS[i].speed, "joint {i} jumps");
                assert!((now.velocity - before[i].velocity).abs() <= 1.01e-3 * LIMITS[i].acceleration, "the speed of joint {i} jumps");
                before[i] = now;
            }
        }
        f64::from(steps) * 1e-3
    }

    #[test]
    fn from_rest_the_joints_go_along_a_line() {
        let mut motion = at(&[0.0, 1.0], &[0.0, 1e-12]);
        motion.go(&[1.0, 0.0], &LIMITS);
        motion.advance(1.0);
        assert!((motion.state(0).position + motion.state(1).position - 1.0).abs() < 1e-12);
        run(&mut motion);
        assert_eq!((motion.state(0).position, motion.state(1).position), (1.0, 0.0));
    }

    #[test]
    fn a_new_goal_on_the_way_is_reached_without_a_jump_and_together() {
        let mut motion = at(&[0.0, 1.0], &[0.0, 0.0]);
        motion.go(&[1.0, 0.0], &LIMITS);
        motion.advance(0.8);
        motion.go(&[-0.5, 0.2], &LIMITS);
        assert!((motion.profiles[0].duration_s() - motion.profiles[1].duration_s()).abs() < 0.5);
        run(&mut motion);
        assert_eq!((motion.state(0).position, motion.state(1).position), (-0.5, 0.2));
    }

    #[test]
    fn a_stop_stays_on_the_line_and_going_on_ends_at_the_goal() {
        let mut motion = at(&[0.0, 1.0], &[0.0, 0.0]);
        motion.go(&[1.0, 0.0], &LIMITS);
        motion.advance(0.9);
        motion.stop(&LIMITS);
        run(&mut motion);
        let held = motion.state(0);
        assert!(held.velocity == 0.0 && held.position > 0.1 && held.position < 0.9);
        assert!((held.position + motion.state(1).position - 1.0).abs() < 1e-12);
        motion.go(&[1.0, 0.0], &LIMITS);
        run(&mut motion);
        assert_eq!((motion.state(0).position, motion.state(1).position), (1.0, 0.0));
    }

    #[test]
    fn what_moves_already_goes_on_from_its_speed() {
        let mut motion = at(&[0.0, 0.0], &[0.9, -0.3]);
        motion.stop(&LIMITS);
        assert_eq!(motion.state(0), State { position: 0.0, velocity: 0.9, acceleration: 0.0 });
        run(&mut motion);
        assert!(motion.state(0).position > 0.2 && motion.state(1).position < 0.0);
    }
}
