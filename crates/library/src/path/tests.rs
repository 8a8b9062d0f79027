// SPDX-License-Identifier: Apache-2.0
use super::samples::{Case, case, numbers, plan, plan_by};
use super::*;
use crate::profile::{JOINTS_MAX, Limits};

fn planned(case: &Case) -> Path {
    plan(1.0, &case.start, &case.points, &case.passing, &case.limits)
}

#[test]
fn every_limit_is_kept_and_positions_and_speeds_do_not_jump() {
    for seed in 1..300 {
        let case = case(seed);
        let (path, n) = (planned(&case), case.n);
        let steps = 3000;
        let dt = path.duration / f64::from(steps);
        let [mut q, mut v, mut a, mut before, mut slower] = [[0.0; JOINTS_MAX]; 5];
        for k in 0..=steps {
            let time_s = if k == steps { path.duration } else { f64::from(k) * dt };
            path.view().evaluate(time_s, &mut q[..n], &mut v[..n], &mut a[..n]);
            for i in 0..n {
                let limit = case.limits[i];
                assert!(v[i].abs() <= limit.speed * (1.0 + 1e-9), "seed {seed}: speed of joint {i}");
                assert!(a[i].abs() <= limit.acceleration * (1.0 + 1e-9), "seed {seed}: acceleration of joint {i}");
                if k > 0 {
                    assert!((q[i] - before[i]).abs() <= limit.speed * dt * (1.0 + 1e-6) + 1e-12, "seed {seed}: joint {i} jumps");
                    assert!((v[i] - slower[i]).abs() <= limit.acceleration * dt * (1.0 + 1e-6) + 1e-9, "seed {seed}: the speed of joint {i} jumps");
                }
            }
            (before, slower) = (q, v);
        }
        assert_eq!(q[..n], case.points.last().expect("a point")[..n], "seed {seed}: the end, exactly");
        path.view().evaluate(path.duration - 1e-9, &mut q[..n], &mut v[..n], &mut a[..n]);
        assert!((0..n).all(|i| (q[i] - before[i]).abs() < 1e-8), "seed {seed}: no jump at the end");
    }
}

#[test]
fn a_way_point_is_passed_within_its_blend() {
    for seed in 1..200 {
        let case = case(seed);
        let (path, n) = (planned(&case), case.n);
        let steps = 20_000;
        let mut q = [0.0; JOINTS_MAX];
        let mut nearest = vec![f64::INFINITY; case.points.len()];
        for k in 0..=steps {
            path.view().evaluate(path.duration * f64::from(k) / f64::from(steps), &mut q[..n], &mut [0.0; JOINTS_MAX][..n], &mut [0.0; JOINTS_MAX][..n]);
            for (point, nearest) in case.points.iter().zip(&mut nearest) {
                *nearest = nearest.min((0..n).fold(0.0, |most: f64, i| most.max((q[i] - point[i]).abs())));
            }
        }
        for (k, (nearest, passing)) in nearest.iter().zip(&case.passing).enumerate() {
            // A sample is up to half a step away from the nearest point.
            let between = 3.0 * path.duration / f64::from(steps);
            let doubled = k > 0 && case.points[k] == case.points[k - 1];
            assert!(doubled || *nearest <= passing.blend + between, "seed {seed}: way-point {k}, {nearest} for {}", passing.blend);
        }
    }
}

#[test]
fn blends_save_time() {
    let corner = [[1.0; JOINTS_MAX], {
        let mut q = [1.0; JOINTS_MAX];
        q[1] = 2.0;
        q
    }];
    let limits = [Limits { speed: 1.0, acceleration: 2.0, jerk: 1.0 }; 2];
    let time = |blend| plan(1.0, &[0.0, 1.0], &corner, &[Passing { blend, speed: 1.0 }; 2], &limits).duration;
    // Two lines of 1 from rest to rest: 1/1 + 1/2 s each.
    assert!((time(0.0) - 3.0).abs() < 1e-12);
    // Half of each line in the blend: passed at its maximum rate, sqrt(2 * 0.5 * 2), limited to 1.
    assert!((time(0.2) - 2.5).abs() < 0.2 && time(0.2) < time(0.05) && time(0.05) < time(0.0), "{} {}", time(0.2), time(0.05));
}

#[test]
fn a_way_point_on_the_line_is_passed_at_full_speed_where_it_may_be() {
    let points = [[1.0; JOINTS_MAX], [2.0; JOINTS_MAX]];
    let time = |blend| plan(1.0, &[0.0], &points, &[Passing { blend, speed: 1.0 }; 2], &[Limits { speed: 1.0, acceleration: 2.0, jerk: 1.0 }]).duration;
    assert!((time(0.1) - 2.5).abs() < 1e-12 && (time(0.0) - 3.0).abs() < 1e-12, "{} {}", time(0.1), time(0.0));
}

#[test]
fn nowhere_to_go_takes_no_time() {
    let path = plan(1.0, &[0.5], &[[0.5; JOINTS_MAX]; 3], &[Passing { blend: 0.1, speed: 1.0 }; 3], &[Limits { speed: 1.0, acceleration: 1.0, jerk: 1.0 }]);
    assert_eq!((path.points, path.duration), (1, 0.0));
    let (mut q, mut v) = ([0.0], [1.0]);
    path.view().evaluate(0.0, &mut q, &mut v, &mut [0.0]);
    assert_eq!((q, v), ([0.5], [0.0]));
}

/// Returns a path that is too long for the stack.
fn long() -> Box<LongPath> {
    let memory = Box::<LongPath>::new_zeroed();
    // SAFETY: the fields are numbers, for which all-zero bytes are valid.
    unsafe { memory.assume_init() }
}

