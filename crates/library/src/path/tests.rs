// SPDX-License-Identifier: Apache-2.0
use super::samples::{Case, case};
use super::*;

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
            path.evaluate(time_s, &mut q[..n], &mut v[..n], &mut a[..n]);
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
        path.evaluate(path.duration - 1e-9, &mut q[..n], &mut v[..n], &mut a[..n]);
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
            path.evaluate(path.duration * f64::from(k) / f64::from(steps), &mut q[..n], &mut [0.0; JOINTS_MAX][..n], &mut [0.0; JOINTS_MAX][..n]);
            for (point, nearest) in case.points.iter().zip(&mut nearest) {
                *nearest = nearest.min((0..n).fold(0.0, |most: f64, i| most.max((q[i] - point[i]).abs())));
            }
        }
        for (k, (nearest, passing)) in nearest.iter().zip(&case.passing).enumerate() {
            // A sample is up to half a step away from the nearest place.
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
    // Half the way of each line in the blend: passed at its maximum rate, sqrt(2 * 0.5 * 2), which the limit makes 1.
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
    path.evaluate(0.0, &mut q, &mut v, &mut [0.0]);
    assert_eq!((q, v), ([0.5], [0.0]));
}
