// SPDX-License-Identifier: Apache-2.0
//! Arms with 6 and 7 joints, and random programs of moves for them.
use library::kinematics::chain::{Arm, Chain, HINGE};
use library::kinematics::inverse::Ranges;
use library::kinematics::pose::Pose;
use library::profile::{JOINTS_MAX, Limits};
use library::queue::{QueuedMove, QueuedPath, Surroundings};
use opengpac::Type;
use std::f64::consts::FRAC_PI_2;

/// Returns numbers from a small deterministic generator.
pub fn numbers(seed: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move |low, high| {
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        low + (high - low) * ((x >> 11) as f64 / (1u64 << 53) as f64)
    }
}

/// Returns an arm with the geometry of a UR5e.
pub fn six() -> (Chain, Vec<f64>) {
    let (d1, a2, a3, d4, d5, d6) = (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996);
    let (x, half) = (a2 + a3, std::f64::consts::FRAC_1_SQRT_2);
    let axes = [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]];
    let anchors = [[0.0; 3], [0.0, 0.0, d1], [a2, 0.0, d1], [x, 0.0, d1], [x, -d4, d1], [x, -d4, d1 - d5]];
    let chain = chain(&axes, &anchors, [x, -d4 - d6, d1 - d5, half, half, 0.0, 0.0]);
    (chain, vec![0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2, -FRAC_PI_2, 0.0])
}

/// Returns an arm with the geometry of a Panda.
pub fn seven() -> (Chain, Vec<f64>) {
    let (z, y) = ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
    let axes = [z, y, z, [0.0, -1.0, 0.0], z, [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let anchors = [[0.0; 3], [0.0, 0.0, 0.333], [0.0; 3], [0.0825, 0.0, 0.649], [0.0, 0.0, 1.033], [0.0, 0.0, 1.033], [0.088, 0.0, 0.0]];
    let chain = chain(&axes, &anchors, [0.088, 0.0, 0.926, 0.0, 1.0, 0.0, 0.0]);
    (chain, vec![0.0, -0.4, 0.2, -2.0, 0.1, 1.6, 0.7])
}

pub fn chain(axes: &[[f64; 3]], anchors: &[[f64; 3]], home: [f64; 7]) -> Chain {
    let n = axes.len();
    let mut chain = Chain { joints: n as i32, home, ..Chain::NOTHING };
    chain.kind[..n].fill(HINGE);
    chain.axis[..n].copy_from_slice(axes);
    chain.anchor[..n].copy_from_slice(anchors);
    chain
}

/// A program: an arm, its limits, and its moves.
pub struct Program {
    pub chain: Chain,
    pub n: usize,
    pub start: [f64; JOINTS_MAX],
    pub joints: Vec<Limits>,
    pub moves: Vec<QueuedMove>,
}

pub fn wide(values: &[f64]) -> [f64; JOINTS_MAX] {
    std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0))
}

/// Returns a move of the joints at their maximum speeds.
pub fn joints_to(number: i64, goal: &[f64], joints: &[Limits]) -> QueuedMove {
    let speed: Vec<f64> = joints.iter().map(|joint| joint.speed).collect();
    let acceleration: Vec<f64> = joints.iter().map(|joint| joint.acceleration).collect();
    QueuedMove { number, mode: 1, joints: wide(goal), speed: wide(&speed), acceleration: wide(&acceleration), ..<QueuedMove as Type>::zero() }
}

/// Returns a move of the tool on a straight line.
pub fn line_to(number: i64, goal: &Pose, speed: f64) -> QueuedMove {
    let (linear, angular) = ([speed, 1.5, 15.0], [2.0, 6.0, 60.0]);
    QueuedMove { number, kind: 1, mode: 1, pose: goal.numbers(), linear, angular, ..<QueuedMove as Type>::zero() }
}

impl Program {
    pub fn around<'a>(&'a self, arm: &'a Arm<'a>) -> Surroundings<'a> {
        Surroundings { arm, joints: &self.joints, ranges: Ranges { min: &[-6.5; JOINTS_MAX], max: &[6.5; JOINTS_MAX] } }
    }
}

pub fn new_path() -> Box<QueuedPath> {
    let memory = Box::<QueuedPath>::new_zeroed();
    // SAFETY: the fields are numbers, for which all-zero bytes are valid.
    unsafe { memory.assume_init() }
}
