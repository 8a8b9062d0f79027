// SPDX-License-Identifier: Apache-2.0
//! Survey of an arm's poses during loading: the gains that keep its joints stable, and the speeds and accelerations that its efforts can
//! achieve.
//!
//! There are two kinds of gains, both for a loop of 1 ms with the bias compensated, both critically damped if the joint moves only its
//! own inertia:
//!
//! - for a servo of **efforts**, independent of the other joints. The inertia that such a servo moves is 1/(M^-1)_ii, because the
//!   others give way; the fastest motion of all servos together is the largest eigenvalue of M^-1 D. Both are taken at the worst pose.
//! - for a servo of **decoupled efforts**: M_ii alone, because the others hold.
//!
//! With the largest velocity gain λ and the sampling period T, λT stays within 0.5: a phase margin of 75 degrees at the crossover λ, of
//! which the held command takes λT/2.
use super::arm::Arm;
use super::followers::fold;
use super::functions::state;
use super::motion::Motion;
use super::prescribed::PrescribedSolver;
use device::{Servo, UNLIMITED};
use std::f64::consts::PI;

/// Maximum bandwidth of a servo, 20 Hz: far below the 1 kHz of the loop, and far above that of a motion.
const BANDWIDTH_MAX: f64 = 125.0;
/// Maximum product of the velocity gain and the sampling period.
const GAIN_PERIOD: f64 = 0.5;
/// Period of the joint servos, s.
const SERVO_PERIOD_S: f64 = 1e-3;
/// Number of poses surveyed in addition to the starting pose.
const POSES: usize = 64;
/// Half-width of the surveyed range of a joint without limits, rad or m.
const RANGE_RAD: f64 = PI;
const RANGE_M: f64 = 0.5;
/// Default maximum speed and acceleration of a joint; surveyed accelerations never exceed the default.
const SPEED: f64 = PI;
const SPEED_M: f64 = 0.25;
const ACCELERATION_MAX: f64 = 5.0;
const ACCELERATION_MAX_M: f64 = 1.0;
/// Fraction of the effort left over by gravity and friction that accelerations may use, and the minimum fraction of the limit that is
/// assumed to be left over, because an arm that cannot hold some of its poses can still move in the others.
const EFFORT_SHARE: f64 = 0.7;
const EFFORT_LEFT: f64 = 0.1;
/// Minimum share of a joint in the effort of the worst case; a joint with a smaller share is not slowed down for it.
const SHARE_MIN: f64 = 0.05;
/// Maximum number of slowing-down iterations; each corrects the worst joint and pose.
const ROUNDS: usize = 200;
/// Number of power iterations for an eigenvalue, and the margin for their error.
const POWER_ROUNDS: usize = 30;
const POWER_RESERVE: f64 = 1.1;

/// The arm in one pose.
struct Pose {
    /// M, row-major, for all degrees of freedom.
    inertia: Vec<f64>,
    /// Effort of each degree of freedom that counteracts gravity.
    weight: Vec<f64>,
}

/// Computes the gains of each joint, its feasible acceleration, and the speed at which damping leaves enough of its effort.
pub(super) fn fit(arm: &mut Arm) {
    let poses = poses(arm);
    let period_s = SERVO_PERIOD_S.max(arm.timestep_ns as f64 * 1e-9);
    let alone = BANDWIDTH_MAX.min(0.5 * GAIN_PERIOD / period_s);
    let free = free_inertias(arm, &poses);
    let together = BANDWIDTH_MAX.min(0.5 * GAIN_PERIOD / (period_s * coupling(arm, &poses, &free)));
    let n = arm.apart.len();
    for (joint, free) in arm.joints.iter_mut().zip(free) {
        let v = joint.velocity;
        joint.inertia = poses.iter().map(|pose| pose.inertia[v * (n + 1)]).fold(f64::INFINITY, f64::min);
        joint.decoupled = gains(joint.inertia, alone);
        joint.part.servo = gains(free, together);
    }
    limit_speeds(arm, &poses);
    limit_accelerations(arm, &poses);
}