/// Returns a smooth path of six joints through `count` points: sums of sines.
fn smooth(seed: u64, count: usize) -> Case {
    let (mut number, n) = (numbers(seed), 6);
    let waves: Vec<[f64; 3]> = (0..3 * n).map(|_| [number(-0.5, 0.5), number(1.0, 20.0), number(0.0, 6.0)]).collect();
    let at = |s: f64, i: usize| waves[3 * i..3 * i + 3].iter().map(|[size, rate, phase]| size * (rate * s + phase).sin()).sum::<f64>();
    let point = |k: usize| std::array::from_fn(|i| if i < n { at(k as f64 / count as f64, i) } else { 0.0 });
    let limits = (0..n).map(|_| Limits { speed: number(0.5, 3.0), acceleration: number(2.0, 10.0), jerk: 1.0 }).collect();
    let start = point(0)[..n].to_vec();
    Case { n, start, points: (1..=count).map(point).collect(), passing: vec![Passing { blend: 0.01, speed: number(0.3, 3.0) }; count], limits }
}

#[test]
fn a_plan_is_the_same_in_one_part_and_in_many_and_in_either_table() {
    for seed in 1..100 {
        let case = case(seed);
        let path = planned(&case);
        for steps in [1, 7, 1000] {
            let mut found = long();
            plan_by(steps, &mut found.table(), &case.start, &case.points, &case.passing, &case.limits);
            let points = path.points as usize;
            assert_eq!((found.points, found.duration.to_bits()), (path.points, path.duration.to_bits()), "seed {seed}");
            assert_eq!(found.q[..points], path.q[..points]);
            for (found, path) in [(&found.through[..], &path.through[..]), (&found.begin[..], &path.begin[..]), (&found.reach[..], &path.reach[..])] {
                assert_eq!(found[..points], path[..points], "seed {seed}, {steps} steps");
            }
        }
    }
}

#[test]
fn a_path_of_4096_points_keeps_every_limit_and_passes_every_point() {
    for seed in 1..4 {
        let case = smooth(seed, LONG_POINTS_MAX);
        let (mut path, n) = (long(), case.n);
        let parts = plan_by(2048, &mut path.table(), &case.start, &case.points, &case.passing, &case.limits);
        assert_eq!((path.points as usize, parts), (LONG_POINTS_MAX + 1, (5 * LONG_POINTS_MAX).div_ceil(2048)));
        let steps = 200_000;
        let [mut q, mut v, mut a, mut slower] = [[0.0; JOINTS_MAX]; 4];
        let (mut next, mut nearest) = (0, f64::INFINITY);
        let dt = path.duration / f64::from(steps);
        for k in 0..=steps {
            path.view().evaluate(f64::from(k) * dt, &mut q[..n], &mut v[..n], &mut a[..n]);
            for i in 0..n {
                let limit = case.limits[i];
                assert!(v[i].abs() <= limit.speed * (1.0 + 1e-9) && a[i].abs() <= limit.acceleration * (1.0 + 1e-9), "seed {seed}: joint {i} at {k}");
                assert!((v[i] - slower[i]).abs() <= limit.acceleration * dt * (1.0 + 1e-6) + 1e-9, "seed {seed}: the speed of joint {i} jumps");
            }
            slower = v;
            // The points are passed in order: each is nearest before the next one is.
            while next < case.points.len() {
                let off = (0..n).fold(0.0, |most: f64, i| most.max((q[i] - case.points[next][i]).abs()));
                if off <= nearest && k < steps {
                    nearest = off;
                    break;
                }
                assert!(nearest.min(off) <= 1e-4, "seed {seed}: point {next} is passed at {nearest}");
                (next, nearest) = (next + 1, f64::INFINITY);
            }
        }
        assert_eq!((next, &q[..n]), (case.points.len(), &case.points[LONG_POINTS_MAX - 1][..n]));
    }
}

#[test]
fn way_points_that_are_dense_do_not_make_a_path_creep() {
    // A quarter of a circle of two joints in steps of 0.1, 1 and 10 mrad, compared with every eighth point of it.
    for step in [1e-4, 1e-3, 1e-2] {
        let arc = |every: usize| -> Vec<[f64; JOINTS_MAX]> {
            let place = |k: usize| {
                let angle = k as f64 * step / 0.3;
                let mut q = [0.0; JOINTS_MAX];
                (q[0], q[1]) = (0.3 * angle.sin(), 0.3 * (1.0 - angle.cos()));
                q
            };
            (1..=64 / every).map(|k| place(k * every)).collect()
        };
        let limits = [Limits { speed: 3.0, acceleration: 5.0, jerk: 50.0 }; 2];
        let duration = |points: Vec<[f64; JOINTS_MAX]>| {
            let passing = vec![Passing { blend: 1e-3, speed: 3.0 }; points.len()];
            plan(1.0, &[0.0; 2], &points, &passing, &limits).duration
        };
        let (dense, sparse) = (duration(arc(1)), duration(arc(8)));
        assert!(dense < 1.5 * sparse, "steps of {step} rad: {dense} s of {sparse} s");
    }
}

#[test]
fn of_two_parts_of_the_lines_the_better_one_is_used_and_no_limit_is_lost() {
    for seed in 1..300 {
        let case = case(seed);
        let best = planned(&case).duration;
        for share in BLEND_SHARES {
            let mut path = <Path as opengpac::Type>::zero();
            let mut table = path.table();
            let mut planning = Planning::begin(&mut table, 0, &case.start, &[*share]);
            case.points.iter().zip(&case.passing).for_each(|(point, passing)| table.add(point, *passing));
            assert!(planning.advance(&mut table, &case.limits, &mut { usize::MAX }));
            assert!(best <= path.duration, "seed {seed}: {best} s, and {} s with {share}", path.duration);
        }
    }
}
