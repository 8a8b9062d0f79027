// SPDX-License-Identifier: Apache-2.0
use crate::pace;
use crate::path::generator::{BAD_OVERRIDE, NO_PLAN, OTHER_SIZE, PLACES, path_generator};
use crate::path::{BEING_PLANNED, Path};
use crate::span::Span;
use crate::takeover::{Brake, Tail};
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};

path_generator! {
    /// Path generator: setpoint = q(τ) of a planned path, τ being running time scaled by the override.
    ///
    /// Joints that move at the start are braked first, each on its own, and the planner plans from the positions where they come to rest.
    /// `override` scales the speed (0 holds), `holding` ramps down to rest on the path and reports `held`; both change the pace no faster
    /// than the acceleration limit of each joint allows. The output `complete` and the condition `finished` are reported with the last
    /// set-point, which is exactly the last way-point. Time lost because releases were skipped is not made up for; if the time lost in a
    /// single gap exceeds `gap_max`, the motion comes to rest on the path and `gap` is reported. Faults: 1 there is no path; 2 it was
    /// planned for a different number of joints; 3 an override is not between 0 and 1.
    PathGenerator,
    #[input(asynchronous)]
    path: Path
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::samples::{Case, case, numbers, plan};

    fn generator(case: &Case) -> PathGenerator {
        PathGenerator {
            n: case.n as u32, path: plan(1.0, &case.start, &case.points, &case.passing, &case.limits), r#override: [1.0; 16], cell_override: [1.0; 16], holding: false,
            acceleration_max: std::array::from_fn(|i| case.limits.get(i).map_or(1.0, |l| l.acceleration)), setpoint: [0.0; 16], velocity: [0.0; 16],
            progress: 0.0, complete: false, finished: Condition::new(), held: Condition::new(), plan: 0.0, time_s: 0.0, pace: 0.0, span: Span::default(), is_lost: false, tail: Tail::default(), gap: ConditionOf::new(0.0), start: [0.0; 16], start_velocity: [0.0; 16], last_velocity: [0.0; 16], last_acceleration: [0.0; 16], last_time: [i64::MIN; 16], braking: [[0.0; 4]; 16],
            jerk_max: [50.0; 16], lead: 0.02, brake: Brake::default(), gap_max: [0.5; 16],
            setpoint_acceleration: [0.0; 16], setpoint_time: [0; 16], lost: 0.0,
        }
    }

    fn at(k: i64) -> Invocation {
        Invocation { number: k as u64, time_ns: k * 20_000_000, now_ns: 0 }
    }

    /// Steps the generator to its end, with override and hold changed by `change`; checks every step of every joint against the limits.
    fn run(seed: u64, case: &Case, mut change: impl FnMut(i64, &mut PathGenerator)) -> PathGenerator {
        const SPAN: f64 = 0.02;
        let mut block = generator(case);
        let (mut before, mut slower): ([f64; 16], [f64; 16]) = ([0.0; 16], [0.0; 16]);
        for k in 0..40_000 {
            change(k, &mut block);
            (block.finished, block.held) = (Condition::new(), Condition::new());
            assert_eq!(block.step(&at(k)), Outcome::Done);
            for i in 0..case.n {
                let limit = case.limits[i];
                let speed = if k == 0 { 0.0 } else { (block.setpoint[i] - before[i]) / SPAN };
                let acceleration = (speed - slower[i]) / SPAN;
                assert!(speed.abs() <= limit.speed * (1.0 + 1e-6), "seed {seed}: speed {speed} of joint {i} at {k}");
                assert!(acceleration.abs() <= limit.acceleration * 1.02 + 1e-6, "seed {seed}: acceleration {acceleration} of joint {i} at {k}, limit {}", limit.acceleration);
                (before[i], slower[i]) = (block.setpoint[i], speed);
            }
            if block.complete {
                assert!(block.finished.is_reported());
                return block;
            }
        }
        panic!("seed {seed}: it does not end");
    }

    #[test]
    fn limits_hold_under_any_override_and_hold_and_it_arrives_exactly() {
        for seed in 1..150 {
            let case = case(seed);
            let mut number = numbers(seed + 1000);
            let block = run(seed, &case, |k, block| {
                if k % 7 == 0 {
                    block.r#override = [number(-0.3, 1.5).clamp(0.0, 1.0); 16];
                    block.holding = number(0.0, 1.0) < 0.3;
                }
                if k > 3000 {
                    (block.r#override, block.holding) = ([1.0; 16], false);
                }
            });
            assert_eq!(block.setpoint[..case.n], case.points.last().expect("a point")[..case.n]);
        }
    }

    #[test]
    fn it_holds_where_it_is_and_goes_on() {
        let case = case(7);
        let (mut held_at, mut place) = (None, [0.0; 16]);
        run(7, &case, |k, block| {
            block.holding = (40..200).contains(&k);
            if block.held.is_reported() {
                held_at = held_at.or(Some(k));
                assert_eq!(block.velocity, [0.0; 16]);
                if k < 200 && held_at != Some(k) {
                    assert_eq!(block.setpoint, place, "it stands still");
                }
            }
            place = block.setpoint;
        });
        assert!(held_at.is_some_and(|k| k < 150), "{held_at:?}");
    }

    #[test]
    fn without_a_path_nothing_is_stored() {
        let case = case(1);
        let mut block = generator(&case);
        block.path.plan = 0.0;
        assert_eq!(block.step(&at(0)), Outcome::Fault(NO_PLAN));
        let mut block = PathGenerator { n: 9, ..generator(&case) };
        assert_eq!(block.step(&at(0)), Outcome::Fault(OTHER_SIZE));
    }
}