/// Returns gains for critical damping.
fn gains(inertia: f64, bandwidth: f64) -> Servo {
    Servo { kp: inertia * bandwidth * bandwidth, kd: 2.0 * inertia * bandwidth }
}

/// Returns the starting pose, and poses spread evenly over the ranges of the commanded joints, by the additive sequence of the
/// generalised golden ratio.
fn poses(arm: &Arm) -> Vec<Pose> {
    let size = |component| {
        // SAFETY: the model is valid.
        (unsafe { (arm.mujoco.mj_stateSize)(arm.model, component) }) as usize
    };
    let (motion, n) = (Motion::new(arm), arm.apart.len());
    // SAFETY: model and data belong together; key -1 resets to the zero configuration.
    unsafe { (arm.mujoco.mj_resetDataKeyframe)(arm.model, motion.data(), arm.home) };
    let mut position = vec![0.0; size(state::QPOS)];
    // SAFETY: as above; `position` has the size that `mj_stateSize` gave.
    unsafe { (arm.mujoco.mj_getState)(arm.model, motion.data(), position.as_mut_ptr(), state::QPOS) };
    let ratio = ratio(arm.joints.len());
    let pose = |k: usize| {
        for (j, joint) in arm.joints.iter().enumerate() {
            let whole = if joint.part.unit == "m" { RANGE_M } else { RANGE_RAD };
            let (low, high) = (joint.part.range_min.max(joint.part.home - whole), joint.part.range_max.min(joint.part.home + whole));
            let (low, high) = if low < high { (low, high) } else { (joint.part.home, joint.part.home) };
            let share = (0.5 + k as f64 * ratio.powi(-(j as i32 + 1))).fract();
            position[joint.position] = if k == 0 { joint.part.home } else { low + (high - low) * share };
        }
        // Leaders first.
        for follower in arm.followers.iter().rev() {
            position[follower.position] = follower.place(&position).unwrap_or(position[follower.position]);
        }
        let (mut inertia, mut weight) = (vec![0.0; n * n], vec![0.0; n]);
        // SAFETY: as above; `inertia` has n * n elements, `weight` n. The velocities are zero since the reset.
        unsafe {
            (arm.mujoco.mj_setState)(arm.model, motion.data(), position.as_ptr(), state::QPOS);
            (arm.mujoco.mj_step1)(arm.model, motion.data());
            (arm.mujoco.mj_fullM)(arm.model, motion.data(), inertia.as_mut_ptr());
            (arm.mujoco.mj_rne)(arm.model, motion.data(), 0, weight.as_mut_ptr());
        }
        fold(&arm.followers, &position, &mut inertia, &mut weight);
        Pose { inertia, weight }
    };
    (0..=POSES).map(pose).collect()
}

/// Returns the positive root of x^(d+1) = x + 1, whose powers yield points that fill d dimensions evenly.
fn ratio(dimensions: usize) -> f64 {
    (0..60).fold(1.5, |x: f64, _| (1.0 + x).powf(1.0 / (dimensions as f64 + 1.0)))
}

/// Returns the minimum inertia that each joint moves while all others give way.
fn free_inertias(arm: &Arm, poses: &[Pose]) -> Vec<f64> {
    let n = arm.apart.len();
    let (mut solver, mut effort, mut least) = (PrescribedSolver::new(n), vec![0.0; n], vec![f64::INFINITY; arm.joints.len()]);
    for pose in poses {
        solver.take(&pose.inertia, &arm.apart);
        for (joint, least) in arm.joints.iter().zip(&mut least) {
            effort[joint.velocity] = 1.0;
            *least = least.min(1.0 / solver.accelerations(&arm.apart, &effort)[joint.velocity]);
            effort[joint.velocity] = 0.0;
        }
    }
    least
}

