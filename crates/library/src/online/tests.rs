// SPDX-License-Identifier: Apache-2.0
//! Tests of the motion of one coordinate: its limits, its end, and a comparison with ruckig.
use super::*;
use proptest::prelude::*;

fn limits() -> impl Strategy<Value = Limits> {
    (0.05..4.0, 0.2..12.0, 1.0..120.0).prop_map(|(speed, acceleration, jerk)| Limits { speed, acceleration, jerk })
}

/// Returns a state within the limits: the speed stays within its limit even while the acceleration is reduced to 0.
fn within(limits: Limits, speed: f64, acceleration: f64) -> State {
    let velocity = speed * limits.speed;
    let room = |left: f64| (2.0 * limits.jerk * left.max(0.0)).sqrt().min(limits.acceleration);
    let acceleration = if acceleration > 0.0 { acceleration * room(limits.speed - velocity) } else { acceleration * room(limits.speed + velocity) };
    State { position: 0.3, velocity, acceleration }
}

/// Checks that every step is continuous and within the limits, and that the motion ends at the goal, at rest.
fn check(profile: &Profile, start: State, goal: f64, limits: Limits) {
    let steps = 1000;
    let dt = profile.duration_s() / f64::from(steps);
    assert_eq!(profile.at(0.0).position, start.position);
    let mut before = profile.at(0.0);
    for k in 1..=steps {
        let now = profile.at(f64::from(k) * dt);
        assert!(now.velocity.abs() <= limits.speed * (1.0 + 1e-9) + 1e-9, "speed {} of {}", now.velocity, limits.speed);
        assert!(now.acceleration.abs() <= limits.acceleration * (1.0 + 1e-9) + 1e-6, "acceleration {} of {}", now.acceleration, limits.acceleration);
        let moved = (now.position - before.position).abs();
        assert!(moved <= limits.speed * dt * (1.0 + 1e-6) + 1e-9, "a jump of {moved} in {dt} s");
        let changed = (now.velocity - before.velocity).abs();
        assert!(changed <= limits.acceleration * dt * (1.0 + 1e-6) + 1e-6, "a change of speed of {changed} in {dt} s");
        assert!((now.acceleration - before.acceleration).abs() <= limits.jerk * dt * (1.0 + 1e-6) + 1e-5, "jerk");
        before = now;
    }
    let end = profile.at(profile.duration_s());
    assert_eq!(end, State { position: goal, velocity: 0.0, acceleration: 0.0 });
    let last = profile.at(profile.duration_s() * (1.0 - 1e-9));
    assert!((last.position - goal).abs() < 1e-6, "a jump of {} at the end", last.position - goal);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn from_any_state_it_comes_to_rest_at_its_goal_within_the_limits(
        limits in limits(), speed in -1.0..1.0f64, acceleration in -1.0..1.0f64, way in -3.0..3.0f64, scale in -6.0..0.5f64,
    ) {
        let start = within(limits, speed, acceleration);
        let goal = start.position + way * 10f64.powf(scale);
        check(&Profile::to(start, goal, limits), start, goal, limits);
    }

    #[test]
    fn it_stops_from_any_state(limits in limits(), speed in -1.0..1.0f64, acceleration in -1.0..1.0f64) {
        let start = within(limits, speed, acceleration);
        let stop = Profile::stop(start, limits);
        check(&stop, start, stop.end(), limits);
    }

    #[test]
    fn a_longer_time_is_kept_to(limits in limits(), way in 0.01..3.0f64, longer in 1.0..5.0f64, speed in prop_oneof![Just(0.0), 0.0..1.0f64]) {
        // From a moving state the goal lies beyond the stop, so that any longer time is possible.
        let start = within(limits, speed, 0.0);
        let goal = Profile::stop(start, limits).end() + way;
        let duration_s = Profile::to(start, goal, limits).duration_s() * longer;
        let profile = Profile::to_in(start, goal, limits, duration_s);
        check(&profile, start, goal, limits);
        // From a moving state there are infeasible durations between two ways of stopping.
        let most_s = duration_s * if start.velocity == 0.0 { 1.0 + 1e-6 } else { 1.5 };
        prop_assert!(profile.duration_s() >= duration_s * (1.0 - 1e-6) && profile.duration_s() < most_s, "{} s, not {duration_s}", profile.duration_s());
    }

    #[test]
    fn planning_again_on_the_way_changes_nothing(limits in limits(), way in -3.0..3.0f64, part in 0.0..1.0f64) {
        let profile = Profile::to(State::default(), way, limits);
        let passed_s = part * profile.duration_s();
        let again = Profile::to(profile.at(passed_s), way, limits);
        prop_assert!((again.duration_s() + passed_s - profile.duration_s()).abs() < 1e-3, "{} s more", again.duration_s() + passed_s - profile.duration_s());
    }
}

/// Checks that a speed above a reduced limit returns to it, and that the motion ends at its goal.
#[test]
fn a_speed_above_the_limit_comes_down_to_it() {
    let limits = Limits { speed: 0.2, acceleration: 2.0, jerk: 20.0 };
    let profile = Profile::to(State { position: 0.0, velocity: 1.0, acceleration: 0.0 }, 3.0, limits);
    let middle = profile.at(profile.duration_s() / 2.0);
    assert!((middle.velocity - 0.2).abs() < 1e-12 && middle.acceleration.abs() < 1e-12);
    assert_eq!(profile.at(1e9).position, 3.0);
}

/// Each row contains start speed, start acceleration, distance, speed, acceleration, jerk, and the duration according to ruckig 0.19.4
/// (PyPI).
#[test]
fn it_takes_as_long_as_ruckig() {
    let cases = include!("oracle.rs");
    for ([velocity, acceleration, way, speed, most, jerk], duration_s) in cases {
        let limits = Limits { speed, acceleration: most, jerk };
        let ours = Profile::to(State { position: 0.0, velocity, acceleration }, way, limits).duration_s();
        assert!(ours > duration_s - 1e-9, "shorter than the shortest: {ours} of {duration_s}");
        assert!(ours < duration_s * 1.0001 + 1e-6, "{velocity} {acceleration} {way}: {ours} s, ruckig {duration_s} s");
    }
}
