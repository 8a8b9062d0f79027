// SPDX-License-Identifier: Apache-2.0
use super::*;
use crate::kinematics::chain::samples::{HOME, six_joints};
use crate::path::samples::numbers;

const JOINT: Limits = Limits { speed: 0.25, acceleration: 5.0, jerk: 50.0 };
const LINEAR: Limits = Limits { speed: f64::INFINITY, acceleration: 0.5, jerk: 5.0 };
const ANGULAR: Limits = Limits { speed: f64::INFINITY, acceleration: 2.5, jerk: 25.0 };
const CYCLE_S: f64 = 0.02;

fn twist(linear: [f64; 3], angular: [f64; 3], in_tool: bool) -> Twist {
    Twist { linear, angular, in_tool }
}

/// Runs `steps` set-points, checking each against the limits of the joints, and returns the poses of the tool.
fn run(jog: &mut ToolJog, steps: usize, range: f64, mut wanted: impl FnMut(usize) -> (Twist, f64)) -> Vec<Pose> {
    let chain = six_joints();
    let arm = chain.read(6).expect("a chain");
    let mut last = jog.q;
    let mut poses = Vec::new();
    for k in 0..steps {
        let (twist, distance) = wanted(k);
        let ranges = Ranges { min: &[-range; 6], max: &[range; 6] };
        jog.advance(&arm, &Wish { twist, distance, share: 1.0, linear: LINEAR, angular: ANGULAR, joints: &[JOINT; 6], ranges, cycle_s: CYCLE_S });
        let now = *jog.setpoint();
        for i in 0..6 {
            let (v, a) = (now[i] - last[0][i], now[i] - 2.0 * last[0][i] + last[1][i]);
            let j = now[i] - 3.0 * last[0][i] + 3.0 * last[1][i] - last[2][i];
            assert!(v.abs() <= 1.00001 * JOINT.speed * CYCLE_S && a.abs() <= 1.00001 * JOINT.acceleration * CYCLE_S.powi(2), "joint {i} at {k}");
            assert!(j.abs() <= 1.00001 * JOINT.jerk * CYCLE_S.powi(3), "jerk of joint {i} at {k}: {}", j / CYCLE_S.powi(3));
            assert!(now[i].abs() <= range, "joint {i} at {k}: {}", now[i]);
        }
        last = [now, last[0], last[1]];
        poses.push(arm.posture(&now[..6]).tool);
    }
    poses
}

fn at(q: [f64; 6]) -> ToolJog {
    let mut jog = ToolJog::default();
    let mut all = [0.0; JOINTS_MAX];
    all[..6].copy_from_slice(&q);
    jog.begin(&all);
    jog
}

#[test]
fn the_speed_along_the_axis_is_held_and_the_distance_is_exact() {
    for in_tool in [false, true] {
        let mut jog = at(HOME);
        let poses = run(&mut jog, 300, 6.3, |_| (twist([0.0, 0.05, 0.0], [0.0; 3], in_tool), 0.1));
        let start = six_joints().read(6).expect("a chain").posture(&HOME).tool;
        let axis = if in_tool { rotate(start.quaternion, [0.0, 1.0, 0.0]) } else { [0.0, 1.0, 0.0] };
        for (k, two) in poses.windows(2).enumerate() {
            let (way, turn) = two[0].to(&two[1]);
            let along: f64 = way.iter().zip(&axis).map(|(a, b)| a * b).sum();
            assert!(length(turn) < 1e-7 && (length(way) - along.abs()).abs() < 1e-7, "off the axis at {k}");
            assert!(along <= 0.05 * CYCLE_S + 1e-9);
            if (20..90).contains(&k) {
                assert!((along / CYCLE_S - 0.05).abs() < 1e-6, "{} m/s at {k}", along / CYCLE_S);
            }
        }
        assert!((length(start.to(&poses[299]).0) - 0.1).abs() < 1e-9 && jog.has_arrived() && jog.obstacle().is_none());
    }
}