/// Returns the largest eigenvalue of m^1/2 M^-1 m^1/2 over the poses, where m are the inertias of the joints moved alone; it is 1 without
/// coupling.
fn coupling(arm: &Arm, poses: &[Pose], inertias: &[f64]) -> f64 {
    let mut solver = PrescribedSolver::new(arm.apart.len());
    let largest = |pose: &Pose| {
        solver.take(&pose.inertia, &arm.apart);
        eigenvalue(arm, &mut solver, inertias)
    };
    poses.iter().map(largest).fold(1.0, f64::max) * POWER_RESERVE
}

/// Returns the largest eigenvalue in the pose whose inertia the solver has factorised, by power iteration.
fn eigenvalue(arm: &Arm, solver: &mut PrescribedSolver, inertias: &[f64]) -> f64 {
    let (mut vector, mut effort, mut value) = (vec![1.0; inertias.len()], vec![0.0; arm.apart.len()], 1.0);
    for _ in 0..POWER_ROUNDS {
        for (k, joint) in arm.joints.iter().enumerate() {
            effort[joint.velocity] = inertias[k].sqrt() * vector[k];
        }
        let answer = solver.accelerations(&arm.apart, &effort);
        for (k, joint) in arm.joints.iter().enumerate() {
            vector[k] = inertias[k].sqrt() * answer[joint.velocity];
        }
        value = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        vector.iter_mut().for_each(|x| *x /= value.max(f64::MIN_POSITIVE));
    }
    value
}

/// Reduces the maximum speeds at which damping would use more than half of the effort left by gravity and dry friction, if that is below
/// the default speed of a joint.
fn limit_speeds(arm: &mut Arm, poses: &[Pose]) {
    for joint in &mut arm.joints {
        let (v, most) = (joint.velocity, joint.part.effort_max);
        let usual = if joint.part.unit == "m" { SPEED_M } else { SPEED };
        let damped = 0.5 * left(most, heaviest(poses, v) + arm.friction[v]) / arm.damping[v];
        if damped < usual && most < UNLIMITED {
            joint.part.speed_max = joint.part.speed_max.min(damped);
        }
    }
}

fn heaviest(poses: &[Pose], v: usize) -> f64 {
    poses.iter().map(|pose| pose.weight[v].abs()).fold(0.0, f64::max)
}

/// Returns the effort that remains when part of the limit is used.
fn left(most: f64, used: f64) -> f64 {
    (most - used).max(EFFORT_LEFT * most)
}

/// Reduces the accelerations until all joints together need no more than their efforts, in every surveyed pose.
fn limit_accelerations(arm: &mut Arm, poses: &[Pose]) {
    let n = arm.apart.len();
    for joint in &mut arm.joints {
        joint.acceleration_max = if joint.part.unit == "m" { ACCELERATION_MAX_M } else { ACCELERATION_MAX };
    }
    for _ in 0..ROUNDS {
        let accelerations: Vec<f64> = arm.joints.iter().map(|joint| joint.acceleration_max).collect();
        let mut worst = (1.0, vec![]);
        for (pose, joint) in poses.iter().flat_map(|pose| arm.joints.iter().map(move |joint| (pose, joint))) {
            let v = joint.velocity;
            let friction = arm.friction[v] + arm.damping[v] * joint.part.speed_max.min(SPEED);
            let budget = EFFORT_SHARE * left(joint.part.effort_max, pose.weight[v].abs() + friction);
            let needs: Vec<f64> = arm.joints.iter().zip(&accelerations).map(|(other, a)| pose.inertia[v * n + other.velocity].abs() * a).collect();
            let ratio = needs.iter().sum::<f64>() / budget;
            if ratio > worst.0 {
                worst = (ratio, needs);
            }
        }
        let (ratio, needs) = worst;
        let whole: f64 = needs.iter().sum();
        for (joint, need) in arm.joints.iter_mut().zip(needs) {
            if need > SHARE_MIN * whole {
                joint.acceleration_max /= ratio;
            }
        }
        if ratio <= 1.0 {
            break;
        }
    }
}