#[test]
fn a_turn_leaves_the_tool_where_it_is() {
    let mut jog = at(HOME);
    let start = six_joints().read(6).expect("a chain").posture(&HOME).tool;
    let poses = run(&mut jog, 300, 6.3, |_| (twist([0.0; 3], [0.0, 0.0, 0.2], true), 0.3));
    assert!(poses.iter().all(|pose| length(start.to(pose).0) < 1e-6));
    assert!((length(start.to(&poses[299]).1) - 0.3).abs() < 1e-8 && jog.has_arrived());
}

#[test]
fn at_the_end_of_its_reach_and_of_a_range_it_rests_on_its_line() {
    for (range, expected) in [(6.3, Obstacle::Singular), (1.7, Obstacle::Limit(1))] {
        let mut jog = at(HOME);
        let start = six_joints().read(6).expect("a chain").posture(&HOME).tool;
        let poses = run(&mut jog, 2000, range, |_| (twist([0.25, 0.0, 0.0], [0.0; 3], false), f64::INFINITY));
        assert_eq!(jog.obstacle(), Some(expected));
        let gone = start.to(&poses[1999]).0;
        assert!(gone[0] > 0.02 && gone[1].abs() < 1e-6 && gone[2].abs() < 1e-6, "{gone:?}");
        let back = run(&mut jog, 200, range, |_| (twist([-0.1, 0.0, 0.0], [0.0; 3], false), f64::INFINITY));
        assert!(start.to(&back[199]).0[0] < gone[0] - 0.05);
    }
}

/// Repeatedly jogs the tool against the limit of its reach, each time from rest: the tool creeps closer to the limit, and can always move
/// back.
#[test]
fn the_way_back_is_free_however_often_a_jog_was_pressed_against_its_end() {
    let chain = six_joints();
    let arm = chain.read(6).expect("a chain");
    for seed in 0..12 {
        let mut number = numbers(seed + 1);
        let q = if seed == 0 { HOME } else { std::array::from_fn(|i| HOME[i] + number(-0.3, 0.3)) };
        let out: [f64; 3] = if seed == 0 { [0.0, 0.0, 1.0] } else { std::array::from_fn(|_| number(-1.0, 1.0)) };
        let out = scale(out, 1.0 / length(out));
        let mut jog = at(q);
        for press in 0..5 {
            let speed = if number(0.0, 1.0) < 0.5 { 0.25 } else { 0.05 };
            let there = *jog.setpoint();
            jog.begin(&there);
            run(&mut jog, 2000, 6.3, |_| (twist(scale(out, speed), [0.0; 3], false), f64::INFINITY));
            assert!(jog.obstacle().is_some(), "seed {seed}, press {press}");
            let end = arm.posture(&jog.setpoint()[..6]).tool;
            for speed in [0.25, 0.05] {
                let mut back = jog;
                back.begin(jog.setpoint());
                let poses = run(&mut back, 200, 6.3, |_| (twist(scale(out, -speed), [0.0; 3], false), f64::INFINITY));
                let gone = length(end.to(&poses[199]).0);
                assert!(gone > 0.02, "seed {seed}, press {press}: {gone} m back at {speed} m/s, {:?}", back.obstacle());
            }
        }
    }
}

#[test]
fn directions_speeds_and_stops_at_random_keep_every_limit() {
    for seed in 1..60 {
        let mut number = numbers(seed);
        let q = std::array::from_fn(|i| HOME[i] + number(-0.8, 0.8));
        let mut jog = at(q);
        let mut now = (Twist::default(), f64::INFINITY);
        run(&mut jog, 600, 2.6, |k| {
            if k % 40 == 0 {
                let mut part = |most: f64| if number(0.0, 1.0) < 0.5 { 0.0 } else { number(-most, most) };
                let (linear, angular) = (std::array::from_fn(|_| part(0.25)), std::array::from_fn(|_| part(1.0)));
                now = (twist(linear, angular, number(0.0, 1.0) < 0.5), if number(0.0, 1.0) < 0.3 { 0.02 } else { f64::INFINITY });
            }
            now
        });
        run(&mut jog, STOP_MAX + 5, 2.6, |_| (Twist::default(), f64::INFINITY));
        assert!(jog.is_at_rest(), "seed {seed}");
    }
}
